"""What stands around an arm, and how far its links are from it and from each other."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

_HALVINGS: Final = 12


def segment_distance(p1: Array, q1: Array, p2: Array, q2: Array) -> Array:
    """Return the distance between segments ``p1 q1`` and ``p2 q2``.

    The least of the distance from each end to the other segment, and of that between the lines where their feet lie
    inside both.

    Args:
        p1, q1, p2, q2: ``(..., 3, n)``, broadcast against each other.
    """
    u, v, w = q1 - p1, q2 - p2, p1 - p2
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e, apart = _dot(u, w), _dot(v, w), _dot(w, w)

    def squared(s: Array | float, t: Array | float) -> Array:
        """Return the square of the distance between the points at the shares s of the one and t of the other."""
        return np.asarray(apart + s * (a * s - 2.0 * b * t + 2.0 * d) + t * (c * t - 2.0 * e))

    on_u, on_v = 1.0 / np.where(a > 0, a, 1.0), 1.0 / np.where(c > 0, c, 1.0)
    nearest = squared(0.0, np.clip(e * on_v, 0.0, 1.0))
    np.minimum(nearest, squared(1.0, np.clip((e + b) * on_v, 0.0, 1.0)), out=nearest)
    np.minimum(nearest, squared(np.clip(-d * on_u, 0.0, 1.0), 0.0), out=nearest)
    np.minimum(nearest, squared(np.clip((b - d) * on_u, 0.0, 1.0), 1.0), out=nearest)
    sine = a * c - b * b
    crossing = sine > 1e-12 * a * c
    sine = np.where(crossing, sine, 1.0)
    s, t = (b * e - c * d) / sine, (a * e - b * d) / sine
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    np.minimum(nearest, np.where(inside, squared(s, t), np.inf), out=nearest)
    return np.asarray(np.sqrt(np.maximum(nearest, 0.0)))


def box_distance(p: Array, q: Array, low: Array, high: Array) -> Array:
    """Return the distance of segments ``p q``, each end ``(..., 3, n)``, from a box along the axes, ``(..., n)``.

    The square of the distance of a point from a box is convex along a line, so the nearest one is found by halving: to
    1/4096 of the segment's length, and never too near.

    Args:
        low, high: Corners of the box, ``(3,)``; infinite where it does not end.
    """
    along = q - p
    shape = (*p.shape[:-2], p.shape[-1])
    first, last = np.zeros(shape), np.ones(shape)
    for _ in range(_HALVINGS):
        middle = (first + last) / 2.0
        point = p + middle[..., None, :] * along
        rising = _dot(along, point - np.clip(point, low[:, None], high[:, None])) > 0
        first, last = np.where(rising, first, middle), np.where(rising, middle, last)
    ends = (p, q, p + ((first + last) / 2.0)[..., None, :] * along)
    apart = [np.linalg.norm(point - np.clip(point, low[:, None], high[:, None]), axis=-2) for point in ends]
    return np.asarray(np.min(apart, axis=0))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :] + a[..., 2, :] * b[..., 2, :])


_LENGTH: Final = 1e-3  # m: what is shorter is no link of its own
#: Less room, and not zero, is meant in another unit [m].
LEAST_CLEARANCE: Final = 1e-3
#: Lines of links come so near each other where the links meet, and links joined by less are neighbours [m].
_MEETING: Final = 0.05
_LOOKED_AT: Final = 2000
_Segments = list[tuple[Array, Array]]


def skeleton(robot: Robot, q: Array | Postures) -> list[Array]:
    """Return the base's origin, the origins of the joints and of the flange in the world, each ``(n, 3)`` [m].

    What is shorter than 1 mm between two of them is left out.
    """
    kinematics = robot.forward_kinematics(q)
    start = np.broadcast_to(np.array(robot.base.translation)[:, None], kinematics.position.shape)
    points = [start, *(kinematics.origin(i) for i in robot.moving[: len(robot.joints)]), kinematics.position]
    selected = [points[0].T]
    for point in points[1:]:
        if np.linalg.norm(point.T - selected[-1], axis=1).max(initial=0.0) > _LENGTH:
            selected.append(point.T)
    return selected


def smallest_clearance(robot: Robot, q: Array | Postures, near: float) -> Array:
    """Return the smallest distance between links that are not neighbours [m], ``(n,)``; infinite if there are none.

    Args:
        near: Links that hang together by links shorter than this in all count as neighbours [m].
    """
    segments, pairs = _apart(robot, q)
    smallest = np.full(segments[0][0].shape[0], np.inf)
    for i, j, connection in pairs:
        if connection >= near:
            np.minimum(smallest, _distance(segments, i, j), out=smallest)
    return smallest


def refuse_clearance(robot: Robot, clearance: float, low: Array, high: Array, where: str) -> None:
    """Refuse a clearance that would say nothing of links that can meet.

    Links whose connection is shorter than the clearance count as neighbours, so that a large one asks less than a small
    one does.

    Args:
        clearance: Between the middle lines of links that are not neighbours [m].
        low, high: Limits of the joints, ``(joints,)`` [rad or m].
        where: The entry, for messages.

    Raises:
        InputError: If it is less than 1 mm, the robot has no links that are not neighbours, or links that come within
            50 mm of each other count as neighbours by it, though they hang together by 50 mm or more.
    """
    if clearance < LEAST_CLEARANCE:
        raise InputError(
            "so little room is kept by no arm",
            parameter="constraints",
            where=where,
            came=f"{clearance * 1e3:g} mm",
            allowed=f"{LEAST_CLEARANCE * 1e3:g} mm or more",
            cure="Check its unit.",
        )
    q = np.clip(robot.random_configurations(_LOOKED_AT, np.random.default_rng(0)), low, high)
    segments, pairs = _apart(robot, q)
    if not any(connection >= _MEETING for *_, connection in pairs):
        raise InputError(
            f"{robot.name} has no two links between which a clearance could be kept: all are neighbours",
            parameter="constraints",
            where=where,
            came=f"{clearance * 1e3:g} mm",
            cure="Leave it out.",
        )
    meeting = [c for i, j, c in pairs if c >= _MEETING and _distance(segments, i, j).min() < _MEETING]
    most = min(meeting) if meeting else max(connection for *_, connection in pairs)
    if clearance > most * (1.0 + 1e-9):
        raise InputError(
            "links that can meet would count as neighbours, as their connection is shorter than the clearance",
            parameter="constraints",
            where=where,
            came=f"{clearance * 1e3:g} mm",
            allowed=f"up to {math.floor(most * 1e3 + 1e-6)} mm for {robot.name}",
            cure="Lower it, or check its unit. `clearance` keeps that much room to floor, boxes and links.",
        )


def _apart(robot: Robot, q: Array | Postures) -> tuple[_Segments, list[tuple[int, int, float]]]:
    """Return the lines of the links, and by number which two are no neighbours, with the length between them [m]."""
    links = skeleton(robot, q)
    segments = [(links[i], links[i + 1]) for i in range(len(links) - 1)]
    flange = len(segments)
    for target in robot.targets:
        segments.append((links[-1], robot.world_poses(q, target.name)[0]))
    lengths = [float(np.linalg.norm(b - a, axis=1).max(initial=0.0)) for a, b in segments]
    between = {(i, j): range(i + 1, min(j, flange)) for i, j in combinations(range(len(segments)), 2) if i < flange}
    return segments, [(i, j, sum(lengths[k] for k in among)) for (i, j), among in between.items() if among]


def _distance(segments: _Segments, i: int, j: int) -> Array:
    return segment_distance(*(end.T for end in (*segments[i], *segments[j])))


#: Room that is kept between the arm and everything else, unless told [m].
CLEARANCE: Final = 0.05
#: What carries an arm that stands, and one that hangs or is on a wall.
FLOOR: Final = "floor"
MOUNTING: Final = "mounting surface"
#: A robot stands on a floor if free fall points this near to the base's -z.
_STANDING: Final = np.cos(np.deg2rad(30.0))


@dataclass(frozen=True, eq=False)
class KeepOut:
    """A box that the arm stays out of, its faces along the axes of the base frame."""

    name: str  #: In messages.
    low: Array  #: low, high: two corners [m], ``(3,)``; infinite where it does not end.
    high: Array


@dataclass(frozen=True, eq=False)
class Cell:
    """What stands around an arm, in its base frame."""

    floor: float | None = 0.0  #: Height of the floor [m]; None if there is none to keep clear of.
    boxes: tuple[KeepOut, ...] = field(default=())  #: What the arm stays out of.
    clearance: float = CLEARANCE  #: Room to keep to each of them, and between links that are not neighbours [m].
    #: What the plane at the height `floor` is called: the mounting surface of an arm that does not stand on a floor.
    surface: str = FLOOR


def stands(robot: Robot) -> bool:
    """Return whether a robot stands on a floor: on a wall or a ceiling free fall points another way."""
    fall = np.array(robot.gravity)
    size = float(np.linalg.norm(fall))
    return bool(size > 0.0 and -fall[2] >= _STANDING * size)


def refuse_floor_above_base(floor: float) -> None:
    """Refuse a floor that the base of the robot would stand in."""
    if floor > 0.0:
        raise InputError(
            "the floor is above the base of the robot",
            parameter="floor",
            came=f"{floor * 1e3:g} mm",
            allowed="0 mm or less: its height in the base frame",
            cure="A robot on a pedestal has its floor below 0. Something higher than the base is a box to keep out of.",
        )


def refuse_floor_elsewhere(floor: float) -> None:
    """Refuse a floor that is not the mounting surface of a robot that hangs or is on a wall.

    Heights are along the z-axis of the base, which is not upright there: a plane at one of them is no floor.
    """
    if floor != 0.0:
        raise InputError(
            "the robot does not stand by its gravity, so no height in its base frame is that of a floor",
            parameter="floor",
            came=f"{floor * 1e3:g} mm",
            allowed="0 mm: the surface on which it is mounted, kept clear without saying so",
            cure="State the true floor as a box of the constraints (`keep_out`), in the base frame.",
        )


def boxes_of(corners: Mapping[str, tuple[Array, Array]]) -> tuple[KeepOut, ...]:
    """Return boxes by their names, with their lowest and highest corners [m]."""
    return tuple(KeepOut(name, low, high) for name, (low, high) in corners.items())
