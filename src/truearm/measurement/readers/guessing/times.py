"""Which column of a table seems to tell when its rows were measured, and in what format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import product
from typing import Final

import numpy as np

from truearm.measurement.readers.guessing.mapping_text import OPEN, named, quoted
from truearm.measurement.readers.guessing.meanings import Column, named_like
from truearm.measurement.readers.measuring_order import MIDNIGHT

_CLOCKS: Final = ("%H:%M:%S", "%H:%M:%S.%f", "%H:%M:%S,%f", "%I:%M:%S %p", "%H:%M", "%I:%M %p")
_DAYS: Final = (
    *("%d.%m.%Y", "%d.%m.%y", "%m/%d/%Y", "%d/%m/%Y", "%m/%d/%y", "%d/%m/%y", "%Y/%m/%d", "%d-%m-%Y", "%m-%d-%Y"),
    *("%d-%b-%Y", "%d-%b-%y", "%d %b %Y", "%b %d %Y", "%b %d, %Y", "%d %B %Y", "%Y.%m.%d"),
)
_BETWEEN: Final = (" ", ", ", "T", "_")
_FORMATS: Final = (
    "iso",
    *(f"{day}{between}{clock}" for day, clock, between in product(_DAYS, _CLOCKS, _BETWEEN)),
    *_CLOCKS,
)
#: Units of running times.
_SECONDS: Final = frozenset({"s", "sec", "ms", "us", "min", "h"})


@dataclass(frozen=True)
class GuessedTime:
    """What seems to tell the order of measurement."""

    #: The column that does, or one with the day and one with the time; none if there are times, and which of them does,
    #: or how, is not known.
    columns: tuple[Column, ...]
    value: str  #: The entry of the mapping.
    because: str  #: What it rests on.


def time_among(columns: Sequence[Column]) -> GuessedTime | None:
    """Return what tells the time of the rows; None if no column seems to, or all rows have the same."""
    found = []
    rest = list(columns)
    while (column := named_like(rest, "time")) is not None:
        rest.remove(column)
        if len(set(column.given)) > 1:
            found.append(column)
    if not found:
        return _running(columns)
    dates = [column for column in found if not column.is_numeric and all(map(_is_day, column.given))]
    times = [column for column in found if column not in dates]
    if len(dates) == len(times) == 1 and _is_clock(times[0]) and len(dates[0].given) == len(times[0].given):
        return _of_columns(dates[0], times[0])
    if dates and (len(times) != 1 or _is_clock(times[0])):
        names = " and ".join(column.name for column in found)
        return _asked(f"{names} tell it together, or a day alone does not: write both into one column")
    return _of_columns(times[0])


def _asked(because: str) -> GuessedTime:
    return GuessedTime((), quoted(OPEN), f"{because}; {{column, time: %d.%m.%Y %H:%M:%S}}, {{by: rows}} or nothing")


def _running(columns: Sequence[Column]) -> GuessedTime | None:
    """Return a column t with a unit of time that rises from row to row."""
    for column in columns:
        if column.words == ("t",) and column.foreign in _SECONDS and column.is_numeric:
            if len(column.values) == len(column.texts) and bool((np.diff(column.values) > 0).all()):
                return GuessedTime((column,), f"{{column: {named(column)}}}", "its name and its unit; it rises")
            return _asked(f"{column.name} may be a time, and does not rise from row to row")
    return None


def _of_columns(column: Column, clock: Column | None = None) -> GuessedTime:
    if column.is_numeric:
        return GuessedTime((column,), f"{{column: {named(column)}}}", "its name")
    given = column.given
    if clock is not None:
        given = [f"{_bare_day(day)} {time}" for day, time in zip(column.given, clock.given, strict=True)]
    who = column.name if clock is None else f"{column.name} and {clock.name}"
    formats = [way for way in _FORMATS if all(_reads(text, way) for text in given)]
    if not formats:
        return _asked(f"the times in {who}, such as {given[0][:40]}, are of no format that is known")
    orders = {tuple(sorted(given, key=lambda text: _moment(text, way))) for way in formats}
    if len(orders) > 1:
        return _asked(f"{formats[0]} and {formats[1]} both read {who}, and tell different orders")
    shown = "iso" if formats[0] == "iso" else f"'{formats[0]}'"
    because = "its name and its texts" if clock is None else "their names and their texts"
    if len(formats) > 1:
        because = f"{because.rpartition(' and ')[2]}; {formats[1]} would read them too"
    if clock is not None:
        value = f"{{columns: [{named(column)}, {named(clock)}], time: {shown}}}"
        return GuessedTime((column, clock), value, because)
    return GuessedTime((column,), f"{{column: {named(column)}, time: {shown}}}", because)


def _is_clock(column: Column) -> bool:
    """Return whether the texts of a column are times without a day."""
    return any(all(_reads(text, way) for text in column.given) for way in _CLOCKS)


def _is_day(text: str) -> bool:
    return any(_reads(_bare_day(text), way) for way in ("%Y-%m-%d", *_DAYS))


def _bare_day(text: str) -> str:
    """Return a day without what a workbook adds to it."""
    return text.removesuffix(MIDNIGHT)


def _reads(text: str, way: str) -> bool:
    try:
        _moment(text, way)
    except ValueError:
        return False
    return True


def _moment(text: str, way: str) -> str:
    """Return a time as a text that sorts as times do."""
    moment = datetime.fromisoformat(text) if way == "iso" else datetime.strptime(text, way)
    return (moment if moment.tzinfo is None else moment.astimezone(UTC)).isoformat(timespec="microseconds")
