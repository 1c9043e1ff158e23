"""Columns of a CSV by their names: what small tables check in the same way."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.errors import InputError, nearest_names
from truearm.files import read_text
from truearm.measurement.readers.canonical import refuse_other_separators
from truearm.measurement.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.measurement.readers.rows import Configurations, found_configurations
from truearm.measurement.readers.sheets import is_workbook, read_sheet
from truearm.measurement.readers.stops import stops_in
from truearm.modeling.formats.joint_columns import JOINT_COLUMN, joint_names
from truearm.simulated import COLUMN as SIMULATED
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit

_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
#: So alike a name that is not known must be for another to be offered: "note" is no "pose".
_ALIKE: Final = 0.6
_JOINTS: Final = "joint_1 [deg] .. or axis_1 [deg] .."

Columns = dict[str, tuple[int, str]]


def read_named(path: Path) -> Cells:
    """Return the cells of a CSV with a header."""
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    return read_cells(text, str(path), Layout(header=header))


def columns_beside_joints(
    cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], optional: Sequence[str] = ()
) -> Columns:
    """Return place and unit of every column by its name, joint positions among them, or refuse the header.

    Args:
        shown: The columns besides joint positions, as one writes them.
        units: The units of those that need one.
        optional: Those that may be left out.
    """
    columns = _found_columns(cells, shown, units, _JOINTS)
    joint_names(columns, f"{cells.source}, line {cells.header}")
    return _complete(cells, columns, shown, optional, _JOINTS)


def named_columns(
    cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], optional: Sequence[str] = ()
) -> Columns:
    """Return place and unit of every column by its name in a table without joint positions, or refuse the header.

    Args:
        shown, units, optional: As for :func:`columns_beside_joints`.
    """
    return _complete(cells, _found_columns(cells, shown, units), shown, optional)


def _found_columns(cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], *more: str) -> Columns:
    columns: Columns = {}
    header = f"{cells.source}, line {cells.header}"
    allowed = ", ".join([*shown.values(), *more])
    for place, heading in enumerate(cells.names):
        where = f"{header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        fitting = (*ANGLE_UNITS, *LENGTH_UNITS) if more and JOINT_COLUMN.fullmatch(name) else units.get(name)
        if name == SIMULATED:  # every table of measurements may have it, and none needs it
            continue
        if fitting is None and name not in shown:
            near = nearest_names(name, shown, 1, _ALIKE)
            raise InputError(
                "the column is not known" if heading else "the column has no name",
                where=where,
                came=heading or None,
                allowed=allowed,
                cure=f"Did you mean {shown[near[0]]}?" if near else "Rename it, or leave it out.",
            )
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if fitting is not None:
            unit = checked_unit(unit, fitting, f"{where}, {heading}")
        elif unit is not None:
            raise InputError(
                "this column takes no unit", where=where, came=heading, allowed=name, cure="Remove the unit."
            )
        columns[name] = (place, unit or "1")
    return columns


def _complete(cells: Cells, columns: Columns, shown: Mapping[str, str], optional: Sequence[str], *more: str) -> Columns:
    """Return columns if none is missing that may not be."""
    for name in shown:
        if name not in columns and name not in optional:
            raise InputError(
                f"the column {name} is missing",
                where=f"{cells.source}, line {cells.header}",
                allowed=", ".join([*shown.values(), *more]),
                cure=f"Add {shown[name]}.",
            )
    return columns


def configurations_of(cells: Cells, columns: Columns) -> Configurations:
    """Return the configurations of a table whose column ``configuration`` names them."""
    joints_are, names = joint_names(columns, f"{cells.source}, line {cells.header}")
    joints = [columns[name] for name in names]
    labels = cells.texts(columns["configuration"][0])
    return found_configurations(cells, labels, [place for place, _ in joints], [unit for _, unit in joints], joints_are)


def joints_in_file(path: Path) -> tuple[Cells, Configurations]:
    """Return the configurations of a CSV with the columns of the canonical CSV for them, whatever else it holds.

    These are ``configuration`` and ``joint_1 [deg]`` .. or ``axis_1 [deg]`` ..: a canonical CSV, a plan, or what the
    controller wrote.
    """
    cells = read_sheet(path, None, Layout(), str(path)) if is_workbook(path) else read_named(path)
    where = f"{cells.source}, line {cells.header}"
    columns: Columns = {}
    for place, heading in enumerate(cells.names):
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name != "configuration" and not JOINT_COLUMN.fullmatch(name):
            continue
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if name != "configuration":
            unit = checked_unit(unit, (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, column {place + 1}, {heading}")
        columns[name] = (place, unit or "1")
    joint_names(columns, where)
    if "configuration" not in columns:
        raise InputError(
            "the column configuration is missing",
            where=where,
            allowed=f"configuration, {_JOINTS}",
            cure="Add it: it holds the labels that the measurements name.",
        )
    found = configurations_of(cells, columns)
    return cells, replace(found, before=stops_in(cells, found))


def refuse_repeated(cells: Cells, configurations: Configurations, cure: str) -> None:
    """Refuse a configuration that has more rows than one."""
    first: dict[int, int] = {}
    for row, of in enumerate(configurations.of_row.tolist()):
        if (before := first.setdefault(of, row)) != row:
            raise InputError(
                f"the configuration {configurations.labels[of]!r} appears twice",
                where=f"{cells.source}, lines {cells.lines[before]} and {cells.lines[row]}",
                cure=cure,
            )
