"""A sheet that was filled in (:mod:`truearm.hexapod.sheet`), and joint positions at the base cups, read and checked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean, nearest_names
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.data.hexapod import DEVICE, SOLUTIONS, Design, Device, designs
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.data.readers.rows import row_configurations
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import COLUMN, JOINT_COLUMN, joint_names
from truearm.hexapod.sheet import FIXTURES, FOURTH_LEGS, LEGS, SIDES_OF_FOUR, TO_FOURTH, Sheet, legs_of_side

_PLAIN: Final = ("configuration", "place", "pose", "branch", "side", "design", "solution", "attachment", SIMULATED)
_LENGTHS: Final = (*FIXTURES, *TO_FOURTH, *LEGS, *FOURTH_LEGS)
_NEEDED: Final = ("configuration", "design", "solution", *FIXTURES, *LEGS)
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
Choice = TypeVar("Choice", int, Design)
Columns = dict[str, tuple[int, str]]


def read_sheet(path: Path, device: Device = DEVICE) -> Sheet:
    """Read a sheet that was filled in.

    Raises:
        InputError: If it is not as :mod:`truearm.hexapod.sheet` says, or a length is beyond the ballbar's
            range; with line and column.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    columns = _columns(cells)
    labels = cells.texts(columns["configuration"][0])
    if len(set(labels)) < len(labels):
        twice = next(label for row, label in enumerate(labels) if label in labels[:row])
        raise InputError(
            "the configuration appears twice",
            where=str(path),
            came=twice,
            cure="One row each. If it was measured again, give it another name.",
        )
    by_name = {design.name: design for design in designs()}
    row_designs = [_one_of(cells, row, columns["design"][0], by_name) for row in range(len(labels))]
    solutions = {str(number): number for number in SOLUTIONS}
    chosen = [_one_of(cells, row, columns["solution"][0], solutions) for row in range(len(labels))]
    sides = [1] * len(labels)
    if "side" in columns:
        known = {str(number): number for number in range(1, len(SIDES_OF_FOUR) + 1)}
        sides = [_one_of(cells, row, columns["side"][0], known) for row in range(len(labels))]
    places = _places(cells, columns)

    def lengths(name: str) -> Array:
        return cells.numbers(*columns[name], missing=True) if name in columns else np.full(len(labels), np.nan)

    legs = {name: lengths(name) for name in (*LEGS, *FOURTH_LEGS)}
    place_of_row = places or labels[:1] * len(labels)
    first = np.array([place_of_row.index(place) for place in place_of_row])  # the first row of each row's place
    fixtures = {
        name: _filled_down(cells, columns[name], lengths(name), first if name.startswith("B") else np.zeros_like(first))
        for name in FIXTURES
    }
    fixtures |= {name: _last_given(lengths(name), first) for name in TO_FOURTH}
    for name, values in {**fixtures, **legs}.items():
        nominal = device.leg if name in legs else device.base if name.startswith("B") else device.tool
        for row in np.flatnonzero(np.isfinite(values)).tolist():
            device.check(nominal, float(values[row]), name, cells.place(row, columns[name][0]))
    named = [legs_of_side(design, side) for design, side in zip(row_designs, sides, strict=True)]
    _refuse_strange_legs(cells, columns, row_designs, named, legs)
    read = np.array([[legs[name][row] for name in names] for row, names in enumerate(named)])
    measured = np.isfinite(read).all(axis=1)
    to_fourth = np.column_stack([fixtures[name] for name in TO_FOURTH])
    _refuse_unknown_sides(cells, columns, sides, measured, to_fourth, first)
    configurations = None
    if any(JOINT_COLUMN.fullmatch(name) for name in columns):
        joints_are, joints = joint_names(columns, f"{path}, line {header}")
        at, units = zip(*(columns[name] for name in joints), strict=True)
        configurations = row_configurations(cells, labels, at, units, joints_are)
    return Sheet(
        source=str(path),
        configurations=configurations,
        labels=labels,
        designs=tuple(row_designs),
        solutions=tuple(chosen),
        base=np.column_stack([fixtures[name] for name in FIXTURES[:3]]),
        tool=np.column_stack([fixtures[name] for name in FIXTURES[3:]]),
        legs=read,
        places=places,
        sides=tuple(sides),
        to_fourth=to_fourth,
        attachments=_attachments(cells, columns, measured),
    )


def _one_of(cells: Cells, row: int, column: int, choices: dict[str, Choice]) -> Choice:
    text = cells.columns[column][row]
    if text not in choices:
        raise InputError(
            f"there is no such {cells.names[column]}",
            where=cells.place(row, column),
            came=text,
            allowed=", ".join(choices) if len(choices) < 9 else "one of the 36 designs, as 112212331",
            cure=did_you_mean(text, choices),
        )
    return choices[text]


def _places(cells: Cells, columns: Columns) -> tuple[str, ...] | None:
    """Return the place of each row; the rows of one place stand together, because a fixture does not come back."""
    if "place" not in columns:
        return None
    column = columns["place"][0]
    places = cells.texts(column)
    for row, place in enumerate(places):
        if row and place != places[row - 1] and place in places[:row]:
            raise InputError(
                f"the rows of the place {place} do not stand together",
                where=cells.place(row, column),
                cure="If the fixture was set up there anew, call that another place: it never stands as it did before. "
                "Else move the rows together.",
            )
    return places


def _last_given(values: Array, first: Array) -> Array:
    """Return a column in which an empty cell has the value above it at the same place, if there is one."""
    rows = np.arange(len(values))
    last = np.maximum.accumulate(np.where(np.isfinite(values), rows, -1))
    return np.where(last >= first, values[np.maximum(last, 0)], np.nan)


def _filled_down(cells: Cells, column: tuple[int, str], values: Array, first: Array) -> Array:
    """Return such a column in which the first row of each place has a value."""
    missing = np.flatnonzero(~np.isfinite(values[first]))
    if len(missing):
        row = int(first[missing[0]])
        raise InputError(
            "the first row of a place must have the distances of the base fixture there"
            if row
            else "the first row must have the distances of both fixtures",
            where=cells.place(row, column[0]),
            allowed="a length",
            cure="Its cups were locked anew: measure them."
            if row
            else "Measure it before the poses: it changes with the temperature of the fixture.",
        )
    return _last_given(values, first)


def _refuse_strange_legs(
    cells: Cells,
    columns: Columns,
    row_designs: Sequence[Design],
    named: Sequence[tuple[str, ...]],
    legs: dict[str, Array],
) -> None:
    for row, (design, names) in enumerate(zip(row_designs, named, strict=True)):
        for name, values in legs.items():
            if np.isfinite(values[row]) and name not in names:
                raise InputError(
                    f"the design {design.name} has no leg {name}{' on this side' if 'side' in columns else ''}",
                    where=cells.place(row, columns[name][0]),
                    allowed=", ".join(names),
                    cure="Check which cups the bar was between.",
                )


def _refuse_unknown_sides(
    cells: Cells, columns: Columns, sides: Sequence[int], measured: Array, to_fourth: Array, first: Array
) -> None:
    """Refuse rows measured on a side of four cups whose distances are not there."""
    for row in np.flatnonzero(measured * (np.array(sides) > 1)).tolist():
        for name, length in zip(TO_FOURTH, to_fourth[row].tolist(), strict=True):
            if not np.isfinite(length):
                raise InputError(
                    f"side {sides[row]} was measured, and the distance {name} is not known",
                    where=cells.place(row, columns["side"][0]),
                    allowed=f"{', '.join(f'{side} [mm]' for side in TO_FOURTH)} in line {cells.lines[int(first[row])]}",
                    cure="Measure the distances to the fourth cup: they say where the sides are to each other.",
                )


def _attachments(cells: Cells, columns: Columns, measured: Array) -> tuple[str, ...] | None:
    if "attachment" not in columns:
        return None
    column = columns["attachment"][0]
    names = cells.texts(column, missing=True)
    missing = [row for row in np.flatnonzero(measured).tolist() if not names[row]]
    if not any(names):
        return None
    if missing:
        raise InputError(
            "the attachment of the tool is missing",
            where=cells.place(missing[0], column),
            allowed="the number of the attachment",
            cure="Number the attachments in all rows that were measured. If the tool was never taken off, leave the "
            "whole column empty.",
        )
    return names


def _columns(cells: Cells) -> Columns:
    """Return place and unit of every column by its name, or refuse the header."""
    columns: Columns = {}
    for place, heading in enumerate(cells.names):
        location = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=location, cure="Remove one of them.")
        if name in _PLAIN:
            columns[name] = (place, "1")
        elif name in _LENGTHS:
            columns[name] = (place, checked_unit(unit, LENGTH_UNITS, f"{location}, {heading}"))
        elif JOINT_COLUMN.fullmatch(name):
            columns[name] = (place, checked_unit(unit, (*ANGLE_UNITS, *LENGTH_UNITS), f"{location}, {heading}"))
        else:
            near = nearest_names(name, (*_PLAIN, *_LENGTHS), 1)
            raise InputError(
                "the column is not known",
                where=location,
                came=heading,
                allowed=f"{', '.join(_PLAIN)}, joint_1 [deg] .. or axis_1 [deg] .., and lengths such as B1-T1 [mm]",
                cure=f"Did you mean {near[0]}?" if near else "Rename it, or leave it out.",
            )
    missing = [name for name in _NEEDED if name not in columns]
    if missing:
        raise InputError(
            f"the column {missing[0]} is missing",
            where=f"{cells.source}, line {cells.header}",
            cure="Start from the sheet that truearm hexapod plan writes.",
        )
    return columns


# Joint positions at the three base cups: a CSV with ``cup`` (B1, B2, B3) and ``joint_1 [deg]`` .., one row a cup.
#
# ``axis_1 [deg]`` .. instead are joint positions as the controller shows them.
_HEADING_TOUCHES: Final = re.compile(r"(?P<name>cup|(?:joint|axis)_[1-9][0-9]?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_CUPS: Final = ("B1", "B2", "B3")


def read_touches(path: Path, robot: Robot) -> Array:
    """Return the model's joint positions at B1, B2 and B3 [rad or m], ``(3, joints)``.

    Raises:
        InputError: If the file does not hold each cup once with all joints of the robot, or they are its controller's
            and its file does not say how that counts them.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    numbers = range(1, len(robot.joints) + 1)
    known = ("cup", *(f"{kind}_{number}" for kind in COLUMN.values() for number in numbers))
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        location = f"{path}, line {header}, column {place + 1}"
        match = _HEADING_TOUCHES.fullmatch(heading)
        if match is None or match["name"] not in known or match["name"] in columns:
            raise InputError(
                "the column is not known, or appears twice", where=location, came=heading, allowed=", ".join(known)
            )
        if match["name"] == "cup":
            columns["cup"] = (place, "1")
        else:
            kind = robot.joints[int(match["name"].rpartition("_")[2]) - 1].kind
            units = ANGLE_UNITS if kind == "revolute" else LENGTH_UNITS
            columns[match["name"]] = (place, checked_unit(match["unit"], units, f"{location}, {heading}"))
    joints_are, _ = joint_names(columns, f"{path}, line {header}")
    wanted = ("cup", *(f"{COLUMN[joints_are]}_{number}" for number in numbers))
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise InputError(f"the column {missing[0]} is missing", where=f"{path}, line {header}")
    labels = cells.texts(columns["cup"][0])
    if sorted(labels) != list(_CUPS):
        raise InputError(
            "every base cup is touched once", where=str(path), came=", ".join(labels), allowed=", ".join(_CUPS)
        )
    joints = np.column_stack([cells.numbers(*columns[name]) for name in wanted[1:]])
    touched = np.asarray(joints[[labels.index(cup) for cup in _CUPS]])
    if joints_are == "model":
        return touched
    robot.controller.check_counts(robot.name, f"{path}, column axis_1")
    return robot.controller.to_model(touched)
