"""Links of a robot in another convention: lines of axes, common normals, directions of axes, URDF joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions.convention import JOINT
from truearm.engine.robot.conventions.cpc import rotation_to
from truearm.engine.robot.dh_table import DHConvention, dh_table
from truearm.engine.robot.lines import (
    ONE_LINE,
    JointAxis,
    across,
    at_zero,
    base_and_flange,
    common_normal,
    first_frame,
    joint_axes,
    nearer_sense,
    turn,
)
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_tree import roll_pitch_yaw


@dataclass(frozen=True)
class Links:
    """The links of a robot in another convention; what is left behind the last row becomes the flange."""

    rows: tuple[Mapping[str, float], ...]  #: From base to flange [m and rad].
    #: ``T_world_base`` ``(4, 4)`` of a convention whose base frame lies on the first axis; None if the base stays.
    base: Array | None = None


# Into the zero-reference model and the product of exponentials: axes in the base frame at zero joint positions.
def zero_reference(robot: Robot) -> Links:
    """Return direction and point of every axis."""
    return Links(tuple(_named("axis_", along) | _named("", point) for _, along, point in _axes_in_base(robot)))


def exponentials(robot: Robot) -> Links:
    """Return the twist of every joint, ``v = -w x p``; of a sliding one only its direction v."""
    return Links(
        tuple(
            _named("v_", along) if slides else _named("w_", along) | _named("v_", -np.cross(along, point))
            for slides, along, point in _axes_in_base(robot)
        )
    )


def _axes_in_base(robot: Robot) -> list[tuple[bool, Array, Array]]:
    """Return for each joint whether it slides, its direction and a point of its axis [m] in the base frame."""
    base = base_and_flange(robot)[0]
    R, origin = base[:3, :3], base[:3, 3]
    return [
        (axis.joint.kind == "prismatic", R.T @ axis.along, R.T @ (axis.point - origin)) for axis in joint_axes(robot)
    ]


def _named(prefix: str, vector: Array) -> dict[str, float]:
    return {f"{prefix}{a}": float(v) for a, v in zip("xyz", vector, strict=True)}


# Into DH, Hayati and the S-model: frames on the common normals of neighbouring axes.
#
# Without beta the numbers are those of :mod:`truearm.engine.robot.dh_table`, which refuses nearly parallel axes.
# Stone's gamma and b are free to choose where each frame stands on its axis; zero puts it where DH does.
#
# With beta (Hayati and Mirmirani 1985) the axes of a pair need no common normal: the next frame stands where the next
# axis meets the plane across this one (standard form), or at the point of the next axis nearest to this frame (modified
# form, whose a lies along the tilted x), and alpha and beta tilt z into it. That is regular unless the axes are square,
# so it is what nearly parallel and parallel pairs get, and the others keep the common normal.

#: Below this angle [rad] two axes get a beta: a common normal would lie more than six of their distances away.
_BETA: Final = math.radians(10.0)

Row = dict[str, float]


def dh(robot: Robot, convention_name: DHConvention) -> Links:
    """Return the links of a DH table."""
    table = dh_table(robot, convention_name)
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = table.base.rotation, table.base.translation
    return Links(tuple(joint.row for joint in table.joints()), base)


def s_model(robot: Robot) -> Links:
    """Return the links of the S-model with Stone's gamma and b at zero."""
    plain = dh(robot, "standard-dh")
    return Links(tuple({**row, "gamma": 0.0, "b": 0.0} for row in plain.rows), plain.base)


def hayati(robot: Robot, *, modified: bool) -> Links:
    """Return DH links with beta between axes that are parallel or nearly so."""
    axes = joint_axes(robot)
    base, flange = base_and_flange(robot)
    start = first_frame(base, axes[0])
    x, origin = start[:3, 0], start[:3, 3]
    before: list[Row] = []  # theta and d of each joint
    behind: list[Row] = []  # a, alpha and beta to the next one
    for axis, following in pairwise(axes):
        if axis.angle(following) < _BETA:
            find = _tilted_in_modified_form if modified else _tilted_in_standard_form
            normal, link, next_x, landing = find(axis, following, x, origin)
            foot = origin
        else:
            normal, foot, landing = common_normal(axis, following, x, origin)
            link = {"a": float((landing - foot) @ normal), "alpha": turn(axis.along, following.along, normal)}
            next_x = normal
        before.append({JOINT: turn(x, normal, axis.along), "d": float((foot - origin) @ axis.along)})
        behind.append(link)
        x, origin = next_x, landing
    last = axes[-1]
    normal, foot = across(flange[:3, :3], last.along), last.nearest(flange[:3, 3])
    before.append({JOINT: turn(x, normal, last.along), "d": float((foot - origin) @ last.along)})
    nothing: Row = {"a": 0.0, "alpha": 0.0}
    behind = [nothing, *behind] if modified else [*behind, nothing]
    rows: list[Mapping[str, float]] = [
        {**fixed, **moving} if modified else {**moving, **fixed} for moving, fixed in zip(before, behind, strict=True)
    ]
    return Links(tuple(rows), start)


def _tilted_in_standard_form(
    axis: JointAxis, following: JointAxis, x: Array, origin: Array
) -> tuple[Array, Row, Array, Array]:
    """Return the x before the tilt, the row, the x behind it and the next origin of ``Tx(a) Rx(alpha) Ry(beta)``."""
    way = float((origin - following.point) @ axis.along) / float(following.along @ axis.along)
    landing = following.point + way * following.along
    normal = _side(landing - origin, x)
    y = np.cross(axis.along, normal)
    alpha, beta = _tilt(following.along, normal, y, axis.along)
    next_x = math.cos(beta) * normal + math.sin(beta) * (math.sin(alpha) * y - math.cos(alpha) * axis.along)
    return normal, {"a": float((landing - origin) @ normal), "alpha": alpha, "beta": beta}, next_x, landing


def _tilted_in_modified_form(
    axis: JointAxis, following: JointAxis, x: Array, origin: Array
) -> tuple[Array, Row, Array, Array]:
    """Return the same for ``Rx(alpha) Ry(beta) Tx(a)``."""
    landing = following.nearest(origin)
    square = x - (x @ following.along) * following.along
    next_x = _side(landing - origin, square / np.linalg.norm(square))
    normal = np.cross(np.cross(following.along, next_x), axis.along)
    normal = normal * math.copysign(1.0, float(normal @ next_x)) / np.linalg.norm(normal)
    y = np.cross(axis.along, normal)
    alpha, beta = _tilt(following.along, normal, y, axis.along)
    return normal, {"alpha": alpha, "beta": beta, "a": float((landing - origin) @ next_x)}, next_x, landing


def _side(gap: Array, before: Array) -> Array:
    """Return the direction of a gap between two axes, or the x direction before if they meet."""
    distance = float(np.linalg.norm(gap))
    return before if distance < ONE_LINE else nearer_sense(gap / distance, before, gap)


def _tilt(along: Array, x: Array, y: Array, z: Array) -> tuple[float, float]:
    """Return alpha and beta [rad] with ``Rx(alpha) Ry(beta) z`` along a direction of the frame x, y, z."""
    right, up = float(along @ y), float(along @ z)
    return math.atan2(-right, up), math.atan2(float(along @ x), math.hypot(right, up))


# Into CPC, MCPC and combinations of translations: from each frame straight to the direction of the next axis.
#
# The frame of a link stands where the next axis meets the plane across that axis through the frame before, so that no
# common normal is needed and nothing happens where axes are parallel. What is singular lies elsewhere: b = -z for CPC,
# an axis along x for the two angles of the others. There a quarter turn in the joint before, its theta_offset, puts
# x elsewhere.

#: Beyond this share of x in a direction (30 deg from it) x is turned away.
_ALONG_X: Final = math.cos(math.radians(30.0))

#: Row entries and rotation ``(3, 3)`` from z to a direction of the frame ``(3,)``.
Tilt = Callable[[Array], tuple[dict[str, float], Array]]


def cpc(robot: Robot) -> Links:
    """Return the links of CPC: the published numbers, small rotations at zero."""
    return _links(robot, _direction, ("beta", "l_x", "l_y", "l_z"))


def mcpc(robot: Robot) -> Links:
    """Return the links of MCPC."""
    return _links(robot, _angles("alpha", "beta"), ("gamma", "x", "y", "z"))


def translations(robot: Robot) -> Links:
    """Return combinations of translations: to a point of the next axis, then along it."""
    axes = joint_axes(robot)
    frame = base_and_flange(robot)[0]
    rows = []
    for number, axis in enumerate(axes):
        slides = frame[:3, :3].T @ (axis.point - frame[:3, 3])
        angles, R = _angles("rx", "ry")(frame[:3, :3].T @ axis.along)
        frame = _moved(frame, slides, R)
        aside = _aside(frame, axes[number + 1].along) if number + 1 < len(axes) else 0.0
        rows.append({**dict(zip("xyz", map(float, slides), strict=True)), **angles, JOINT: aside})
        frame = _moved(frame, np.zeros(3), _about_z(aside))
    return Links(tuple(rows))


def joint_errors(robot: Robot) -> Links:
    """Return the robot as it is as a design without errors; one given by translations keeps its frames."""
    if robot.convention_name == "translations":
        rows = [
            {column: robot.values[f"{column}_{number}"] for column in robot.convention.row_units(joint.kind)}
            for number, joint in enumerate(robot.joints, 1)
        ]
    else:
        rows = [dict(row) for row in translations(robot).rows]
    return Links(tuple({**row, "rz": row[JOINT], JOINT: 0.0} for row in rows))


def _links(robot: Robot, tilt: Tilt, last: tuple[str, str, str, str]) -> Links:
    """Return links ``Rz(theta) tilt Rz Tx Ty Tz``, with the columns `last`; inner ones have no Rz and no Tz."""
    axes = joint_axes(robot)
    base, flange = base_and_flange(robot)
    frame = start = first_frame(base, axes[0])
    turn, *slides = last
    rows = []
    ends = [*axes[1:], JointAxis(robot.joints[-1], flange[:3, 2], flange[:3, 3])]
    for end in ends:
        aside = 0.0 if tilt is _direction else _aside(frame, end.along)
        frame = _moved(frame, np.zeros(3), _about_z(aside))
        entries, R = tilt(frame[:3, :3].T @ end.along)
        frame = _moved(frame, np.zeros(3), R)
        row = {JOINT: aside, **entries}
        if end is ends[-1]:
            rotation = frame[:3, :3].T @ flange[:3, :3]
            row[turn] = math.atan2(rotation[1, 0], rotation[0, 0])
            frame = _moved(frame, np.zeros(3), _about_z(row[turn]))
        way = frame[:3, :3].T @ (end.point - frame[:3, 3])
        row |= dict(zip(slides if end is ends[-1] else slides[:2], map(float, way), strict=False))
        frame = _moved(frame, np.array([way[0], way[1], 0.0]), np.eye(3))
        rows.append(row)
    return Links(tuple(rows), start)


def _direction(b: Array) -> tuple[dict[str, float], Array]:
    x, y, z = (float(v) for v in b / np.linalg.norm(b))
    return {"b_x": x, "b_y": y, "b_z": z}, rotation_to((x, y, z))


def _angles(first: str, second: str) -> Tilt:
    """Return the tilt ``Rx(first) Ry(second)``."""

    def tilt(along: Array) -> tuple[dict[str, float], Array]:
        x, y, z = (float(v) for v in along)
        a, b = math.atan2(-y, z), math.atan2(x, math.hypot(y, z))
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        R = np.array([[cb, 0.0, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]])
        return {first: a, second: b}, R

    return tilt


def _aside(frame: Array, along: Array) -> float:
    """Return the turn about z [rad] after which a direction is well away from x."""
    return math.pi / 2 if abs(float(frame[:3, 0] @ along)) > _ALONG_X else 0.0


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _moved(frame: Array, slide: Array, R: Array) -> Array:
    """Return a frame after a slide in its own directions and then a rotation, ``(4, 4)``."""
    moved = frame.copy()
    moved[:3, 3] += frame[:3, :3] @ slide
    moved[:3, :3] = frame[:3, :3] @ R
    return moved


def origins(robot: Robot) -> Links:
    """Return the origins of a robot's joints, whose own zeros belong to them."""
    frame = base_and_flange(robot)[0]
    passed, rows = list(robot.base_elements), []
    for link in robot.link_elements:
        moving = next(i for i, element in enumerate(link) if element.variable is not None)
        next_frame = at_zero(robot, [*passed, *link[: moving + 1]])
        place = np.linalg.inv(frame) @ next_frame
        row = dict(zip("xyz", map(float, place[:3, 3]), strict=True))
        row |= dict(zip(("roll", "pitch", "yaw"), roll_pitch_yaw(place[:3, :3]), strict=True))
        rows.append(row | dict(zip(("axis_x", "axis_y", "axis_z"), link[moving].axis or (0.0, 0.0, 1.0), strict=True)))
        frame = next_frame
        passed += link
    return Links(tuple(rows))
