"""Whether an arm touches itself, with a capsule along the line from each joint to the next."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.planning.constraints.segments import segment_distance

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
    kept = [points[0].T]
    for point in points[1:]:
        if np.linalg.norm(point.T - kept[-1], axis=1).max(initial=0.0) > _LENGTH:
            kept.append(point.T)
    return kept


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
