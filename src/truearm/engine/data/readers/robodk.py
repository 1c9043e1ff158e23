"""RoboDK's tables of calibration and validation measurements, in and out.

A table has one line of headings, which its readers skip, and columns that go by their place: six joints [deg], the
measured point x, y, z [mm] in the instrument's frame, and the tool's point (TCP) x, y, z [mm] that was there; of pose
measurements six numbers each, x, y, z and the angles of Rx Ry Rz about moving axes. A measured point of zeros was not
measured. That is how the examples of RoboDK read the tables that it exports (github.com/RoboDK/RoboDK-API,
Python/Examples/Macros, on distance errors after calibration and on measured poses as frames); which tool point a line
has is all that tells its targets apart.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, counted
from truearm.engine.base.files import read_text
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.cells import WITH_COMMA, Cells, Layout, lines_of, read_cells
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.postures import approach_of
from truearm.engine.robot.transform import MOVING_XYZ_ANGLES, quaternion_from_rotation, rotation_from_quaternion

AngleUnit = Literal["deg", "rad"]
Delimiter = Literal["comma", "semicolon", "tab"]
Decimal = Literal["point", "comma"]
#: What stands between columns, and the sign in numbers, by their names.
DELIMITERS: Final[dict[str, str]] = {"comma": ",", "semicolon": ";", "tab": "\t"}
DECIMALS: Final[dict[str, str]] = {"point": ".", "comma": ","}
_JOINTS: Final = 6
#: Columns of a table of points and of one of poses.
_POINTS, _POSES = 12, 18
#: Sum of coordinates below which nothing was measured [m].
_NOT_MEASURED: Final = 1e-6
#: Headings of joints that are numbered.
_NUMBERED: Final = re.compile(r"\D*?([0-9]{1,2})")
#: Headings that no joint has.
_NO_JOINTS: Final = frozenset({"x", "y", "z", "configuration", "target", "name", "point", "id"})
#: What the headings of measured numbers begin with; those of a virtual instrument say so instead.
_MEASURED: Final = "measured"
_HEADINGS: Final = {
    "joints": [f"J{number} [deg]" for number in range(1, _JOINTS + 1)],
    "tool": [f"TCP {axis} [mm]" for axis in "XYZ"],
}


@dataclass(frozen=True, eq=False)
class RoboDKTable:
    """What a table holds."""

    data: Dataset  #: The readings; targets are numbered as their tool points first appear.
    tool_points: Array  #: Where each target is in the flange frame, as RoboDK was told [m], ``(targets, 3)``.
    missing: int  #: How many readings are missing.


def read_robodk(
    path: Path,
    angle_unit: AngleUnit | None,
    joints_are: JointsOf,
    delimiter: Delimiter = "comma",
    decimal: Decimal = "point",
) -> RoboDKTable:
    """Read a table of measurements.

    Lines that follow each other with the same joint positions and other tool points are one configuration.

    Args:
        angle_unit: Of the angles of measured poses; None for a table of points.
        joints_are: ``model``, or ``controller`` if it shows these joint positions.
        delimiter, decimal: What stands between columns, and the decimal sign.

    Raises:
        InputError: If it is no such table, or the unit of its angles is not said.
    """
    text = read_text(path)
    header = 1 + next((number for number, line in enumerate(lines_of(text)) if line.strip()), 0)
    if delimiter == "comma":
        refuse_other_separators(
            text, f"{path}, line {header}", ", or name what the file has by `delimiter` and `decimal`"
        )
    cells = read_cells(text, str(path), Layout(DELIMITERS[delimiter], DECIMALS[decimal], header))
    columns = len(cells.names)
    if columns and not cells.names[-1] and not any(cells.columns[-1]):  # every line ends with a comma
        columns -= 1
    if columns not in (_POINTS, _POSES):
        raise InputError(
            "this is no table of RoboDK's calibration",
            where=f"{path}, line {header}",
            came=counted(columns, "column"),
            allowed=f"{_POINTS}: six joints, measured point, tool point; or {_POSES}: poses instead of points",
            cure="Export the calibration or validation measurements as they are, or use `truearm import table`.",
        )
    _refuse_no_heading(cells)
    _refuse_other_headings(cells)
    if decimal == "point" and delimiter != "comma":
        _refuse_decimal_commas(cells, range(columns))
    poses = columns == _POSES
    if poses and angle_unit is None:
        raise InputError(
            "the table has angles, and does not say in what unit",
            parameter="angle_unit",
            where=str(path),
            allowed="deg or rad",
        )
    joints = _numbers(cells, range(_JOINTS), "deg")
    position = _numbers(cells, range(_JOINTS, _JOINTS + 3), "mm")
    tool = _numbers(cells, range(12, 15) if poses else range(9, 12), "mm")
    lost = np.abs(position).sum(axis=1) < _NOT_MEASURED
    position[lost] = np.nan
    quaternion = None
    if poses and angle_unit is not None:
        measured = MOVING_XYZ_ANGLES.matrices(_numbers(cells, range(9, 12), angle_unit))
        quaternion = quaternion_from_rotation(measured)
        quaternion[lost] = np.nan
    points, target = _tool_points(tool)
    configuration = _configurations(joints, target)
    starts = np.flatnonzero(np.diff(configuration, prepend=-1))
    at = joints[starts]
    count = len(starts)
    data = Dataset(
        source=str(path),
        labels=tuple(str(number) for number in range(1, count + 1)),
        joints=at,
        joint_kinds=("revolute",) * _JOINTS,
        joints_are=joints_are,
        targets=tuple(str(number) for number in range(1, len(points) + 1)),
        configuration=configuration,
        target=target,
        position=position,
        quaternion=quaternion,
        approach=approach_of(at, np.arange(count)),
        number=np.arange(float(count)),
        simulated=any(heading.startswith(SIMULATED) for heading in cells.names),
    )
    return RoboDKTable(data, points, int(lost.sum()))


def _tool_points(tool: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the tool points in the order in which they come, and which of them each row has."""
    points, target = np.unique(np.round(tool, 9), axis=0, return_inverse=True)
    first = np.array([np.flatnonzero(target == k)[0] for k in range(len(points))])
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.intp)
    rank[order] = np.arange(len(order))
    return points[order], rank[target.ravel()]


def robodk_csv(data: Dataset, tool_points: Sequence[Array], rotations: Sequence[Array | None]) -> str:
    """Return readings as such a table; of poses with angles in radians.

    Args:
        data: Positions, or poses, of six revolute joints.
        tool_points, rotations: Where each target is in the flange frame [m], ``(3,)``, and how it is turned, ``(3,
            3)``; None for a point.
    """
    poses = data.quaternion is not None
    measured = SIMULATED if data.simulated else _MEASURED
    headings = [*_HEADINGS["joints"], *(f"{measured} {axis} [mm]" for axis in "XYZ")]
    headings += [f"{measured} {axis} [rad]" for axis in ("RX", "RY", "RZ")] if poses else []
    headings += _HEADINGS["tool"]
    headings += [f"TCP {axis} [rad]" for axis in ("RX", "RY", "RZ")] if poses else []
    lines = [",".join(headings)]
    for row in np.flatnonzero(np.isfinite(data.position).all(axis=1)):
        target = data.target[row]
        numbers = [*np.degrees(data.joints[data.configuration[row]]), *(1e3 * data.position[row])]
        if data.quaternion is not None:
            numbers += _angles(rotation_from_quaternion(data.quaternion[row][None])[0])
        numbers += [*(1e3 * tool_points[target])]
        if poses:
            turned = rotations[target]
            numbers += _angles(np.eye(3) if turned is None else turned)
        lines.append(",".join(f"{number:.12g}" for number in numbers))
    return "\n".join(lines) + "\n"


def _angles(R: Array) -> list[float]:
    return [float(angle) for angle in MOVING_XYZ_ANGLES.numbers(R[None], np.zeros((1, 3)))[0]]


def _numbers(cells: Cells, columns: range, unit: str) -> Array:
    return np.column_stack([cells.numbers(column, unit) for column in columns])


def _refuse_no_heading(cells: Cells) -> None:
    """Refuse a table whose first line is a measurement: its readers skip it."""
    if all(_is_number(name) for name in cells.names if name):
        raise InputError(
            "the first line holds numbers where headings belong",
            where=f"{cells.source}, line {cells.header}",
            cure="Write a line of headings above it.",
        )


def _refuse_other_headings(cells: Cells) -> None:
    """Refuse a table whose headings say that its columns are others: they go by their place."""
    for place, heading in enumerate(cells.names[:_JOINTS]):
        name = heading.split("[")[0].strip().lower()
        if name in _NO_JOINTS:
            raise InputError(
                "the heading of this column is not that of a joint, and joints come first",
                where=f"{cells.source}, line {cells.header}, column {place + 1}",
                came=heading,
                allowed=f"{_JOINTS} joints, the measured point, the tool point",
                cure="Put the columns in this order. A canonical CSV needs no import.",
            )
    matches = [_NUMBERED.fullmatch(re.split(r"[\[({]", heading)[0].strip()) for heading in cells.names[:_JOINTS]]
    numbers = [None if match is None else int(match[1]) for match in matches]
    for place, (before, number) in enumerate(pairwise(numbers), 1):
        if before is not None and number is not None and number != before + 1:
            raise InputError(
                "the numbers in the headings of the joints do not follow each other, and columns go by their place",
                where=f"{cells.source}, line {cells.header}, column {place + 1}",
                came=f"{cells.names[place]} behind {cells.names[place - 1]}",
                allowed=f"the joints in their order, 1 to {_JOINTS}",
                cure="Put the columns in this order.",
            )


def _refuse_decimal_commas(cells: Cells, columns: range) -> None:
    for column in columns:
        row = next((row for row, text in enumerate(cells.columns[column]) if WITH_COMMA.fullmatch(text)), None)
        if row is not None:
            raise InputError(
                "the number has a decimal comma",
                parameter="decimal",
                where=cells.place(row, column),
                came=cells.columns[column][row],
                allowed="a decimal point",
                cure="Name the sign that the file has: `decimal=comma`.",
            )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _configurations(joints: Array, target: IntArray) -> IntArray:
    """Return the number of each line's configuration: it goes on while the joints stay and every target is new."""
    numbers = np.zeros(len(joints), dtype=np.intp)
    seen: set[int] = set()
    for row in range(len(joints)):
        goes_on = row > 0 and bool((joints[row] == joints[row - 1]).all()) and int(target[row]) not in seen
        if not goes_on:
            seen = set()
        numbers[row] = 0 if row == 0 else numbers[row - 1] + (not goes_on)
        seen.add(int(target[row]))
    return numbers
