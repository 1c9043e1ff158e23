"""Poses to go to: a CSV with one row a pose, its columns named as in the canonical CSV."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError, nearest_names
from truearm.files import read_text
from truearm.measurement.readers.canonical import refuse_other_separators
from truearm.measurement.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.measurement.readers.rows import unit_quaternions
from truearm.modeling.chain import Array
from truearm.units import LENGTH_UNITS, checked_unit

_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_SHOWN: Final = {"pose": "pose"} | {axis: f"{axis} [mm]" for axis in _POSITION} | {part: part for part in _QUATERNION}
_ALLOWED: Final = ", ".join(_SHOWN.values())
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")


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
        match = _HEADING.fullmatch(heading)
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
