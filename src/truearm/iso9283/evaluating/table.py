"""The values of a test by ISO 9283 as cells of tables, and what is said about its rows."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from truearm.engine.base.errors import Notice, Rule, counted
from truearm.iso9283.criteria.compliance import OutlyingPush
from truearm.iso9283.criteria.outlying_rows import Kind, OutlyingRow, TwoPlaces
from truearm.iso9283.criteria.rows import Conditions, CopiedBlock, Cycles, Quantity, Value
from truearm.iso9283.evaluating.comparison import Entry, ResultFile
from truearm.iso9283.evaluating.doubts import other_cube
from truearm.iso9283.evaluating.evaluation import Evaluation
from truearm.iso9283.planning.criteria import CRITERIA, TEST_OF, TESTS, PerformancePlan

#: Unit of each kind of number at the edges, and how many of it one SI unit is.
UNITS: Final[Mapping[Quantity, tuple[str, float]]] = {
    "length": ("mm", 1e3),
    "angle": ("deg", math.degrees(1.0)),
    "time": ("s", 1.0),
    "ratio": ("%", 100.0),
    "speed": ("mm/s", 1e3),
    "compliance": ("mm/N", 1e3),
}
_DECIMALS: Final[Mapping[Quantity, int]] = {"length": 4, "angle": 4, "time": 3, "ratio": 3, "speed": 2, "compliance": 6}
#: What a criterion is of its cycles, where that is their mean or their largest; AP, for one, is neither.
_OF_CYCLES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("t", "posing-time", "CR", "CO", "WS", "WF", "compliance"), "mean of "),
    **dict.fromkeys(("OV", "FV"), "largest of "),
}
#: Columns of :attr:`Worst.cells`.
HEADING: Final = ("Criterion", "Worst place", "Value", "95 %, or range", "Other velocities", "Status")
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
        place = value.where
        if self.places > 1 and place != _ALL_PLACES:
            place = f"{place}, worst of {self.places}"
            if self.missing:
                place += f" of {self.places + len(self.missing)}"
        besides = [f"{velocity_words(other.conditions)}: {number_words(other)}" for other in self.others]
        name = f"{value.id} {value.conditions.robot}".rstrip()
        load = value.conditions.load
        if load is not None and load < 1.0:
            place = f"{place}, load {100 * load:g} %"
        status = [str(value.status)] if value.status != "measured" else []
        if self.missing:
            status.append(f"not-measured: {', '.join(self.missing)}")
        if self.faster is not None:
            status.append(f"not-measured: {100 * self.faster:g} %")
        return (
            name,
            place,
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
    worst = []
    for by_velocity in groups.values():
        planned = sorted(by_velocity, reverse=True)
        measured_at = {
            velocity: [entry for entry in by_velocity[velocity] if math.isfinite(entry.value)] for velocity in planned
        }
        measured = [velocity for velocity in planned if measured_at[velocity]]
        if not measured:
            continue
        fastest, *others = (measured_at[velocity] for velocity in measured)
        places = len([value for value in fastest if value.where != _ALL_PLACES])
        missing = [entry.where for entry in by_velocity[measured[0]] if math.isnan(entry.value)]
        faster = planned[0] if planned[0] != measured[0] else None
        worst.append(Worst(_worst(fastest), places, tuple(map(_worst, others)), tuple(missing), faster))
    return sorted(worst, key=lambda row: CRITERIA.index(row.value.id))


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
        return f"{_OF_CYCLES.get(value.id, '')}{counted(value.cycles, 'cycle')}, {low} to {high}"
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
    summary: dict[str, float | str] = {}
    if under.velocity is not None:
        summary["velocity_percent"] = round(100.0 * under.velocity, 6)
    if under.load is not None:
        summary["load_percent"] = round(100.0 * under.load, 6)
    return {**summary, "robot": under.robot} if under.robot else summary


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


def uncovered_tests(values: Sequence[Value]) -> tuple[str, ...]:
    """Return what of the standard's tests the data do not cover, in words: whole tests by name, else criteria."""
    covered = {value.id for value in values if value.status != "not-measured"}
    missing = {test: [name for name in test.criteria if name not in covered] for test in TESTS.values()}
    return tuple(
        f"{test.name} ({', '.join(names)})" if len(names) == len(test.criteria) else ", ".join(names)
        for test, names in missing.items()
        if names
    )


def _number(number: float, quantity: Quantity) -> str:
    return f"{number * UNITS[quantity][1]:.{_DECIMALS[quantity]}f}"


#: So many rows, poses and places are told one by one.
_NAMED_ROWS: Final = 3
_NAMED_PLACES: Final = 8
#: So many values are told with and without a row.
_VALUES: Final = 2
#: Criteria of which each cycle of a place counts once.
_EACH_CYCLE: Final = ("AP", "AD", "AT", "AT-reorientation", "CR", "AV", "WS", "t", "posing-time")
#: Mean orientations further off than this are told [rad].
_FAR_TURNED: Final = math.radians(2.0)


OUTLYING_ROW: Final = Rule(
    "outlying-row",
    "warning",
    "rows lie far from the other cycles of their pose; the values with and without them are said",
    cure="Look at the record, and measure the pose again if the reading was at fault.",
    formerly="wild-row",
    gravity=2,
)
OUTLYING_PUSH: Final = Rule(
    "outlying-push",
    "warning",
    "readings under a push lie far from the line of the others; compliance with and without them is said",
    cure="Look at the record, and push again if the reading was at fault.",
    formerly="wild-push",
    gravity=2,
)
TWO_PLACES: Final = Rule(
    "two-places",
    "warning",
    "the tip rests in two places at a pose: intervals of RP and RD may not hold",
    cure="Look for play, or for something that changed during the test.",
)
CYCLES_ALIKE: Final = Rule(
    "cycles-alike",
    "warning",
    "each cycle is like the one before it: intervals are too narrow",
    cure="Let the robot warm up longer, and see whether robot or instrument creeps.",
)
ORIENTATION_FAR_OFF: Final = Rule(
    "orientation-far-off",
    "warning",
    "orientations are off by more than 2 deg: those of another frame than the plan's tip",
)
PLACES_MISSING: Final = Rule(
    "places-missing",
    "warning",
    "poses, approaches, robots, paths or velocities of the plan have no row",
    cure="Measure them, or plan the test without them.",
)


def row_notices(evaluation: Evaluation) -> tuple[Notice, ...]:
    """Return what is to be known about the rows of an evaluation."""
    notices = []
    outlying, places = evaluation.unusual.outlying, evaluation.unusual.two_places
    if outlying:
        words = " ".join(_outlying_words(row, "it" if len(outlying) == 1 else "them") for row in outlying[:_NAMED_ROWS])
        if len(outlying) > _NAMED_ROWS:
            words += f" So do {counted(len(outlying) - _NAMED_ROWS, 'other row')}, on line "
            words += f"{', '.join(str(int(row.of.line[0])) for row in outlying[_NAMED_ROWS:])}."
        notices.append(OUTLYING_ROW(f"{words} The standard excludes no row, and none was left out."))
    if evaluation.outlying_pushes:
        words = " ".join(_push_words(push) for push in evaluation.outlying_pushes)
        notices.append(OUTLYING_PUSH(f"{words} The standard excludes no reading, and none was left out."))
    if places:
        words = "; ".join(_places_words(place) for place in places[:_NAMED_ROWS])
        more = f"; and {len(places) - _NAMED_ROWS} more" if len(places) > _NAMED_ROWS else ""
        notices.append(
            TWO_PLACES(
                f"The tip comes to rest in two places: {words}{more}. The values stand, but the intervals of RP and RD "
                "may not hold."
            )
        )
    if evaluation.unusual.alike:
        words = "; ".join(
            f"{test.test}, {100 * test.velocity:g} %, load {100 * test.load:g} % (correlation {test.correlation:.2f}, "
            f"of independent cycles up to {2 * test.usual:.2f})"
            for test in evaluation.unusual.alike[:_NAMED_PLACES]
        )
        notices.append(
            CYCLES_ALIKE(
                f"Each cycle is like the one before it: {words}. Intervals assume that cycles are independent, and are "
                "too narrow here."
            )
        )
    turned = [v for v in evaluation.values if v.id == "AP" and v.quantity == "angle" and abs(v.value) > _FAR_TURNED]
    if turned:
        worst = max(turned, key=lambda value: abs(value.value))
        notices.append(
            ORIENTATION_FAR_OFF(
                f"Orientations are off by up to {number_words(worst)} deg (AP {worst.component} of {worst.where}). "
                "Robots are seldom off by a degree: check that they are those of the plan's tip, and the rotation of "
                "the alignment."
            )
        )
    if evaluation.missing:
        words = "; ".join(evaluation.missing[:_NAMED_PLACES])
        more = (
            f"; and {len(evaluation.missing) - _NAMED_PLACES} more" if len(evaluation.missing) > _NAMED_PLACES else ""
        )
        notices.append(
            PLACES_MISSING(
                f"Planned and without a row: {words}{more}. The worst of the others is not what the standard asks for."
            )
        )
    return tuple(notices)


TOO_FEW_CYCLES: Final = Rule(
    "too-few-cycles", "warning", "fewer cycles than planned, with the place and how many of how many; the values stand"
)
MORE_CYCLES: Final = Rule(
    "more-cycles", "note", "more cycles than planned: all are in the values. Check that none belongs to another test"
)


def cycle_notices(plan: PerformancePlan, evaluation: Evaluation) -> list[Notice]:
    """Return what is to be known about cycles that are fewer or more than planned."""
    few, more = dict[str, None](), dict[str, None]()
    for value in evaluation.values:
        planned = plan.test(TEST_OF[value.id])
        if planned is None or value.component != "position" or value.status == "not-measured":
            continue
        words = f"{value.id} {value.where}: {value.cycles} of {planned.cycles}"
        if value.status == "too-few-cycles":
            few[words] = None
        elif value.id in _EACH_CYCLE and value.cycles > planned.cycles:
            more[words] = None
    notices = []
    if few:
        notices.append(TOO_FEW_CYCLES(f"Fewer cycles than planned were measured: {_some(few)}. Their values stand."))
    if more:
        notices.append(
            MORE_CYCLES(
                f"More cycles than planned were measured: {_some(more)}. All of them are in the values; check that "
                "none belongs to another test."
            )
        )
    return notices


OTHER_CUBE: Final = Rule(
    "other-cube",
    "warning",
    "all poses lie as those of a cube more than 1 % larger or smaller, or with its middle more than 5 % of its side "
    "aside: measured for another plan",
    cure="Give the plan.yaml that was measured.",
)


def cube_notices(plan: PerformancePlan, evaluation: Evaluation) -> list[Notice]:
    """Return what is to be known where the poses are those of another cube."""
    other = other_cube(evaluation.clouds, plan.cube.side)
    if other is None:
        return []
    side = 1e3 * plan.cube.side
    return [
        OTHER_CUBE(
            f"The poses of {other.test} lie as those of a cube of {side * other.scale:.1f} mm, where the plan has "
            f"{side:.1f} mm, with its middle {1e3 * other.aside:.1f} mm aside. No robot is off like that: were they "
            "measured for another plan, or is the tie to the base another one?"
        )
    ]


def _some(words: Collection[str]) -> str:
    places = list(words)
    more = f"; and {len(places) - _NAMED_PLACES} more" if len(places) > _NAMED_PLACES else ""
    return "; ".join(places[:_NAMED_PLACES]) + more


COPIED_SAMPLES: Final = Rule(
    "copied-samples",
    "warning",
    "two cycles of a path, or ways to a pose, have ten samples in a row or more at the same places to the last "
    "digit: one is a copy",
    cure="Write what was measured, or remove the copy.",
    gravity=2,
)


def copied_notices(blocks: Sequence[CopiedBlock]) -> list[Notice]:
    """Return what is to be known about samples that two cycles share."""
    if not blocks:
        return []
    described = "; ".join(_copied_words(block) for block in blocks[:_NAMED_ROWS])
    more = f"; and {len(blocks) - _NAMED_ROWS} more" if len(blocks) > _NAMED_ROWS else ""
    return [
        COPIED_SAMPLES(
            f"Cycles have samples at the same places to the last digit: {described}{more}. No robot does that: one was "
            "copied from the other, or the readings are simulated without noise. RT and what else says how cycles "
            "differ is too small."
        )
    ]


def _copied_words(block: CopiedBlock) -> str:
    cycle, other = block.cycles
    cycles = f"cycles {cycle} and {other} of " if cycle and other else ""
    return f"{cycles}{block.test} {block.place}, {block.count} samples from lines {block.lines[0]} and {block.lines[1]}"


def _outlying_words(row: OutlyingRow, without: str) -> str:
    away, scatter = (_size(number, row.kind) for number in (row.away, row.scatter))
    subject = "The orientation of cycle" if row.kind == "orientation" else "Cycle"
    changes = "; ".join(_change_words(*pair, without) for pair in row.changes[:_VALUES])
    return (
        f"{subject} {int(row.of.cycle[0])} of {_under_words(row.of)}, on line {int(row.of.line[0])} lies {away} from "
        f"the others, which scatter by {scatter}{': ' if changes else ''}{changes}."
    )


def _push_words(push: OutlyingPush) -> str:
    unit, per_si = UNITS["compliance"]
    return (
        f"The push of {push.force:g} N along {push.direction} in cycle {push.cycle}, on line {push.line}, lies "
        f"{1e3 * push.away:.3g} mm from the line of the others: compliance is {push.value * per_si:.6f} {unit}, "
        f"without it {push.without * per_si:.6f}."
    )


def _change_words(value: Value, other: Value, without: str) -> str:
    part = "" if value.component == "position" else f" {value.component}"
    left = number_words(other) if other.status != "not-measured" else "nothing"
    return f"{value.id}{part} is {number_words(value)} {UNITS[value.quantity][0]}, without {without} {left}"


def _places_words(places: TwoPlaces) -> str:
    kind = "orientations, " * (places.kind == "orientation")
    lines = ", ".join(map(str, places.lines[:_NAMED_PLACES])) + ", .." * (len(places.lines) > _NAMED_PLACES)
    return (
        f"{_under_words(places.of)} ({kind}{places.rows[0]} and {places.rows[1]} cycles, "
        f"{_size(places.apart, places.kind)} apart; the {places.rows[0]} on lines {lines})"
    )


def _under_words(cycles: Cycles) -> str:
    robot = f" of {cycles.robot}" if cycles.robot else ""
    approach = f" from {cycles.approach}" if cycles.approach else ""
    return f"{cycles.test} {cycles.pose}{approach}{robot}, {100 * cycles.velocity:g} %, load {100 * cycles.load:g} %"


def _size(number: float, kind: Kind) -> str:
    unit, per_si = UNITS["length" if kind == "position" else "angle"]
    return f"{number * per_si:.3g} {unit}"
