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

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final, Literal

import numpy as np

from truearm.errors import InputError
from truearm.files import read_text
from truearm.modeling.chain import Array, Chain
from truearm.modeling.conventions import JOINT, JointKind, convention
from truearm.modeling.robot import Joint, Robot
from truearm.modeling.transform import Transform
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, SHOWN_AS, as_number, checked_unit, sized_si, written

DHConvention = Literal["standard-dh", "modified-dh"]

#: Below this angle [rad] two axes are parallel: they part by less than 1 nm over the reach of a robot.
_PARALLEL: Final = 1e-9
#: Below this angle [rad] the common normal of two axes that are not parallel runs away.
_NEARLY_PARALLEL: Final = math.radians(0.5)
#: Below this distance [m] two parallel axes are one line.
_ONE_LINE: Final = 1e-12
#: Below this rest [m, rad] what lies behind the last axis is a DH link's own a and alpha.
_REST: Final = 1e-12

_COLUMNS: Final = {"a": "m", "alpha": "rad", "d": "m", JOINT: "rad"}


@dataclass(frozen=True)
class DHRow:
    """A joint's row; the joint variable is added to `theta_offset`, or to `d` where it slides.

    Attributes
    ----------
    joint
        Name of the joint.
    kind
        ``revolute`` or ``prismatic``.
    a, d
        [m].
    alpha, theta_offset
        [rad].
    """

    joint: str
    kind: JointKind
    a: float
    alpha: float
    d: float
    theta_offset: float


@dataclass(frozen=True)
class DHTable:
    """A robot as ``base``, then one link for each row, then ``flange``.

    Attributes
    ----------
    convention_name
        ``standard-dh`` or ``modified-dh``: the order in which a row's transforms stand.
    rows
        From base to flange.
    base
        From the world to the first row.
    flange
        From the last row to the flange.
    """

    convention_name: DHConvention
    rows: tuple[DHRow, ...]
    base: Transform
    flange: Transform

    def joints(self) -> tuple[Joint, ...]:
        """Return the rows as joints of a robot of this convention."""
        return tuple(Joint(r.joint, r.kind, {c: getattr(r, c) for c in _COLUMNS}) for r in self.rows)


@dataclass(frozen=True)
class _Axis:
    """A joint's axis in the world: unit direction ``(3,)`` and a point on it [m] ``(3,)``."""

    joint: Joint
    along: Array
    point: Array

    def nearest(self, point: Array) -> Array:
        """Return the point of the line that is nearest to `point`."""
        return self.point + ((point - self.point) @ self.along) * self.along

    def angle(self, other: _Axis) -> float:
        """Return the angle between two lines [rad], 0 to 90 deg."""
        return math.atan2(
            float(np.linalg.norm(np.cross(self.along, other.along))), abs(float(self.along @ other.along))
        )


def dh_table(robot: Robot, convention_name: DHConvention) -> DHTable:
    """Return the DH table of a robot with its current parameter values.

    The base frame of the table lies on the first axis, where that is nearest to the robot's base, and its x
    axis is as near to the base's as can be; for most robots it is the base itself.

    Parameters
    ----------
    convention_name
        ``standard-dh`` or ``modified-dh``.
    """
    axes = _axes(robot)
    base, flange = _world(robot)
    across = _across(base[:3, :3], axes[0].along)
    start = _frame(across, axes[0].along, axes[0].nearest(base[:3, 3]))
    # theta, d, a, alpha in the order of the chain: the first two to the common normal, the others along it.
    # The standard form cuts the chain behind them into links, the modified form before a and alpha.
    numbers: list[tuple[float, float, float, float]] = []
    here = start[:3, 3]
    for axis, following in pairwise(axes):
        normal, foot, landing = _common_normal(axis, following, across, here)
        numbers.append(
            (
                _turn(across, normal, axis.along),
                float((foot - here) @ axis.along),
                float((landing - foot) @ normal),
                _turn(axis.along, following.along, normal),
            )
        )
        across, here = normal, landing
    last = axes[-1]
    normal, foot = _across(flange[:3, :3], last.along), last.nearest(flange[:3, 3])
    behind = np.linalg.inv(_frame(normal, last.along, foot)) @ flange
    own = convention_name == "standard-dh" and np.abs(behind[[1, 1, 2], [3, 0, 0]]).max() < _REST < behind[0, 0]
    a, alpha = (float(behind[0, 3]), math.atan2(behind[2, 1], behind[1, 1])) if own else (0.0, 0.0)
    theta, d = _turn(across, normal, last.along), float((foot - here) @ last.along)
    numbers.append((theta, d, a, alpha))
    rows = _rows(robot.joints, numbers, convention_name)
    table = DHTable(convention_name, rows, _transform(start), Transform())
    return replace(table, flange=_transform(np.linalg.inv(start @ _links_at_zero(table)) @ flange))


def _axes(robot: Robot) -> list[_Axis]:
    """Return the joint axes of a robot, joint variables at zero, or refuse those that are nearly parallel."""
    sweep = robot.trunk.sweep(np.zeros((len(robot.joints), 1)), robot.values)
    places = {e.variable: i for i, e in enumerate(sweep.elements) if e.variable is not None}
    axes = [
        _Axis(joint, sweep.axis(places[i])[:, 0], sweep.origin(places[i])[:, 0]) for i, joint in enumerate(robot.joints)
    ]
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
                cure="What describes such axes is Hayati's beta: keep the robot file (convention hayati or "
                "modified-hayati), or write a URDF.",
            )
    return axes


def _nearly_parallel(one: _Axis, other: _Axis) -> bool:
    return _PARALLEL < one.angle(other) < _NEARLY_PARALLEL


def _world(robot: Robot) -> tuple[Array, Array]:
    """Return the base and the flange frame in the world, joint variables at zero, each ``(4, 4)``."""
    found = []
    for elements in (robot.base_elements, robot.trunk.elements):
        sweep = Chain(elements).sweep(np.zeros((len(robot.joints), 1)), robot.values)
        rotation = sweep.matrix()[0]
        found.append(_frame(rotation[:, 0], rotation[:, 2], sweep.position[:, 0]))
    return found[0], found[1]


def _common_normal(axis: _Axis, following: _Axis, across: Array, here: Array) -> tuple[Array, Array, Array]:
    """Return direction, start and end of a common normal of two axes.

    Parameters
    ----------
    across
        The x direction of the frame on `axis`: of two opposite normals the one nearer to it is taken, so that
        joint zeros stay what they were; where both are as near, the one that points to `following`.
    here
        Origin of that frame, on `axis`.
    """
    normal = np.cross(axis.along, following.along)
    sine = float(np.linalg.norm(normal))
    if sine < _PARALLEL:
        foot, landing = here, following.nearest(here)
        distance = float(np.linalg.norm(landing - foot))
        if distance < _ONE_LINE:
            return across, foot, landing
        normal = (landing - foot) / distance
    else:
        normal = normal / sine
        apart = following.point - axis.point
        foot = axis.point + float(np.cross(apart, following.along) @ normal) / sine * axis.along
        landing = following.point + float(np.cross(apart, axis.along) @ normal) / sine * following.along
    leaning = float(normal @ across)
    if abs(leaning) < 1e-9:
        distance = float((landing - foot) @ normal)
        leaning = distance if abs(distance) > _ONE_LINE else 1.0
    return (normal if leaning > 0 else -normal), foot, landing


def _across(rotation: Array, along: Array) -> Array:
    """Return the direction across `along` nearest to a frame's x axis, or its y axis if x lies along it."""
    for column in (0, 1):
        side = rotation[:, column] - (rotation[:, column] @ along) * along
        length = float(np.linalg.norm(side))
        if length > 0.5:
            break
    return np.asarray(side / length)


def _turn(start: Array, end: Array, axis: Array) -> float:
    """Return the angle [rad] from one direction to another about an axis across both."""
    return math.atan2(float(np.cross(start, end) @ axis), float(start @ end))


def _frame(x: Array, z: Array, origin: Array) -> Array:
    """Return the frame of these axes, ``(4, 4)``."""
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = x, np.cross(z, x), z, origin
    return frame


def _transform(frame: Array) -> Transform:
    return Transform.from_matrix(frame[:3, :3], frame[:3, 3])


def _rows(
    joints: Sequence[Joint],
    numbers: Sequence[tuple[float, float, float, float]],
    convention_name: DHConvention,
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
    form = convention(table.convention_name)
    elements = [e for n, j in enumerate(table.joints(), 1) for e in form.elements(n, j.row, j.kind)]
    sweep = Chain(tuple(elements)).sweep(np.zeros((len(table.rows), 1)))
    rotation = sweep.matrix()[0]
    return _frame(rotation[:, 0], rotation[:, 2], sweep.position[:, 0])


# -- as CSV -------------------------------------------------------------------------------------------------


def dh_csv(table: DHTable) -> str:
    """Return the rows of a table as CSV, in mm and degrees; base and flange are not part of it."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["joint", "type", *(f"{column} [{SHOWN_AS[unit]}]" for column, unit in _COLUMNS.items())])
    for row in table.rows:
        shown = (written(getattr(row, column), SHOWN_AS[unit]) for column, unit in _COLUMNS.items())
        writer.writerow([row.joint, row.kind, *map(repr, shown)])
    return stream.getvalue()


def read_dh_csv(path: Path, convention_name: DHConvention) -> DHTable:
    """Read a DH table from a CSV file; its base and flange are the identity.

    The columns are ``joint``, ``a [mm]``, ``alpha [deg]``, ``d [mm]`` and ``theta_offset [deg]``, in any
    order and unit, and ``type`` where a joint slides.

    Parameters
    ----------
    convention_name
        The form the numbers are in; no table says it of itself.
    """
    lines = [
        (f"{path}, line {number}", [cell.strip() for cell in cells])
        for number, cells in enumerate(csv.reader(io.StringIO(read_text(path))), 1)
        if any(cell.strip() for cell in cells)
    ]
    columns = _header(lines[0][1], lines[0][0])
    if len(lines) == 1:
        raise InputError("the table has no rows", where=str(path))
    rows = []
    for where, cells in lines[1:]:
        if len(cells) != len(columns):
            raise InputError(
                "the row has not as many cells as the header",
                where=where,
                came=len(cells),
                allowed=str(len(columns)),
            )
        entry = dict(zip((name for name, _ in columns), cells, strict=True))
        kind: JointKind = "prismatic" if entry.get("type") == "prismatic" else "revolute"
        if entry.get("type", kind) != kind:
            raise InputError(
                "a joint has no such type",
                where=f"{where}, type",
                came=entry["type"],
                allowed="revolute, prismatic",
            )
        si = {name: _si(entry[name], unit, f"{where}, {name}") for name, unit in columns if unit}
        rows.append(DHRow(entry["joint"], kind, **si))
    return DHTable(convention_name, tuple(rows), Transform(), Transform())


def _header(cells: Sequence[str], where: str) -> list[tuple[str, str]]:
    """Return name and unit of each column; names without a unit have an empty one."""
    columns = []
    for cell in cells:
        name, _, rest = cell.strip().partition("[")
        name, unit = name.strip(), rest.removesuffix("]").strip()
        if name in _COLUMNS:
            unit = checked_unit(unit, LENGTH_UNITS if _COLUMNS[name] == "m" else ANGLE_UNITS, f"{where}, column {name}")
        columns.append((name, unit))
    names = [name for name, _ in columns]
    needed = ["joint", *_COLUMNS]
    if sorted(set(names) - {"type"}) != sorted(needed) or len(set(names)) < len(names):
        raise InputError(
            "these are not the columns of a DH table",
            where=where,
            came=", ".join(names),
            allowed=f"{', '.join(needed)}, each once, with their units in brackets; and type",
            cure="Separate the columns by commas.",
        )
    return columns


def _si(text: str, unit: str, where: str) -> float:
    value = as_number(text)
    if value is None:
        raise InputError("a number belongs here", where=where, came=text)
    return sized_si(value, unit, where, came=text)
