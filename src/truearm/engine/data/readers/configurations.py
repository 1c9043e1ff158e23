"""Configurations and poses to go to, without readings: tables of plans and sets of poses."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import read_csv, refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.data.readers.rows import (
    Configurations,
    Readings,
    dataset_of,
    row_configurations,
    unit_quaternions,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.urdf_writing import JOINT_COLUMN, joint_names

STOP_COLUMN: Final = re.compile(r"(?P<name>approach_[1-9][0-9]{0,3})\s*(?:\[(?P<unit>[^\]]*)\])?")


def stops_in(cells: Cells, measured: Configurations) -> Configurations | None:
    """Return the joint positions of these stops, counted as those of the configurations; None where there are none.

    Raises:
        InputError: If some columns are missing, have no unit or are there twice, or a cell cannot be used.
    """
    where = f"{cells.source}, line {cells.header}"
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        match = STOP_COLUMN.fullmatch(heading)
        if match:
            at = f"{where}, column {place + 1}, {heading}"
            if match["name"] in columns:
                raise InputError("the column appears twice", where=at, cure="Remove one of them.")
            columns[match["name"]] = place, checked_unit(match["unit"], (*ANGLE_UNITS, *LENGTH_UNITS), at)
    if not columns:
        return None
    names = [f"approach_{number}" for number in range(1, measured.joints.shape[1] + 1)]
    if {*columns} != {*names}:
        raise InputError(
            "the stops before the configurations are not those of the joints",
            where=where,
            came=", ".join(columns),
            allowed=", ".join(names),
            cure="Give one to each joint, or leave all of them out.",
        )
    places, units = zip(*(columns[name] for name in names), strict=True)
    return row_configurations(
        cells, [measured.labels[at] for at in measured.of_row], places, units, measured.joints_are
    )


_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_LABEL: Final = "configuration"
#: Further columns of plans: in which order, under which pull, and what is read.
_BESIDE: Final = re.compile(r"order|force_[xyz]|reads")
#: What nobody has seen.
_UNSEEN: Final = "unseen"


def read_configurations(path: Path) -> Dataset:
    """Read configurations: of a canonical CSV, or of a table without readings that a plan has.

    Such a table has the columns ``configuration`` and ``joint_i`` or ``axis_i``, a row a configuration. Its columns
    ``approach_i``, ``order``, ``force_x`` to ``force_z`` and ``reads`` say nothing of where the arm stands.

    Returns:
        Dataset: Of a plan with one missing reading for each configuration.

    Raises:
        InputError: If the file is neither of them, or a cell cannot be used.
    """
    table = _table_of(path)
    if table is None:
        return read_csv(path)
    return _unseen(table.cells, _configurations(table))


def read_stops(path: Path) -> Dataset | None:
    """Read where the arm stops right before each configuration of a plan, ``approach_i`` of its table.

    Returns:
        Dataset: With these joint positions, counted as those of the configurations; None where the file does not have
            them.

    Raises:
        InputError: If some of its columns are missing or have no unit, or a cell cannot be used.
    """
    table = _table_of(path)
    stops = None if table is None else stops_in(table.cells, _configurations(table))
    return None if table is None or stops is None else _unseen(table.cells, stops)


@dataclass(frozen=True)
class _Table:
    """Cells of a table of configurations, place and unit of each column by its name, and where these stand."""

    cells: Cells
    columns: Mapping[str, tuple[int, str]]
    where: str


def _table_of(path: Path) -> _Table | None:
    """Return the table of a plan; None for a canonical CSV."""
    text = read_text(path)
    first = next((number, line) for number, line in enumerate(lines_of(text), 1) if line.strip())
    heads = {head.strip().strip('"').partition("[")[0].strip() for head in first[1].split(",")}
    if "target" in heads or not any(JOINT_COLUMN.fullmatch(name) for name in heads):
        return None
    refuse_other_separators(text, f"{path}, line {first[0]}")
    cells = read_cells(text, str(path), Layout(header=first[0]))
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        where = f"{path}, line {first[0]}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name = match["name"] if match else heading
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if JOINT_COLUMN.fullmatch(name):
            unit = checked_unit(match and match["unit"], (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, {heading}")
        elif name == _LABEL or STOP_COLUMN.fullmatch(heading) or _BESIDE.fullmatch(name):
            unit = ""
        else:
            raise InputError(
                "the column is not known in a table of configurations without readings",
                where=where,
                came=heading,
                allowed="configuration, joint_1 [deg] .. or axis_1 [deg] .., and further columns of a plan",
                cure="Rename it, or leave it out; readings have the column target, too.",
            )
        columns[name] = (place, unit)
    if _LABEL not in columns:
        raise InputError(
            "the column configuration is missing", where=f"{path}, line {first[0]}", cure="Add it: a name in each row."
        )
    return _Table(cells, columns, f"{path}, line {first[0]}")


def _configurations(table: _Table) -> Configurations:
    joints_are, names = joint_names(table.columns, table.where)
    places, units = zip(*(table.columns[name] for name in names), strict=True)
    labels = table.cells.texts(table.columns[_LABEL][0])
    return row_configurations(table.cells, labels, places, units, joints_are)


def _unseen(cells: Cells, configurations: Configurations) -> Dataset:
    """Return joint positions with a missing reading at each."""
    n = len(configurations.of_row)
    return dataset_of(
        Readings(
            source=cells.source,
            lines=cells.lines,
            configuration=configurations.of_row,
            targets=(_UNSEEN,) * n,
            reference=np.zeros(n, bool),
            position=np.full((n, 3), np.nan),
        ),
        configurations,
    )


_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_SHOWN: Final = {"pose": "pose"} | {axis: f"{axis} [mm]" for axis in _POSITION} | {part: part for part in _QUATERNION}
_ALLOWED: Final = ", ".join(_SHOWN.values())
_HEADING_POSES: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses as a file has them."""

    labels: tuple[str, ...]  #: One for each pose, none twice.
    position: Array  #: [m], ``(poses, 3)``.
    quaternion: Array | None  #: (w, x, y, z) of length 1, ``(poses, 4)``; None if the file has none.


def read_poses(path: Path) -> Poses:
    """Read poses: ``pose``, ``x [mm]``, ``y [mm]``, ``z [mm]``, and ``qw``, ``qx``, ``qy``, ``qz`` or none of them.

    No cell may be empty. Quaternions must have length 1 within 1e-3 and are then normalised.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    columns = _columns(cells)
    labels = cells.texts(columns["pose"][0])
    lines: dict[str, int] = {}
    for label, line in zip(labels, cells.lines, strict=True):
        if lines.setdefault(label, line) != line:
            raise InputError(
                f"the pose {label!r} appears twice",
                where=f"{path}, lines {lines[label]} and {line}",
                cure="Give each pose a name of its own.",
            )
    position = np.column_stack([cells.numbers(*columns[axis]) for axis in _POSITION])
    quaternion = None
    if "qw" in columns:
        parts = np.column_stack([cells.numbers(*columns[part]) for part in _QUATERNION])
        quaternion = unit_quaternions(parts, str(path), cells.lines)
    return Poses(labels, position, quaternion)


def _columns(cells: Cells) -> dict[str, tuple[int, str]]:
    """Return place and unit of every column by its name, or refuse the header."""
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        where = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING_POSES.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name not in _SHOWN:
            near = nearest_names(name, _SHOWN, 1)
            raise InputError(
                "the column is not known",
                where=where,
                came=heading,
                allowed=_ALLOWED,
                cure=f"Did you mean {_SHOWN[near[0]]}?" if near else "Rename it, or leave it out.",
            )
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, cure="Remove one of them.")
        if name in _POSITION:
            unit = checked_unit(unit, LENGTH_UNITS, f"{where}, {heading}")
        elif unit is not None:
            raise InputError("this column takes no unit", where=where, came=heading, allowed=name)
        columns[name] = (place, unit or "1")
    needed = ["pose", *_POSITION, *(_QUATERNION if any(part in columns for part in _QUATERNION) else ())]
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(
            f"the column {missing[0]} is missing",
            where=f"{cells.source}, line {cells.header}",
            allowed=_ALLOWED,
            cure=f"Add {', '.join(_SHOWN[name] for name in missing)}.",
        )
    return columns
