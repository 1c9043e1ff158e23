"""Into CPC, MCPC and combinations of translations: from each frame straight to the direction of the next axis.

The frame of a link stands where the next axis meets the plane across that axis through the frame before, so that no
common normal is needed and nothing happens where axes are parallel. What is singular lies elsewhere: b = -z for CPC,
an axis along x for the two angles of the others. There a quarter turn in the joint before, its theta_offset, puts
x elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.conventions import JOINT
from truearm.modeling.conventions.cpc import rotation_to
from truearm.modeling.conversion.links import Links
from truearm.modeling.lines import JointAxis, base_and_flange, first_frame, joint_axes
from truearm.modeling.robot import Robot

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
    here = base_and_flange(robot)[0]
    rows = []
    for number, axis in enumerate(axes):
        slides = here[:3, :3].T @ (axis.point - here[:3, 3])
        angles, R = _angles("rx", "ry")(here[:3, :3].T @ axis.along)
        here = _moved(here, slides, R)
        aside = _aside(here, axes[number + 1].along) if number + 1 < len(axes) else 0.0
        rows.append({**dict(zip("xyz", map(float, slides), strict=True)), **angles, JOINT: aside})
        here = _moved(here, np.zeros(3), _about_z(aside))
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
    here = start = first_frame(base, axes[0])
    turn, *slides = last
    rows = []
    ends = [*axes[1:], JointAxis(robot.joints[-1], flange[:3, 2], flange[:3, 3])]
    for end in ends:
        aside = 0.0 if tilt is _direction else _aside(here, end.along)
        here = _moved(here, np.zeros(3), _about_z(aside))
        entries, R = tilt(here[:3, :3].T @ end.along)
        here = _moved(here, np.zeros(3), R)
        row = {JOINT: aside, **entries}
        if end is ends[-1]:
            rest = here[:3, :3].T @ flange[:3, :3]
            row[turn] = math.atan2(rest[1, 0], rest[0, 0])
            here = _moved(here, np.zeros(3), _about_z(row[turn]))
        way = here[:3, :3].T @ (end.point - here[:3, 3])
        row |= dict(zip(slides if end is ends[-1] else slides[:2], map(float, way), strict=False))
        here = _moved(here, np.array([way[0], way[1], 0.0]), np.eye(3))
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
