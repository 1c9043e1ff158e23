"""Readings that are excluded, each with its reason, in a file of their own: measurements stay as they were read.

An excluded reading counts as one that is missing. So configurations keep their places, and the same ones are held out
as before. A file says which::

    configuration,target,reason,read [mm]
    12,2,beam broken,1203.4512 -33.221 871.0034
    31,1,reflector touched,

Columns ``visit`` and ``fixture`` name one of several readings of a target at a configuration; without them all are
meant. What was read there says which reading is meant: other measurements, whose configurations have the same names,
have another one there, and are refused.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.files import read_text
from truearm.engine.base.units import LENGTH_UNITS, as_number, checked_unit, sized_si
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.robot.chain import Array

_COLUMNS: Final = ("configuration", "target", "reason")
_MORE: Final = ("visit", "fixture")
_SHOWN: Final = ", ".join((*_COLUMNS, *_MORE, "read [mm]"))
_READ: Final = re.compile(r"read\s*(?:\[(?P<unit>[^\]]*)\])?")
#: The same reading, written with fewer digits or in another unit, is at most so far off [m].
_SAME: Final = 1e-6

#: What was read: x, y and z, or a distance, or a height [m].
Read = tuple[float, ...]


@dataclass(frozen=True)
class Exclusion:
    """A reading that is excluded."""

    configuration: str  #: configuration, target: label and name; a target may be a reference point.
    target: str
    reason: str  #: Why.
    visit: str = ""  #: visit, fixture: which of several readings, as the measurements have it; empty for all.
    fixture: str = ""
    read: tuple[Read, ...] = ()  #: What the excluded readings were; empty where that is not said.
    where: str | None = None  #: File and line, for messages.


def read_exclusions(path: Path) -> tuple[Exclusion, ...]:
    """Read a file of excluded readings; one that has a header alone excludes none.

    Raises:
        InputError: For other columns, a reading that has no reason, or one that stands twice, and numbers that cannot
            be.
    """
    text = read_text(path)
    if [line.strip() for line in lines_of(text) if line.strip()] == [",".join(_COLUMNS)]:
        return ()
    cells = read_cells(text, str(path), Layout())
    where = f"{path}, line {cells.header}"
    names = tuple("read" if _READ.fullmatch(name) else name for name in cells.names)
    known = (*_COLUMNS, *_MORE, "read")
    for name in names:
        if name not in known or names.count(name) > 1:
            raise InputError(
                "the column is not known" if name not in known else f"the column {name} appears twice",
                where=where,
                came=name,
                allowed=_SHOWN,
            )
    for name in _COLUMNS:
        if name not in names:
            raise InputError(f"the column {name} is missing", where=where, allowed=_SHOWN)
    columns = {name: cells.texts(k, missing=name in _MORE) for k, name in enumerate(names) if name != "read"}
    read = _noted(cells, names.index("read"), where) if "read" in names else [()] * len(cells.lines)
    rows = zip(*columns.values(), strict=True)
    exclusions = [
        Exclusion(**dict(zip(columns, row, strict=True)), read=numbers, where=f"{path}, line {line}")
        for line, row, numbers in zip(cells.lines, rows, read, strict=True)
    ]
    seen: set[tuple[str, ...]] = set()
    for exclusion in exclusions:
        key = (exclusion.configuration, exclusion.target, exclusion.visit, exclusion.fixture)
        if key in seen:
            raise InputError(
                "this reading is excluded twice",
                where=exclusion.where,
                came=f"{exclusion.configuration}/{exclusion.target}",
                cure="Remove one of the rows.",
            )
        seen.add(key)
    return tuple(exclusions)


def exclusions_text(exclusions: Iterable[Exclusion]) -> str:
    """Return the file of excluded readings."""
    rows = list(exclusions)
    more = [name for name in _MORE if any(getattr(row, name) for row in rows)]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    columns, noted = [*_COLUMNS, *more], any(row.read for row in rows)
    writer.writerow([*columns, *(["read [mm]"] if noted else [])])
    for row in rows:
        writer.writerow([*(getattr(row, name) for name in columns), *([_in_mm(row.read)] if noted else [])])
    return stream.getvalue()


def numbers_read(part: Dataset) -> list[Read]:
    """Return what each reading of data is, as :class:`Exclusion` has it; empty where nothing has a place or length."""
    lengths = [values[:, None] for values in (part.distance, part.height) if values is not None]
    position = np.where(part.has_position[:, None], part.position, np.nan)
    rows = np.concatenate([position, *lengths], axis=1)
    return [tuple(row[np.isfinite(row)].tolist()) for row in rows]


def without_readings(data: Dataset, exclusions: Sequence[Exclusion]) -> tuple[Dataset, tuple[int, ...]]:
    """Return data in which the excluded readings are missing, and how many each exclusion means.

    Raises:
        InputError: If nothing was read where something is excluded, or something else than what was excluded.
    """
    labels = {label: number for number, label in enumerate(data.labels)}
    parts = [data] if data.references is None else [data, data.references]
    targets = [{name: number for number, name in enumerate(part.targets)} for part in parts]
    gone = [np.zeros(len(part.target), dtype=bool) for part in parts]
    counts = []
    numbers = [numbers_read(part) for part in parts] if any(exclusion.read for exclusion in exclusions) else []
    for exclusion in exclusions:
        if exclusion.configuration not in labels:
            raise InputError(
                "there is no configuration of this name",
                where=exclusion.where,
                came=exclusion.configuration,
                cure=did_you_mean(exclusion.configuration, data.labels) or f"Name configurations of {data.source}.",
            )
        if not any(exclusion.target in names for names in targets):
            raise InputError(
                "there is no target of this name",
                where=exclusion.where,
                came=exclusion.target,
                cure=did_you_mean(exclusion.target, [name for names in targets for name in names])
                or f"Name targets of {data.source}.",
            )
        masks = [
            _meant(part, labels[exclusion.configuration], names.get(exclusion.target, -1), exclusion)
            for part, names in zip(parts, targets, strict=True)
        ]
        if exclusion.read and any(mask.any() for mask in masks):
            _refuse_another(
                exclusion, tuple(numbers[k][row] for k, mask in enumerate(masks) for row in np.flatnonzero(mask)), data
            )
        count = 0
        for meant, mask in zip(masks, gone, strict=True):
            count += int((meant & ~mask).sum())
            mask |= meant
        counts.append(count)
        if not count:
            raise InputError(
                "nothing was read there, so there is nothing to exclude",
                where=exclusion.where,
                came=f"{exclusion.configuration}/{exclusion.target}",
                cure="Remove the row.",
            )
    remaining = _missing(data, gone[0])
    if data.references is not None:
        remaining = replace(remaining, references=_missing(data.references, gone[1]))
    return remaining, tuple(counts)


def _noted(cells: Cells, column: int, where: str) -> list[tuple[Read, ...]]:
    """Return what a column says that was read: numbers with blanks between them, readings with semicolons."""
    match = _READ.fullmatch(cells.names[column])
    unit = checked_unit(match["unit"] if match else None, LENGTH_UNITS, f"{where}, read")
    readings = []
    for row, text in enumerate(cells.texts(column, missing=True)):
        place = cells.place(row, column)
        parts = [part.split() for part in text.split(";")] if text else []
        numbers = [[as_number(word) for word in words] for words in parts]
        if any(not words or None in words for words in numbers):
            raise InputError(
                "numbers with blanks between them belong here",
                where=place,
                came=text,
                allowed="x y z, a distance, or a height; several readings with semicolons between them",
            )
        readings.append(
            tuple(tuple(sized_si(value, unit, place) for value in words if value is not None) for words in numbers)
        )
    return readings


def _in_mm(read: Iterable[Read]) -> str:
    return "; ".join(" ".join(f"{round(value * 1e3, 6) + 0.0:.12g}" for value in numbers) for numbers in read)


def _refuse_another(exclusion: Exclusion, present: tuple[Read, ...], data: Dataset) -> None:
    """Refuse readings that are not those that an exclusion means; their order does not matter."""
    left = [numbers for numbers in present if numbers]
    for wanted in exclusion.read:
        same = [n for n in left if len(n) == len(wanted) and np.allclose(n, wanted, rtol=0.0, atol=_SAME)]
        if not same:
            break
        left.remove(same[0])
    else:
        if not left:
            return
    raise InputError(
        "another reading stands here in the measurements than the one that was excluded",
        where=exclusion.where,
        came=f"{_in_mm(n for n in present if n) or 'no'} mm in {data.source}",
        allowed=f"{_in_mm(exclusion.read)} mm for {exclusion.configuration}/{exclusion.target}",
        cure="Give the file of excluded readings that was made for these measurements, or none.",
    )


def _meant(part: Dataset, configuration: int, target: int, exclusion: Exclusion) -> NDArray[np.bool_]:
    """Return which readings of a part an exclusion means, ``(readings,)``."""
    meant = (part.configuration == configuration) & (part.target == target) & part.has_reading
    if exclusion.visit:
        visits = np.ones(len(part.target), np.intp) if part.visit is None else part.visit
        meant &= np.array([str(int(visit)) == exclusion.visit for visit in visits])
    if exclusion.fixture:
        names = np.array([*part.fixtures, ""])
        meant &= names[part.against] == exclusion.fixture
    return np.asarray(meant)


def _missing(part: Dataset, gone: NDArray[np.bool_]) -> Dataset:
    def without(values: Array | None) -> Array | None:
        if values is None:
            return None
        remaining = values.copy()
        remaining[gone] = np.nan
        return remaining

    position = without(part.position)
    assert position is not None
    return replace(
        part,
        position=position,
        quaternion=without(part.quaternion),
        distance=without(part.distance),
        height=without(part.height),
    )
