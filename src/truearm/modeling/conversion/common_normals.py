"""Into DH, Hayati and the S-model: frames on the common normals of neighbouring axes.

Without beta the numbers are those of :mod:`truearm.modeling.formats.dh_table`, which refuses nearly parallel axes.
Stone's gamma and b are free to choose where each frame stands on its axis; zero puts it where DH does.

With beta (Hayati and Mirmirani 1985) the axes of a pair need no common normal: the next frame stands where the next
axis meets the plane across this one (standard form), or at the point of the next axis nearest to this frame (modified
form, whose a lies along the tilted x), and alpha and beta tilt z into it. That is regular unless the axes are square,
so it is what nearly parallel and parallel pairs get, and the others keep the common normal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.conventions import JOINT
from truearm.modeling.conversion.links import Links
from truearm.modeling.formats.dh_table import DHConvention, dh_table
from truearm.modeling.lines import (
    ONE_LINE,
    JointAxis,
    across,
    base_and_flange,
    common_normal,
    first_frame,
    joint_axes,
    nearer_sense,
    turn,
)
from truearm.modeling.robot import Robot

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
    x, here = start[:3, 0], start[:3, 3]
    before: list[Row] = []  # theta and d of each joint
    behind: list[Row] = []  # a, alpha and beta to the next one
    for axis, following in pairwise(axes):
        if axis.angle(following) < _BETA:
            find = _tilted_in_modified_form if modified else _tilted_in_standard_form
            normal, link, next_x, landing = find(axis, following, x, here)
            foot = here
        else:
            normal, foot, landing = common_normal(axis, following, x, here)
            link = {"a": float((landing - foot) @ normal), "alpha": turn(axis.along, following.along, normal)}
            next_x = normal
        before.append({JOINT: turn(x, normal, axis.along), "d": float((foot - here) @ axis.along)})
        behind.append(link)
        x, here = next_x, landing
    last = axes[-1]
    normal, foot = across(flange[:3, :3], last.along), last.nearest(flange[:3, 3])
    before.append({JOINT: turn(x, normal, last.along), "d": float((foot - here) @ last.along)})
    nothing: Row = {"a": 0.0, "alpha": 0.0}
    behind = [nothing, *behind] if modified else [*behind, nothing]
    rows: list[Mapping[str, float]] = [
        {**fixed, **moving} if modified else {**moving, **fixed} for moving, fixed in zip(before, behind, strict=True)
    ]
    return Links(tuple(rows), start)


def _tilted_in_standard_form(
    axis: JointAxis, following: JointAxis, x: Array, here: Array
) -> tuple[Array, Row, Array, Array]:
    """Return the x before the tilt, the row, the x behind it and the next origin of ``Tx(a) Rx(alpha) Ry(beta)``."""
    way = float((here - following.point) @ axis.along) / float(following.along @ axis.along)
    landing = following.point + way * following.along
    normal = _side(landing - here, x)
    y = np.cross(axis.along, normal)
    alpha, beta = _tilt(following.along, normal, y, axis.along)
    next_x = math.cos(beta) * normal + math.sin(beta) * (math.sin(alpha) * y - math.cos(alpha) * axis.along)
    return normal, {"a": float((landing - here) @ normal), "alpha": alpha, "beta": beta}, next_x, landing


def _tilted_in_modified_form(
    axis: JointAxis, following: JointAxis, x: Array, here: Array
) -> tuple[Array, Row, Array, Array]:
    """Return the same for ``Rx(alpha) Ry(beta) Tx(a)``."""
    landing = following.nearest(here)
    square = x - (x @ following.along) * following.along
    next_x = _side(landing - here, square / np.linalg.norm(square))
    normal = np.cross(np.cross(following.along, next_x), axis.along)
    normal = normal * math.copysign(1.0, float(normal @ next_x)) / np.linalg.norm(normal)
    y = np.cross(axis.along, normal)
    alpha, beta = _tilt(following.along, normal, y, axis.along)
    return normal, {"alpha": alpha, "beta": beta, "a": float((landing - here) @ next_x)}, next_x, landing


def _side(gap: Array, before: Array) -> Array:
    """Return the direction of a gap between two axes, or the x direction before if they meet."""
    distance = float(np.linalg.norm(gap))
    return before if distance < ONE_LINE else nearer_sense(gap / distance, before, gap)


def _tilt(along: Array, x: Array, y: Array, z: Array) -> tuple[float, float]:
    """Return alpha and beta [rad] with ``Rx(alpha) Ry(beta) z`` along a direction of the frame x, y, z."""
    right, up = float(along @ y), float(along @ z)
    return math.atan2(-right, up), math.atan2(float(along @ x), math.hypot(right, up))
