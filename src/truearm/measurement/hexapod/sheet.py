"""The sheet: one row a configuration, with the cups and the lengths between them. A plan prints it, a person fills it.

Columns ``configuration``, ``design`` (``112212331``), ``solution`` (1 to 4), ``joint_1 [deg]`` .. (or ``axis_1 [deg]``
.., as the controller shows them) and fifteen lengths:
``B1-B2 [mm]``, ``T1-T2 [mm]`` and so on between cups of a fixture, ``B1-T1 [mm]`` to ``B3-T3 [mm]`` for legs. Legs that
the design does not have stay empty. A row of which a leg could not be measured stays as well, and is left out. The
fixtures' distances must be in the first row; where a later row leaves one empty, the one above holds.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from truearm.errors import InputError, did_you_mean, nearest_names
from truearm.files import read_text
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.hexapod.geometry import DEVICE, Design, Device, designs, side_names
from truearm.measurement.hexapod.kinematics import SOLUTIONS, tool_cups
from truearm.measurement.readers.canonical import refuse_other_separators
from truearm.measurement.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.measurement.readers.rows import Configurations, found_configurations
from truearm.modeling.chain import Array
from truearm.modeling.controller import Controller
from truearm.modeling.formats.joint_columns import JOINT_COLUMN, joint_cells, joint_headings, joint_names
from truearm.modeling.parts import Joint
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit, written

_FIXTURES: Final = (*side_names("B"), *side_names("T"))
_LEGS: Final = tuple(f"B{base}-T{tool}" for base in (1, 2, 3) for tool in (1, 2, 3))
_PLAIN: Final = ("configuration", "pose", "branch", "design", "solution")
_NEEDED: Final = ("configuration", "design", "solution", *_FIXTURES, *_LEGS)
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
Choice = TypeVar("Choice", int, Design)


@dataclass(frozen=True, eq=False)
class Sheet:
    """Lengths measured with the device.

    Attributes
    ----------
    source
        The file, for messages.
    configurations
        Labels and joint positions, one row each; None if the sheet has no joints.
    labels
        One for each row.
    designs, solutions
        Of each row.
    base, tool
        Distances 12, 23 and 31 of the fixtures [m], ``(rows, 3)``.
    legs
        In the order of the design's legs [m], ``(rows, 6)``; NaN where one could not be measured.
    """

    source: str
    configurations: Configurations | None
    labels: tuple[str, ...]
    designs: tuple[Design, ...]
    solutions: tuple[int, ...]
    base: Array
    tool: Array
    legs: Array

    @property
    def measured(self) -> IntArray:
        """Indices of the rows with all six legs."""
        return np.flatnonzero(np.isfinite(self.legs).all(axis=1))

    def cups(self) -> Array:
        """Return T1, T2 and T3 in the frame of the base fixture [m], ``(rows, 3, 3)``; NaN where a leg is missing."""
        found = np.full((len(self.labels), 3, 3), np.nan)
        for row in self.measured.tolist():
            found[row] = tool_cups(
                self.designs[row], self.solutions[row], self.base[row], self.tool[row], self.legs[row]
            )
        return found

    def dataset(self, targets: Sequence[str] = ("1", "2", "3")) -> Dataset:
        """Return the measured rows as positions of the three cups, in the frame of the base fixture.

        It declares no deviations: what a robot does not repeat is many times what the ballbar does not know.

        Raises
        ------
        InputError
            If the sheet has no joints, or no row with all six legs.
        """
        if self.configurations is None:
            raise InputError(
                "the sheet has no joint positions",
                where=self.source,
                allowed="joint_1 [deg] .., or axis_1 [deg] ..",
                cure="Add them.",
            )
        rows = self.measured
        if not len(rows):
            raise InputError("no row has all six legs", where=self.source, cure="Fill in the lengths.")
        return Dataset(
            source=self.source,
            labels=tuple(self.labels[row] for row in rows),
            joints=self.configurations.joints[rows],
            joint_kinds=self.configurations.kinds,
            joints_are=self.configurations.joints_are,
            targets=tuple(targets),
            configuration=np.repeat(np.arange(len(rows)), 3),
            target=np.tile(np.arange(3), len(rows)),
            position=self.cups()[rows].reshape(-1, 3),
        )


def read_sheet(path: Path, device: Device = DEVICE) -> Sheet:
    """Read a sheet that was filled in.

    Raises
    ------
    InputError
        If it is not as :mod:`truearm.measurement.hexapod.sheet` says, or a length is beyond the ballbar's
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
        raise InputError("the configuration appears twice", where=str(path), came=twice, cure="One row each.")
    by_name = {design.name: design for design in designs()}
    found = [_one_of(cells, row, columns["design"][0], by_name) for row in range(len(labels))]
    solutions = {str(number): number for number in SOLUTIONS}
    chosen = [_one_of(cells, row, columns["solution"][0], solutions) for row in range(len(labels))]

    def lengths(name: str) -> Array:
        return cells.numbers(*columns[name], missing=True)

    legs = {name: lengths(name) for name in _LEGS}
    fixtures = np.column_stack([_held(cells, columns[name], lengths(name)) for name in _FIXTURES])
    for name, values in {**dict(zip(_FIXTURES, fixtures.T, strict=True)), **legs}.items():
        nominal = device.leg if name in legs else device.base if name.startswith("B") else device.tool
        for row in np.flatnonzero(np.isfinite(values)).tolist():
            device.check(nominal, float(values[row]), name, cells.place(row, columns[name][0]))
    _refuse_strange_legs(cells, columns, found, legs)
    configurations = None
    if any(JOINT_COLUMN.fullmatch(name) for name in columns):
        joints_are, joints = joint_names(columns, f"{path}, line {header}")
        places, units = zip(*(columns[name] for name in joints), strict=True)
        configurations = found_configurations(cells, labels, places, units, joints_are)
    return Sheet(
        source=str(path),
        configurations=configurations,
        labels=labels,
        designs=tuple(found),
        solutions=tuple(chosen),
        base=fixtures[:, :3],
        tool=fixtures[:, 3:],
        legs=np.array([[legs[name][row] for name in design.leg_names] for row, design in enumerate(found)]),
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


def _held(cells: Cells, column: tuple[int, str], values: Array) -> Array:
    """Return a column in which an empty cell has the value above it."""
    given = np.isfinite(values)
    if not given[0]:
        raise InputError(
            "the first row must have the distances of both fixtures",
            where=cells.place(0, column[0]),
            allowed="a length",
            cure="Measure it before the poses: it changes with the temperature of the fixture.",
        )
    return np.asarray(values[np.maximum.accumulate(np.where(given, np.arange(len(values)), 0))])


def _refuse_strange_legs(
    cells: Cells, columns: dict[str, tuple[int, str]], found: Sequence[Design], legs: dict[str, Array]
) -> None:
    for row, design in enumerate(found):
        for name, values in legs.items():
            if np.isfinite(values[row]) and name not in design.leg_names:
                raise InputError(
                    f"the design {design.name} has no leg {name}",
                    where=cells.place(row, columns[name][0]),
                    allowed=", ".join(design.leg_names),
                    cure="Check which cups the bar was between.",
                )


def _columns(cells: Cells) -> dict[str, tuple[int, str]]:
    """Return place and unit of every column by its name, or refuse the header."""
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        where = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, cure="Remove one of them.")
        if name in _PLAIN:
            columns[name] = (place, "1")
        elif name in _FIXTURES or name in _LEGS:
            columns[name] = (place, checked_unit(unit, LENGTH_UNITS, f"{where}, {heading}"))
        elif JOINT_COLUMN.fullmatch(name):
            columns[name] = (place, checked_unit(unit, (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, {heading}"))
        else:
            near = nearest_names(name, (*_PLAIN, *_FIXTURES, *_LEGS), 1)
            raise InputError(
                "the column is not known",
                where=where,
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


@dataclass(frozen=True, eq=False)
class PlannedRow:
    """One configuration to measure.

    Attributes
    ----------
    configuration, branch
        What it is called, and the posture of the arm.
    pose
        Number of the pose.
    design, solution
        Which legs, and how they are assembled.
    joints
        Joint positions [rad or m], ``(joints,)``.
    """

    configuration: str
    branch: str
    pose: int
    design: Design
    solution: int
    joints: Array


def sheet_csv(
    rows: Sequence[PlannedRow],
    joints: Sequence[Joint],
    lengths: Sequence[dict[str, float]] = (),
    controller: Controller | None = None,
) -> str:
    """Return a sheet, empty or with lengths.

    Parameters
    ----------
    rows
        What to measure, in order.
    joints
        Of the robot.
    lengths
        For each row the lengths [m] by name; what is not there stays empty.
    controller
        Who shows the joint positions, ``axis_i``; None for the model's, ``joint_i``.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    positions = joint_cells(np.array([row.joints for row in rows]).reshape(-1, len(joints)), joints, controller)
    writer.writerow([*_PLAIN, *joint_headings(joints, controller), *(f"{name} [mm]" for name in (*_FIXTURES, *_LEGS))])
    for number, row in enumerate(rows):
        known = lengths[number] if lengths else {}
        cells = (repr(written(known[name], "mm")) if name in known else "" for name in (*_FIXTURES, *_LEGS))
        plain = (row.configuration, row.pose, row.branch, row.design.name, row.solution)
        writer.writerow([*plain, *positions[number], *cells])
    return stream.getvalue()
