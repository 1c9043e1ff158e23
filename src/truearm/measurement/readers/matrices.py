"""Importer for plain matrices: one file for the joints, one a target, one configuration a row."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from truearm.errors import InputError
from truearm.files import read_text
from truearm.limits import refuse_beyond
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.readers.cells import lines_of, refuse_long, split_line
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.postures import approach_of
from truearm.printable import is_one_line
from truearm.shown import counted
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit, sized_si


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
    checked_unit(angle_unit, ANGLE_UNITS, parameter="angle_unit")
    checked_unit(length_unit, LENGTH_UNITS, parameter="length_unit")
    if not targets:
        raise InputError("no target is given", parameter="targets", cure="Give at least one.")
    for parameter, names in (("targets", targets), ("references", references)):
        for name in names:
            if not is_one_line(name) or name != name.strip():
                raise InputError(
                    "a point needs a name",
                    parameter=parameter,
                    came=name,
                    allowed="one line without blanks around it",
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
        where = f"{path}, line {line}"
        refuse_beyond("columns", len(cells), where=where)
        refuse_beyond("cells", (len(rows) + 1) * len(cells), where=where)
        row = [_number(cell, unit, f"{where}, column {c}", missing=missing) for c, cell in enumerate(cells, 1)]
        first = first or line
        wanted = width or (len(rows[0]) if rows else len(row))
        if len(row) != wanted:
            raise InputError(
                "a position has three numbers" if width else f"the row is not as long as line {first}",
                where=where,
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


def _number(cell: str, unit: str, where: str, *, missing: bool) -> float:
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else None
    except ValueError:
        value = None
    if value is not None and math.isfinite(value):
        return sized_si(value, unit, where, came=cell)
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
    raise InputError("a number belongs here", where=where, came=cell, allowed=allowed, cure=cure)
