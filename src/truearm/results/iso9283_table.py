"""The values of a test by ISO 9283 as cells of tables: for the command, and for the report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from truearm.planning.iso9283.criteria import CRITERIA, TEST_OF, TESTS
from truearm.shown import counted
from truearm.validation.iso9283.result_file import Entry, ResultFile
from truearm.validation.iso9283.values import Conditions, Quantity, Value

#: Unit of each kind of number at the edges, and how many of it one SI unit is.
UNITS: Final[Mapping[Quantity, tuple[str, float]]] = {
    "length": ("mm", 1e3),
    "angle": ("deg", math.degrees(1.0)),
    "time": ("s", 1.0),
    "ratio": ("%", 100.0),
    "speed": ("mm/s", 1e3),
    "compliance": ("mm/N", 1e3),
}
_DECIMALS: Final[Mapping[Quantity, int]] = {
    "length": 4,
    "angle": 4,
    "time": 3,
    "ratio": 3,
    "speed": 2,
    "compliance": 6,
}
#: Columns of :attr:`Worst.cells`.
HEADING: Final = (
    "Criterion",
    "Worst place",
    "Value",
    "95 %, or range",
    "Other velocities",
    "Status",
)
#: Where the value is the worst of several places already.
_ALL_PLACES: Final = "all poses"


@dataclass(frozen=True)
class Worst:
    """A criterion at its worst place at the fastest velocity."""

    value: Value  #: The largest of them without its sign.
    places: int  #: How many there are.
    others: tuple[Value, ...]  #: The worst at each other velocity.
    missing: tuple[str, ...] = ()  #: Other places at that velocity that have no value.
    faster: float | None = None  #: A faster planned velocity at which there is no value; None if there is none.

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells of its row: criterion, place, value, interval, other velocities, status."""
        value = self.value
        where = value.where
        if self.places > 1 and where != _ALL_PLACES:
            where = f"{where}, worst of {self.places}"
            if self.missing:
                where += f" of {self.places + len(self.missing)}"
        besides = [f"{velocity_words(other.conditions)}: {number_words(other)}" for other in self.others]
        name = f"{value.id} {value.conditions.robot}".rstrip()
        load = value.conditions.load
        if load is not None and load < 1.0:
            where = f"{where}, load {100 * load:g} %"
        status = [str(value.status)] if value.status != "measured" else []
        if self.missing:
            status.append(f"not-measured: {', '.join(self.missing)}")
        if self.faster is not None:
            status.append(f"not-measured: {100 * self.faster:g} %")
        return (
            name,
            where,
            f"{number_words(value)} {UNITS[value.quantity][0]}",
            beside_words(value),
            ", ".join(besides),
            "; ".join(status),
        )


def worst_places(values: Sequence[Value]) -> list[Worst]:
    """Return each criterion of position at its worst place; loads and robots apart, in the order of the standard."""
    groups: dict[tuple[str, float | None, str], dict[float, list[Value]]] = {}
    for value in values:
        if value.component == "position":
            under = value.conditions
            by_velocity = groups.setdefault((value.id, under.load, under.robot), {})
            by_velocity.setdefault(under.velocity or 0.0, []).append(value)
    found = []
    for by_velocity in groups.values():
        planned = sorted(by_velocity, reverse=True)
        there = {velocity: [one for one in by_velocity[velocity] if math.isfinite(one.value)] for velocity in planned}
        measured = [velocity for velocity in planned if there[velocity]]
        if not measured:
            continue
        fastest, *others = (there[velocity] for velocity in measured)
        places = len([value for value in fastest if value.where != _ALL_PLACES])
        missing = [one.where for one in by_velocity[measured[0]] if math.isnan(one.value)]
        faster = planned[0] if planned[0] != measured[0] else None
        found.append(Worst(_worst(fastest), places, tuple(map(_worst, others)), tuple(missing), faster))
    return sorted(found, key=lambda one: CRITERIA.index(one.value.id))


def _worst(values: Sequence[Value]) -> Value:
    whole = [value for value in values if value.where == _ALL_PLACES]
    return max(whole or values, key=lambda value: abs(value.value))


def number_words(value: Value) -> str:
    """Return a value in its unit, without naming it."""
    return _number(value.value, value.quantity)


def beside_words(value: Value) -> str:
    """Return its interval, or the range of its cycles where they are too few for one."""
    if value.interval is not None:
        low, high = (_number(end, value.quantity) for end in value.interval)
        return f"{low} to {high}"
    if value.least is not None and value.largest is not None:
        low, high = (_number(end, value.quantity) for end in (value.least, value.largest))
        return f"{low} to {high} in {counted(value.cycles, 'cycle')}"
    return ""


def velocity_words(under: Conditions) -> str:
    """Return the velocity in percent."""
    return "" if under.velocity is None else f"{100 * under.velocity:g} %"


def conditions_words(value: Value) -> str:
    """Return under what a value was measured, in words."""
    under = value.conditions
    parts = [velocity_words(under)] if under.velocity is not None else []
    if under.load is not None:
        parts.append(f"load {100 * under.load:g} %")
    return ", ".join([*parts, under.robot] if under.robot else parts)


def conditions_summary(under: Conditions) -> dict[str, float | str]:
    """Return conditions as JSON holds them."""
    found: dict[str, float | str] = {}
    if under.velocity is not None:
        found["velocity_percent"] = round(100.0 * under.velocity, 6)
    if under.load is not None:
        found["load_percent"] = round(100.0 * under.load, 6)
    return {**found, "robot": under.robot} if under.robot else found


def values_of(result: ResultFile) -> tuple[Value, ...]:
    """Return the values of a result that was read again, in SI units."""
    return tuple(map(_value, result.criteria))


def conditions_of(conditions: Mapping[str, float | str]) -> Conditions:
    """Return conditions as files have them: the inverse of :func:`conditions_summary`."""
    velocity, load = (conditions.get(f"{name}_percent") for name in ("velocity", "load"))
    return Conditions(
        velocity / 100.0 if isinstance(velocity, float) else None,
        load / 100.0 if isinstance(load, float) else None,
        str(conditions.get("robot", "")),
    )


def _value(entry: Entry) -> Value:
    quantity, per_si = next((name, per) for name, (unit, per) in UNITS.items() if unit == entry.unit)

    def in_si(number: float | None) -> float | None:
        return None if number is None else number / per_si

    value = in_si(entry.value)
    ends = entry.interval_95
    least, largest = (None, None) if entry.range is None else map(in_si, entry.range)
    return Value(
        entry.id,
        entry.component,
        entry.where,
        math.nan if value is None else value,
        quantity,
        None if ends is None else (ends[0] / per_si, ends[1] / per_si),
        entry.cycles,
        conditions_of(entry.conditions),
        entry.status,
        least,
        largest,
        entry.bandwidth_hz,
    )


def test_name(value: Value) -> str:
    """Return the name of the test that a value belongs to."""
    return TESTS[TEST_OF[value.id]].name


def counted_criteria(count: int) -> str:
    """Return how many criteria, in words."""
    return f"{count} criteri{'on' if count == 1 else 'a'}"


def _number(number: float, quantity: Quantity) -> str:
    return f"{number * UNITS[quantity][1]:.{_DECIMALS[quantity]}f}"
