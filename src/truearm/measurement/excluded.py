"""Readings that are excluded, each with its reason, in a file of their own: measurements stay as they were read.

An excluded reading counts as one that is missing. So configurations keep their places, and the same ones are held out
as before. A file says which::

    configuration,target,reason
    12,2,beam broken
    31,1,reflector touched

Columns ``visit`` and ``fixture`` name one of several readings of a target at a configuration; without them all are
meant.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, did_you_mean
from truearm.files import read_text
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.cells import Layout, lines_of, read_cells
from truearm.modeling.chain import Array

_COLUMNS: Final = ("configuration", "target", "reason")
_MORE: Final = ("visit", "fixture")


@dataclass(frozen=True)
class Exclusion:
    """A reading that is excluded.

    Attributes
    ----------
    configuration, target
        Label and name; a target may be a reference point.
    reason
        Why.
    visit, fixture
        Which of several readings, as the measurements have it; empty for all.
    where
        File and line, for messages.
    """

    configuration: str
    target: str
    reason: str
    visit: str = ""
    fixture: str = ""
    where: str | None = None


def read_exclusions(path: Path) -> tuple[Exclusion, ...]:
    """Read a file of excluded readings; one that has a header alone excludes none.

    Raises
    ------
    InputError
        For other columns, a reading that has no reason, or one that stands twice.
    """
    text = read_text(path)
    if [line.strip() for line in lines_of(text) if line.strip()] == [",".join(_COLUMNS)]:
        return ()
    cells = read_cells(text, str(path), Layout())
    where = f"{path}, line {cells.header}"
    for name in cells.names:
        if name not in (*_COLUMNS, *_MORE) or cells.names.count(name) > 1:
            raise InputError(
                "the column is not known" if name not in (*_COLUMNS, *_MORE) else f"the column {name} appears twice",
                where=where,
                came=name,
                allowed=", ".join((*_COLUMNS, *_MORE)),
            )
    for name in _COLUMNS:
        if name not in cells.names:
            raise InputError(f"the column {name} is missing", where=where, allowed=", ".join((*_COLUMNS, *_MORE)))
    columns = {name: cells.texts(k, missing=name in _MORE) for k, name in enumerate(cells.names)}
    rows = zip(*columns.values(), strict=True)
    found = [
        Exclusion(**dict(zip(columns, row, strict=True)), where=f"{path}, line {line}")
        for line, row in zip(cells.lines, rows, strict=True)
    ]
    seen: set[tuple[str, ...]] = set()
    for one in found:
        key = (one.configuration, one.target, one.visit, one.fixture)
        if key in seen:
            raise InputError(
                "this reading is excluded twice",
                where=one.where,
                came=f"{one.configuration}/{one.target}",
                cure="Remove one of the rows.",
            )
        seen.add(key)
    return tuple(found)


def exclusions_text(exclusions: Iterable[Exclusion]) -> str:
    """Return the file of excluded readings."""
    rows = list(exclusions)
    more = [name for name in _MORE if any(getattr(one, name) for one in rows)]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    columns = [*_COLUMNS, *more]
    writer.writerow(columns)
    writer.writerows([getattr(one, name) for name in columns] for one in rows)
    return stream.getvalue()


def without_readings(data: Dataset, exclusions: Sequence[Exclusion]) -> tuple[Dataset, tuple[int, ...]]:
    """Return data in which the excluded readings are missing, and how many each exclusion means.

    Raises
    ------
    InputError
        If nothing was read where something is excluded.
    """
    labels = {label: number for number, label in enumerate(data.labels)}
    parts = [data] if data.references is None else [data, data.references]
    targets = [{name: number for number, name in enumerate(part.targets)} for part in parts]
    gone = [np.zeros(len(part.target), dtype=bool) for part in parts]
    counts = []
    for one in exclusions:
        if one.configuration not in labels:
            raise InputError(
                "there is no configuration of this name",
                where=one.where,
                came=one.configuration,
                cure=did_you_mean(one.configuration, data.labels) or f"Name configurations of {data.source}.",
            )
        if not any(one.target in names for names in targets):
            raise InputError(
                "there is no target of this name",
                where=one.where,
                came=one.target,
                cure=did_you_mean(one.target, [name for names in targets for name in names])
                or f"Name targets of {data.source}.",
            )
        found = 0
        for part, names, mask in zip(parts, targets, gone, strict=True):
            meant = _meant(part, labels[one.configuration], names.get(one.target, -1), one)
            found += int((meant & ~mask).sum())
            mask |= meant
        counts.append(found)
        if not found:
            raise InputError(
                "nothing was read there, so there is nothing to exclude",
                where=one.where,
                came=f"{one.configuration}/{one.target}",
                cure="Remove the row.",
            )
    made = _missing(data, gone[0])
    if data.references is not None:
        made = replace(made, references=_missing(data.references, gone[1]))
    return made, tuple(counts)


def _meant(part: Dataset, configuration: int, target: int, one: Exclusion) -> NDArray[np.bool_]:
    """Return which readings of a part an exclusion means, ``(readings,)``."""
    meant = (part.configuration == configuration) & (part.target == target) & part.has_reading
    if one.visit:
        visits = np.ones(len(part.target), np.intp) if part.visit is None else part.visit
        meant &= np.array([str(int(visit)) == one.visit for visit in visits])
    if one.fixture:
        names = np.array([*part.fixtures, ""])
        meant &= names[part.against] == one.fixture
    return np.asarray(meant)


def _missing(part: Dataset, gone: NDArray[np.bool_]) -> Dataset:
    def without(values: Array | None) -> Array | None:
        if values is None:
            return None
        kept = values.copy()
        kept[gone] = np.nan
        return kept

    position = without(part.position)
    assert position is not None
    return replace(
        part,
        position=position,
        quaternion=without(part.quaternion),
        distance=without(part.distance),
        height=without(part.height),
    )
