"""The order in which configurations were measured, as a table of any make tells it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import IntArray
from truearm.engine.data.readers.cells import Cells
from truearm.engine.data.readers.mapping import OrderEntry
from truearm.engine.robot.chain import Array

#: A label that ends with a number; what stands before it is the same in all labels.
_NUMBERED: Final = re.compile("(?P<before>.*?)(?P<number>[0-9]{1,9})")
#: Times without a day that lie further apart [s] may have passed midnight.
_HALF_A_DAY: Final = 12 * 3600.0
#: What a workbook adds to a day.
MIDNIGHT: Final = " 00:00:00"
_CANNOT_TELL: Final = "Leave order out of the mapping if nothing tells it."
#: Numbers of configurations are below.
_BEYOND: Final = 1e9


def measuring_order(
    entry: OrderEntry, cells: Cells, places: Sequence[int], labels: Sequence[str], of_row: IntArray, where: str
) -> IntArray:
    """Return the number of each configuration in the order of measurement, ``(configurations,)``.

    Times and running numbers give ranks: 1, 2, 3. A number that all rows of a configuration share, and that of a
    label, stays as it is, so that gaps are gaps.

    Args:
        entry: What the mapping says.
        places: The columns that it names: none, one, or two with the day and the time.
        labels: Of the configurations, those that were not measured included.
        of_row: Configuration of each row, ``(rows,)``.
        where: The entry in the mapping, for messages.

    Raises:
        InputError: If the labels are not numbered, a time or number cannot be read, or configurations overlap or
            coincide.
    """
    if entry.by == "labels":
        return _by_labels(cells, labels, of_row, where)
    if entry.by == "rows" or not places:
        return np.arange(1, len(labels) + 1)
    values = cells.values(places[0]) if entry.time is None else moments(cells, places, entry)
    first, last, row = _spans(values, of_row, len(labels))
    measured = np.flatnonzero(np.isfinite(first))
    if not len(measured):
        raise InputError(
            "the column that shall tell the order is empty", where=cells.place(0, places[0]), cure=_CANNOT_TELL
        )
    is_place = (first == last) & (first == np.floor(first)) & (first >= 0) & (first < _BEYOND)
    sequence = measured[np.argsort(first[measured], kind="stable")]
    for before, after in pairwise(sequence.tolist()):
        if last[before] >= first[after]:
            same = first[before] == last[before] == first[after] == last[after]
            raise InputError(
                f"the configurations {labels[before]!r} and {labels[after]!r} "
                f"{'were measured at the same time' if same else 'were measured in turns'}",
                where=_place_of_row(cells, int(row[after]), places),
                came=" ".join(cells.columns[place][int(row[after])] for place in places),
                allowed="one configuration after the other",
                cure=f"A configuration is one standstill: give each its own label. {_CANNOT_TELL}",
            )
    if len(measured) < len(labels):
        return _with_unmeasured(sequence, labels, np.isfinite(first), where)
    if entry.time is None and bool(is_place.all()):
        return first.astype(np.intp)
    order = np.empty(len(labels), dtype=np.intp)
    order[sequence] = np.arange(1, len(labels) + 1)
    return order


def refuse_returns(cells: Cells, labels: Sequence[str], of_row: IntArray, where: str) -> None:
    """Refuse a table in which a configuration comes again after another one: its rows tell no order."""
    seen: set[int] = set()
    before = -1
    for row, configuration in enumerate(of_row.tolist()):
        if configuration != before and configuration in seen:
            raise InputError(
                f"the configuration {labels[configuration]!r} comes again after another one, so the rows tell no order",
                where=f"{cells.source}, line {cells.lines[row]}",
                cure=f"Let something else tell it ({where}): by: labels, or column. {_CANNOT_TELL}",
            )
        seen.add(configuration)
        before = configuration


def _by_labels(cells: Cells, labels: Sequence[str], of_row: IntArray, where: str) -> IntArray:
    """Return the numbers at the end of labels."""
    rows = {int(configuration): row for row, configuration in reversed(list(enumerate(of_row.tolist())))}

    def place(index: int) -> str:
        return f"{cells.source}, line {cells.lines[rows[index]]}" if index in rows else where

    numbers: dict[int, int] = {}
    common: str | None = None
    for index, label in enumerate(labels):
        match = _NUMBERED.fullmatch(label)
        if match is None or (common is not None and match["before"] != common):
            raise InputError(
                "the label does not tell the order of measurement",
                where=place(index),
                came=label,
                allowed=f"{common if common is not None else 'the same text in all labels, such as P,'} and a number",
                cure=_CANNOT_TELL,
            )
        common = match["before"]
        if (other := numbers.setdefault(int(match["number"]), index)) != index:
            raise InputError(
                f"two labels have the same number: {labels[other]} and {label}",
                where=place(index),
                came=label,
                allowed="another number for each configuration",
                cure=_CANNOT_TELL,
            )
    return np.array(list(numbers), dtype=np.intp)


def _place_of_row(cells: Cells, row: int, places: Sequence[int]) -> str:
    return " and ".join([cells.place(row, places[0]), *(cells.names[place] for place in places[1:])])


def _texts_of_moments(cells: Cells, places: Sequence[int], absent: set[str]) -> list[str]:
    """Return the text of each moment, empty where there is none; a day and a time have a blank between them."""
    if len(places) == 1:
        return ["" if text in absent else text for text in cells.columns[places[0]]]
    moment_texts = []
    for row, both in enumerate(zip(*(cells.columns[place] for place in places), strict=True)):
        lacking = [place for place, text in zip(places, both, strict=True) if text in absent]
        if len(lacking) == 1:
            raise InputError(
                "this cell is empty, and the other of day and time is not",
                where=cells.place(row, lacking[0]),
                allowed="a day and a time, or neither",
            )
        day, time = both
        moment_texts.append("" if lacking else f"{day if cells.sheet is None else day.removesuffix(MIDNIGHT)} {time}")
    return moment_texts


def moments(cells: Cells, places: Sequence[int], entry: OrderEntry) -> Array:
    """Return moments in seconds since some moment, ``(rows,)``, NaN where there is none."""
    texts = _texts_of_moments(cells, places, {"", *(cells.absent or ())})
    known: dict[str, datetime | None] = {"": None}
    for row, text in enumerate(texts):
        if text in known:
            continue
        try:
            if entry.time == "iso":
                known[text] = datetime.fromisoformat(text)
            else:
                known[text] = datetime.strptime(text, str(entry.time))
        except ValueError:
            raise InputError(
                "this is no time of the format that the mapping names",
                where=_place_of_row(cells, row, places),
                came=text,
                allowed="2026-11-23 14:05:09" if entry.time == "iso" else str(entry.time),
                cure="Correct order.time in the mapping: iso, or signs of Python such as %d.%m.%Y %H:%M:%S.",
            ) from None
    rows = [row for row, text in enumerate(texts) if known[text] is not None]
    bare = [row for row in rows if (moment := known[texts[row]]) is not None and moment.tzinfo is None]
    if bare and len(bare) < len(rows):
        row = bare[0]
        raise InputError(
            "this time has no time zone, and others have one", where=_place_of_row(cells, row, places), came=texts[row]
        )
    seconds = {text: math.nan if moment is None else _seconds(moment) for text, moment in known.items()}
    values = np.array([seconds[text] for text in texts])
    if rows and not entry.has_day and np.nanmax(values) - np.nanmin(values) > _HALF_A_DAY:
        row = int(np.nanargmax(values))
        raise InputError(
            "the times have no day and lie more than 12 hours apart, so that they may have passed midnight",
            where=_place_of_row(cells, row, places),
            came=texts[row],
            cure="Export the day as well, or let something else tell the order.",
        )
    return values


def _seconds(moment: datetime) -> float:
    zone = moment.tzinfo or UTC
    return (moment.replace(tzinfo=zone) - datetime(2000, 1, 1, tzinfo=UTC)).total_seconds()


def _spans(values: Array, of_row: IntArray, count: int) -> tuple[Array, Array, IntArray]:
    """Return the first and last value of each configuration, NaN if it has none, and the row of the first."""
    first, last = np.full(count, np.nan), np.full(count, np.nan)
    row_of_first = np.zeros(count, dtype=np.intp)
    for row in np.flatnonzero(np.isfinite(values)).tolist():
        configuration, value = int(of_row[row]), float(values[row])
        if not first[configuration] <= value:
            first[configuration], row_of_first[configuration] = value, row
        if not last[configuration] >= value:
            last[configuration] = value
    return first, last, row_of_first


def _with_unmeasured(sequence: IntArray, labels: Sequence[str], measured: NDArray[np.bool_], where: str) -> IntArray:
    """Return the order in which the configurations are listed, if those that were measured came in it."""
    if (np.diff(sequence) < 0).any():
        label = labels[int(np.flatnonzero(~measured)[0])]
        raise InputError(
            "a configuration has no time or number, and where it stands in the order is not known",
            where=where,
            came=label,
            allowed="a time or number for each configuration, or all of them listed as they were driven",
            cure=f"Remove it, or list all as they were driven. {_CANNOT_TELL}",
        )
    return np.arange(1, len(labels) + 1)
