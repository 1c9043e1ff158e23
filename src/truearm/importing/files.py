"""Measurements from files of other programs: plain matrices, RoboDK, sockets, and any table of points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError, counted, is_one_line, refusals_of
from truearm.engine.base.files import path_argument, read_text
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import LENGTH_UNITS, quantity_si, sized_si
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import deviation_argument, file_for, length_argument, numbers_argument
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.cells import lines_of, refuse_long, split_line
from truearm.engine.data.readers.robodk import read_robodk
from truearm.engine.data.readers.rows import Readings, dataset_of
from truearm.engine.data.readers.sheets import columns_beside_joints, configurations_of, read_named, refuse_repeated
from truearm.engine.data.readers.table import files_read, read_noting
from truearm.engine.document.records import Imported, ImportedRoboDK
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.postures import approach_of

if TYPE_CHECKING:
    from truearm.importing.jobs import ImportMatrices, ImportRoboDK, ImportSockets, ImportTable


def read_matrices(
    joints: Path,
    targets: Mapping[str, Path],
    references: Mapping[str, Path],
    angle_unit: str,
    length_unit: str,
    joints_are: JointsOf = "model",
) -> tuple[Dataset, Mapping[str, int]]:
    """Read matrices of joints and positions; row n of every file is configuration ``n``.

    Numbers are white-space separated, there is no header, and what follows a ``#`` is a comment. This is the
    only importer in which zeros stand for nothing: a row of zeros, or one with a NaN, in the file of a target
    or a reference point is a missing reading. All configurations stay, even where all readings are missing.

    Args:
        joints: Joint positions, one column a joint; all joints are revolute.
        targets, references: Name and file of each point on the tool and of each fixed point beside the robot; columns
            x, y, z.
        angle_unit, length_unit: Units of the joints and of the positions.
        joints_are: ``model``, or ``controller`` if it shows these joint positions.

    Returns:
        Dataset: The readings, configuration by configuration.
        Mapping: How many readings are missing, by name.
    """
    if not targets:
        raise InputError("no target is given", parameter="targets", cure="Give at least one.")
    for parameter, names in (("targets", targets), ("references", references)):
        for name in names:
            if not is_one_line(name) or name != name.strip():
                raise InputError(
                    "a point needs a name", parameter=parameter, came=name, allowed="one line without blanks around it"
                )
    for name in references:
        if name in targets:
            raise InputError(
                f"{name!r} is given as a target and as a reference",
                parameter="references",
                came=name,
                cure="Give the point on the robot and the one beside it different names.",
            )
    values = _matrix(joints, None, angle_unit, missing=False)
    positions = {}
    for name, path in (*targets.items(), *references.items()):
        positions[name] = _matrix(path, 3, length_unit, missing=True)
        if len(positions[name]) != len(values):
            raise InputError(
                f"the file does not have as many rows as {joints}",
                where=str(path),
                came=counted(len(positions[name]), "row"),
                allowed=counted(len(values), "row"),
                cure="Row n is configuration n in every file: write zeros or NaN where a reading is missing.",
            )

    def part(names: tuple[str, ...], beside: Dataset | None) -> Dataset:
        configuration: IntArray = np.repeat(np.arange(len(values), dtype=np.intp), len(names))
        return Dataset(
            source=str(joints),
            labels=tuple(str(number) for number in range(1, len(values) + 1)),
            joints=values,
            joint_kinds=("revolute",) * values.shape[1],
            joints_are=joints_are,
            targets=names,
            configuration=configuration,
            target=np.tile(np.arange(len(names), dtype=np.intp), len(values)),
            position=np.stack([positions[name] for name in names], axis=1).reshape(-1, 3),
            approach=approach_of(values, np.arange(len(values))),
            number=np.arange(float(len(values))),
            references=beside,
        )

    dataset = part(tuple(targets), part(tuple(references), None) if references else None)
    return dataset, {name: int(np.isnan(p).any(axis=1).sum()) for name, p in positions.items()}


def _matrix(path: Path, width: int | None, unit: str, *, missing: bool) -> Array:
    """Return a matrix of numbers in SI units, ``(rows, columns)``; missing readings are rows of NaN."""
    rows: list[list[float]] = []
    first = 0
    whole = read_text(path)
    refuse_long(whole, str(path), None)
    for line, text in enumerate(lines_of(whole), 1):
        cells = split_line(text.partition("#")[0])
        if not cells:
            continue
        place = f"{path}, line {line}"
        refuse_beyond("columns", len(cells), where=place)
        refuse_beyond("cells", (len(rows) + 1) * len(cells), where=place)
        row = [_number(cell, unit, f"{place}, column {c}", missing=missing) for c, cell in enumerate(cells, 1)]
        first = first or line
        wanted = width or (len(rows[0]) if rows else len(row))
        if len(row) != wanted:
            raise InputError(
                "a position has three numbers" if width else f"the row is not as long as line {first}",
                where=place,
                came=counted(len(row), "number"),
                allowed=counted(wanted, "number"),
                cure="Write one configuration a row.",
            )
        if missing and (not any(row) or any(math.isnan(v) for v in row)):
            row = [math.nan] * wanted
        rows.append(row)
    if not rows:
        raise InputError("the file holds no rows", where=str(path), cure="Check that it was exported whole.")
    return np.array(rows)


def _number(cell: str, unit: str, place: str, *, missing: bool) -> float:
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else None
    except ValueError:
        value = None
    if value is not None and math.isfinite(value):
        return sized_si(value, unit, place, came=cell)
    if value is not None and missing and math.isnan(value):
        return value
    allowed = "a finite number, or NaN for a missing reading" if missing else "a finite number"
    if "," in cell or ";" in cell:
        cure = "Separate numbers by blanks and write decimal points, or use `truearm import table`."
    elif value is None:
        cure = "The file must hold numbers only; begin a heading with #."
    elif missing:
        cure = "Write a row of zeros or NaN where there is no reading."
    else:
        cure = "Every configuration needs all joints: remove the row from all files."
    raise InputError("a number belongs here", where=place, came=cell, allowed=allowed, cure=cure)


def of_matrices(asked: ImportMatrices) -> Imported:
    """Read the matrices that are asked for, and write them as canonical CSV."""
    table, seen = path_argument(asked.joints_file, "joints_file"), _paths(asked.targets)
    beside = _paths(asked.references or {})
    file = None if asked.out is None else file_for(asked.out, table, *seen.values(), *beside.values())
    with refusals_of("joints_file, targets"):
        data, missing = read_matrices(
            table, seen, beside, asked.angle_unit, asked.length_unit, asked.joints_are or "model"
        )
    if file is not None:
        write_text(file, csv_text(data))
    return Imported(data, file, missing)


def _paths(named: Mapping[str, str | Path]) -> dict[str, Path]:
    return {name: Path(file) for name, file in named.items()}


def of_robodk(asked: ImportRoboDK) -> ImportedRoboDK:
    """Read a table of RoboDK, and write it as canonical CSV."""
    table = path_argument(asked.file, "file")
    out = None if asked.out is None else file_for(asked.out, table)
    with refusals_of("file"):
        read = read_robodk(table, asked.angle_unit, asked.joints_are or "model", asked.delimiter, asked.decimal)
    if out is not None:
        write_text(out, csv_text(read.data))
    return ImportedRoboDK(read.data, read.tool_points, out, read.missing)


# A ball that was put into two sockets, again and again: joint positions, and in which socket.
#
# Franzese, Spahn, Kober and Della Santina 2025, "MUKCa: Accurate and Affordable Cobot Calibration Without External
# Measurement Devices".

#: What the ball is called.
BALL: Final = "ball"
_SHOWN: Final = {"configuration": "configuration", "socket": "socket"}
_WHOLE: Final = "200mm,0.02mm"
#: A distance with a larger share of doubt was not measured: a tape measure leaves one in a hundred.
_VAGUEST: Final = 0.1


@dataclass(frozen=True)
class Apart:
    """How far apart two sockets are."""

    distance: float  #: Of the centres of a ball in them [m].
    sigma: float  #: Its standard deviation [m].

    @classmethod
    def of_text(cls, text: str, parameter: str = "apart") -> Apart:
        """Return what a text such as ``200mm,0.02mm`` says: the distance and its standard deviation, with units."""
        parts = text.split(",")
        if len(parts) != 2:
            raise InputError(
                "a distance and its standard deviation belong here", parameter=parameter, came=text, allowed=_WHOLE
            )
        return cls(
            quantity_si(parts[0], LENGTH_UNITS, parameter, "200", _WHOLE),
            quantity_si(parts[1], LENGTH_UNITS, parameter, "0.02", _WHOLE, deviation=True),
        )

    @classmethod
    def of_numbers(cls, numbers: object, parameter: str = "apart") -> Apart:
        """Return what two numbers say [m]."""
        distance, deviation = numbers_argument(numbers, parameter, 2, "200mm,0.02mm, or two numbers in m")
        return cls(length_argument(distance, parameter, 0.0), deviation_argument(deviation, parameter))

    def refuse_vague(self, parameter: str) -> None:
        """Refuse a distance that is hardly known."""
        if self.sigma > _VAGUEST * self.distance:
            raise InputError(
                "the distance of the sockets is hardly known, and nothing else says how long anything is",
                parameter=parameter,
                came=f"{1e3 * self.distance:g} mm with a standard deviation of {1e3 * self.sigma:g} mm",
                allowed=f"a standard deviation of up to {_VAGUEST:.0%} of the distance",
                cure="Measure the distance with a caliper, and give its deviation second: 200mm,0.02mm.",
            )


def read_sockets(path: Path, apart: Apart, ball: float, sigma: float | None) -> Dataset:
    """Read a CSV with the columns ``configuration``, ``joint_1 [deg]`` .. (or ``axis_1`` ..) and ``socket``.

    Args:
        apart: What is known of the sockets.
        ball: Diameter of the ball [m].
        sigma: How well the ball comes to rest in a socket, a standard deviation of each coordinate [m]; None if that is
            not known.

    Raises:
        InputError: If there are not two sockets, or they are closer than the ball is large.
    """
    if apart.distance < ball:
        raise InputError(
            "the sockets are closer than the ball is large, so that they would run into each other",
            parameter="apart",
            came=f"{1e3 * apart.distance:.6g} mm",
            allowed=f"{1e3 * ball:.6g} mm, the diameter of the ball, or more",
            cure="Give the distance of the centres, and the diameter of the ball.",
        )
    cells = read_named(path)
    columns = columns_beside_joints(cells, _SHOWN, {})
    configurations = configurations_of(cells, columns)
    place, _ = columns["socket"]
    sockets = cells.texts(place)
    names = tuple(dict.fromkeys(sockets))
    if len(names) != 2:
        raise InputError(
            "two sockets are needed: their distance is the only length that is known",
            where=f"{path}, column socket",
            came=f"{len(names)}: {', '.join(names[:5])}",
            allowed="two names",
            cure="Put the ball into both sockets." if len(names) < 2 else "Correct the names, or keep two of them.",
        )
    refuse_repeated(
        cells, configurations, "Each row is a posture with the ball in one socket: give it a label of its own."
    )
    count = len(cells.lines)
    data = dataset_of(
        Readings(
            source=str(path),
            lines=cells.lines,
            configuration=configurations.of_row,
            targets=(BALL,) * count,
            reference=np.zeros(count, dtype=bool),
            position=np.zeros((count, 3)),
            sigma=None if sigma is None else np.full(count, sigma),
            fixture=sockets,
        ),
        configurations,
    )
    known = Dataset(
        source=str(path),
        labels=("",),
        joints=np.zeros((1, data.joints.shape[1])),
        joint_kinds=data.joint_kinds,
        targets=(names[1],),
        configuration=np.zeros(1, dtype=np.intp),
        target=np.zeros(1, dtype=np.intp),
        position=np.full((1, 3), np.nan),
        distance=np.array([apart.distance]),
        fixtures=names,
        fixture=np.zeros(1, dtype=np.intp),
        sigma=np.array([apart.sigma]),
    )
    return replace(data, setup=known)


def of_sockets(asked: ImportSockets) -> Imported:
    """Read in which socket a ball was, and write it as canonical CSV."""
    table = path_argument(asked.file, "file")
    out = None if asked.out is None else file_for(asked.out, table)
    apart, ball = Apart.of_numbers(asked.apart), float(asked.ball)
    with refusals_of("file"):
        data = read_sockets(table, apart, ball, asked.sigma)
    if out is not None:
        write_text(out, csv_text(data))
    return Imported(data, out)


def of_table(asked: ImportTable) -> Imported:
    """Read a table by its mapping, and write it as canonical CSV."""
    table, columns = path_argument(asked.file, "file"), path_argument(asked.mapping, "mapping")
    beside = None if asked.joints_file is None else path_argument(asked.joints_file, "joints_file")
    with refusals_of("mapping"):
        read = files_read(table, columns, beside)
    out = None if asked.out is None else file_for(asked.out, *read)
    with refusals_of("file"):
        data, noticed = read_noting(table, columns, asked.joints_are, beside)
    if out is not None:
        write_text(out, csv_text(data))
    return Imported(data, out, warnings=noticed)
