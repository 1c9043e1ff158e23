"""What is said about the rows of a test by ISO 9283: wild rows, poses with two places of rest, places without a row."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

from truearm.notices import Notice
from truearm.planning.iso9283.criteria import TEST_OF
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.results.iso9283_table import UNITS, number_words
from truearm.shown import counted
from truearm.validation.iso9283.copied import CopiedBlock
from truearm.validation.iso9283.evaluation import Evaluation
from truearm.validation.iso9283.other_cube import other_cube
from truearm.validation.iso9283.pose_rows import Cycles
from truearm.validation.iso9283.values import Value
from truearm.validation.iso9283.wild_pushes import WildPush
from truearm.validation.iso9283.wild_rows import Kind, TwoPlaces, WildRow

#: So many rows, poses and places are told one by one.
_TOLD: Final = 3
_TOLD_PLACES: Final = 8
#: So many values are told with and without a row.
_VALUES: Final = 2
#: Criteria of which each cycle of a place counts once.
_EACH_CYCLE: Final = ("AP", "AD", "AT", "AT-reorientation", "CR", "AV", "WS", "t", "posing-time")
#: Mean orientations further off than this are told [rad].
_FAR_TURNED: Final = math.radians(2.0)


def row_notices(found: Evaluation) -> tuple[Notice, ...]:
    """Return what is to be known about the rows of an evaluation."""
    notices = []
    wild, places = found.unusual.wild, found.unusual.two_places
    if wild:
        told = " ".join(_wild_words(row, "it" if len(wild) == 1 else "them") for row in wild[:_TOLD])
        if len(wild) > _TOLD:
            told += f" So do {counted(len(wild) - _TOLD, 'other row')}, on line "
            told += f"{', '.join(str(int(row.of.line[0])) for row in wild[_TOLD:])}."
        notices.append(
            Notice(
                "wild-row",
                f"{told} The standard excludes no row, and none was left out. Look at the record, and measure the "
                "pose again if the reading was at fault.",
            )
        )
    if found.wild_pushes:
        told = " ".join(_push_words(one) for one in found.wild_pushes)
        notices.append(
            Notice(
                "wild-push",
                f"{told} The standard excludes no reading, and none was left out. Look at the record, and push again "
                "if the reading was at fault.",
            )
        )
    if places:
        told = "; ".join(_places_words(one) for one in places[:_TOLD])
        more = f"; and {len(places) - _TOLD} more" if len(places) > _TOLD else ""
        notices.append(
            Notice(
                "two-places",
                f"The tip comes to rest in two places: {told}{more}. The values stand, but the intervals of RP and RD "
                "may not hold. Look for play, or for something that changed during the test.",
            )
        )
    if found.unusual.alike:
        told = "; ".join(
            f"{one.test}, {100 * one.velocity:g} %, load {100 * one.load:g} % (correlation {one.correlation:.2f}, of "
            f"independent cycles up to {2 * one.usual:.2f})"
            for one in found.unusual.alike[:_TOLD_PLACES]
        )
        notices.append(
            Notice(
                "cycles-alike",
                f"Each cycle is like the one before it: {told}. Intervals assume that cycles are independent, and are "
                "too narrow here. Let the robot warm up longer, and see whether robot or instrument creeps.",
            )
        )
    turned = [v for v in found.values if v.id == "AP" and v.quantity == "angle" and abs(v.value) > _FAR_TURNED]
    if turned:
        worst = max(turned, key=lambda value: abs(value.value))
        notices.append(
            Notice(
                "orientation-far-off",
                f"Orientations are off by up to {number_words(worst)} deg (AP {worst.component} of {worst.where}). "
                "Robots are seldom off by a degree: check that they are those of the plan's tip, and the rotation of "
                "the alignment.",
            )
        )
    if found.missing:
        told = "; ".join(found.missing[:_TOLD_PLACES])
        more = f"; and {len(found.missing) - _TOLD_PLACES} more" if len(found.missing) > _TOLD_PLACES else ""
        notices.append(
            Notice(
                "places-missing",
                f"Planned and without a row: {told}{more}. The worst of the others is not what the standard asks for. "
                "Measure them, or plan the test without them.",
            )
        )
    return tuple(notices)


def cycle_notices(plan: PerformancePlan, found: Evaluation) -> list[Notice]:
    """Return what is to be known about cycles that are fewer or more than planned."""
    few, more = dict[str, None](), dict[str, None]()
    for value in found.values:
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
        notices.append(
            Notice("too-few-cycles", f"Fewer cycles than planned were measured: {_some(few)}. Their values stand.")
        )
    if more:
        notices.append(
            Notice(
                "more-cycles",
                f"More cycles than planned were measured: {_some(more)}. All of them are in the values; check that "
                "none belongs to another test.",
                "note",
            )
        )
    return notices


def cube_notices(plan: PerformancePlan, found: Evaluation) -> list[Notice]:
    """Return what is to be known where the poses are those of another cube."""
    other = other_cube(found.clouds, plan.cube.side)
    if other is None:
        return []
    side = 1e3 * plan.cube.side
    return [
        Notice(
            "other-cube",
            f"The poses of {other.test} lie as those of a cube of {side * other.scale:.1f} mm, where the plan has "
            f"{side:.1f} mm, with its middle {1e3 * other.aside:.1f} mm aside. No robot is off like that: were they "
            "measured for another plan, or is the tie to the base another one? Give the plan.yaml that was measured.",
        )
    ]


def _some(words: Collection[str]) -> str:
    told = list(words)
    more = f"; and {len(told) - _TOLD_PLACES} more" if len(told) > _TOLD_PLACES else ""
    return "; ".join(told[:_TOLD_PLACES]) + more


def copied_notices(blocks: Sequence[CopiedBlock]) -> list[Notice]:
    """Return what is to be known about samples that two cycles share."""
    if not blocks:
        return []
    told = "; ".join(_copied_words(block) for block in blocks[:_TOLD])
    more = f"; and {len(blocks) - _TOLD} more" if len(blocks) > _TOLD else ""
    return [
        Notice(
            "copied-samples",
            f"Cycles have samples at the same places to the last digit: {told}{more}. No robot does that: one was "
            "copied from the other, or the readings are simulated without noise. RT and what else says how cycles "
            "differ is too small. Write what was measured, or remove the copy.",
        )
    ]


def _copied_words(block: CopiedBlock) -> str:
    one, other = block.cycles
    cycles = f"cycles {one} and {other} of " if one and other else ""
    return f"{cycles}{block.test} {block.place}, {block.count} samples from lines {block.lines[0]} and {block.lines[1]}"


def _wild_words(row: WildRow, without: str) -> str:
    away, scatter = (_size(number, row.kind) for number in (row.away, row.scatter))
    what = "The orientation of cycle" if row.kind == "orientation" else "Cycle"
    changes = "; ".join(_change_words(*pair, without) for pair in row.changes[:_VALUES])
    return (
        f"{what} {int(row.of.cycle[0])} of {_under_words(row.of)}, on line {int(row.of.line[0])} lies {away} from the "
        f"others, which scatter by {scatter}{': ' if changes else ''}{changes}."
    )


def _push_words(one: WildPush) -> str:
    unit, per_si = UNITS["compliance"]
    return (
        f"The push of {one.force:g} N along {one.direction} in cycle {one.cycle}, on line {one.line}, lies "
        f"{1e3 * one.away:.3g} mm from the line of the others: compliance is {one.value * per_si:.6f} {unit}, "
        f"without it {one.without * per_si:.6f}."
    )


def _change_words(value: Value, other: Value, without: str) -> str:
    part = "" if value.component == "position" else f" {value.component}"
    left = number_words(other) if other.status != "not-measured" else "nothing"
    return f"{value.id}{part} is {number_words(value)} {UNITS[value.quantity][0]}, without {without} {left}"


def _places_words(one: TwoPlaces) -> str:
    what = "orientations, " * (one.kind == "orientation")
    lines = ", ".join(map(str, one.lines[:_TOLD_PLACES])) + ", .." * (len(one.lines) > _TOLD_PLACES)
    return (
        f"{_under_words(one.of)} ({what}{one.rows[0]} and {one.rows[1]} cycles, {_size(one.apart, one.kind)} apart; "
        f"the {one.rows[0]} on lines {lines})"
    )


def _under_words(one: Cycles) -> str:
    robot = f" of {one.robot}" if one.robot else ""
    approach = f" from {one.approach}" if one.approach else ""
    return f"{one.test} {one.pose}{approach}{robot}, {100 * one.velocity:g} %, load {100 * one.load:g} %"


def _size(number: float, kind: Kind) -> str:
    unit, per_si = UNITS["length" if kind == "position" else "angle"]
    return f"{number * per_si:.3g} {unit}"
