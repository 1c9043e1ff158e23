"""DH tables: the plain table of a, alpha, d and theta of any robot, found from its joint axes.

A table holds four numbers a joint because it puts each frame on the common normal of two neighbouring axes
(Denavit and Hartenberg 1955; Craig 1986 for the modified form). Here the joint axes of the robot as it is
now are taken as lines in space, and the frames are built on their common normals. What the table has no
room for, before the first axis and behind the last, goes into a base and a flange transform, so that the
table gives every pose of the robot exactly. Joint effects are no part of it.

Where two axes are parallel any common normal will do: the one through the frame before is taken (d = 0).
Where they are nearly parallel there is only one, and it runs away, as far as their distance over their
angle: 31 m for 270 mm and half a degree. Such a table would be useless and is refused. The line of a
sliding joint is free to move sideways, so that it can always be laid through one neighbour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions import convention
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.lines import (
    PARALLEL,
    JointAxis,
    across,
    at_zero,
    base_and_flange,
    common_normal,
    first_frame,
    frame,
    joint_axes,
    turn,
)
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

DHConvention = Literal["standard-dh", "modified-dh"]
#: With Hayati's beta a table can hold nearly parallel axes too.
TableConvention = Literal["standard-dh", "modified-dh", "hayati"]

#: Below this angle [rad] the common normal of two axes that are not parallel runs away.
_NEARLY_PARALLEL: Final = math.radians(0.5)
#: Below this rest [m, rad] what lies behind the last axis is a DH link's own a and alpha.
_NEGLIGIBLE: Final = 1e-12


@dataclass(frozen=True)
class DHRow:
    """A joint's row; the joint variable is added to `theta_offset`, or to `d` where it slides."""

    joint: str  #: Name of the joint.
    kind: JointKind  #: ``revolute`` or ``prismatic``.
    a: float  #: a, d: [m].
    alpha: float  #: alpha, theta_offset, beta: [rad]; beta is that of a Hayati table.
    d: float
    theta_offset: float
    beta: float = 0.0


@dataclass(frozen=True)
class DHTable:
    """A robot as ``base``, then one link for each row, then ``flange``."""

    #: ``standard-dh``, ``modified-dh`` or ``hayati``: the order in which a row's transforms stand.
    convention_name: TableConvention
    rows: tuple[DHRow, ...]  #: From base to flange.
    base: Transform  #: From the world to the first row.
    flange: Transform  #: From the last row to the flange.

    def joints(self) -> tuple[Joint, ...]:
        """Return the rows as joints of a robot of this convention."""
        columns = convention(self.convention_name).row_units("revolute")
        return tuple(Joint(r.joint, r.kind, {c: getattr(r, c) for c in columns}) for r in self.rows)


def dh_table(robot: Robot, convention_name: DHConvention) -> DHTable:
    """Return the DH table of a robot with its current parameter values.

    The base frame of the table lies on the first axis, where that is nearest to the robot's base, and its x
    axis is as near to the base's as can be; for most robots it is the base itself.

    Args:
        convention_name: ``standard-dh`` or ``modified-dh``.
    """
    axes = _axes(robot)
    base, flange = base_and_flange(robot)
    start = first_frame(base, axes[0])
    # theta, d, a, alpha in the order of the chain: the first two to the common normal, the others along it.
    # The standard form cuts the chain behind them into links, the modified form before a and alpha.
    numbers: list[tuple[float, float, float, float]] = []
    x, origin = start[:3, 0], start[:3, 3]
    for axis, following in pairwise(axes):
        normal, foot, landing = common_normal(axis, following, x, origin)
        numbers.append(
            (
                turn(x, normal, axis.along),
                float((foot - origin) @ axis.along),
                float((landing - foot) @ normal),
                turn(axis.along, following.along, normal),
            )
        )
        x, origin = normal, landing
    last = axes[-1]
    normal, foot = across(flange[:3, :3], last.along), last.nearest(flange[:3, 3])
    behind = np.linalg.inv(frame(normal, last.along, foot)) @ flange
    own = convention_name == "standard-dh" and np.abs(behind[[1, 1, 2], [3, 0, 0]]).max() < _NEGLIGIBLE < behind[0, 0]
    a, alpha = (float(behind[0, 3]), math.atan2(behind[2, 1], behind[1, 1])) if own else (0.0, 0.0)
    theta, d = turn(x, normal, last.along), float((foot - origin) @ last.along)
    numbers.append((theta, d, a, alpha))
    rows = _rows(robot.joints, numbers, convention_name)
    table = DHTable(convention_name, rows, _transform(start), Transform())
    return replace(table, flange=_transform(np.linalg.inv(start @ _links_at_zero(table)) @ flange))


def _axes(robot: Robot) -> list[JointAxis]:
    """Return the joint axes of a robot, joint variables at zero, or refuse those that are nearly parallel."""
    axes = joint_axes(robot)
    for i in reversed(range(len(axes))):
        if axes[i].joint.kind == "prismatic":
            near = [j for j in (i + 1, i - 1) if 0 <= j < len(axes) and _nearly_parallel(axes[i], axes[j])]
            axes[i] = replace(axes[i], point=axes[near[0]].point) if near else axes[i]
    for axis, following in pairwise(axes):
        if _nearly_parallel(axis, following) and (axis.point != following.point).any():
            raise InputError(
                "the axes of two joints are nearly parallel, so that their common normal runs away",
                where=robot.name,
                came=f"{axis.joint.name} and {following.joint.name}, "
                f"{math.degrees(axis.angle(following)):.3g} deg apart",
                allowed=f"parallel to 1e-9 rad, or at least {math.degrees(_NEARLY_PARALLEL):g} deg apart",
                cure="Hayati's beta describes such axes: take the convention hayati (a format of 'truearm "
                "export' too), keep the robot file, or write a URDF.",
            )
    return axes


def _nearly_parallel(axis: JointAxis, other: JointAxis) -> bool:
    return PARALLEL < axis.angle(other) < _NEARLY_PARALLEL


def _transform(frame: Array) -> Transform:
    return Transform.from_matrix(frame[:3, :3], frame[:3, 3])


def _rows(
    joints: Sequence[Joint], numbers: Sequence[tuple[float, float, float, float]], convention_name: DHConvention
) -> tuple[DHRow, ...]:
    normals = [(a, alpha) for _, _, a, alpha in numbers]
    if convention_name == "modified-dh":
        normals = [(0.0, 0.0), *normals[:-1]]
    return tuple(
        DHRow(joint.name, joint.kind, a + 0.0, alpha + 0.0, d + 0.0, theta + 0.0)  # + 0.0: no minus zero
        for joint, (theta, d, _, _), (a, alpha) in zip(joints, numbers, normals, strict=True)
    )


def _links_at_zero(table: DHTable) -> Array:
    """Return the product of a table's rows with the joint variables at zero, ``(4, 4)``."""
    robot = Robot("table", "", "", table.convention_name, table.joints())
    return at_zero(robot, (element for link in robot.link_elements for element in link))
