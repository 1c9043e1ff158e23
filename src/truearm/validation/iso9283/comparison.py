"""Two results beside each other: which differences are larger than what is not known of them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from truearm.errors import InputError, Words
from truearm.planning.iso9283.criteria import TEST_OF
from truearm.validation.iso9283.comparable import (
    PlanOfResult,
    same_place,
    unlike_bandwidths,
    unlike_plans,
    unlike_rated,
)
from truearm.validation.iso9283.result_file import Entry, ResultFile, read_result

Verdict = Literal["smaller", "larger", "not told apart", "no interval"]


@dataclass(frozen=True)
class Compared:
    """A value and the same of another result, in the units of the files."""

    id: str  #: id, component, where, under, unit: which; under what, as the files have it.
    component: str
    where: str
    under: str
    unit: str
    value: float  #: value, other: this result's, and the other's.
    other: float
    verdict: Verdict  #: Whether this one's is smaller or larger by more than both intervals leave open.

    @property
    def change(self) -> str:
        """From the other result's value to this one's, in words."""
        return f"{self.other:.4f} -> {self.value:.4f} {self.unit}"


@dataclass(frozen=True)
class Course:
    """How far the other result is from its command along a path."""

    #: along, distance: arc length and distance of the barycentre [mm]; NaN where there is none.
    along: tuple[float, ...]
    distance: tuple[float, ...]


#: A criterion, where, and under what, by which curves of two results are found.
Key = tuple[str, str, tuple[tuple[str, float | str], ...]]


def key_of(id_: str, where: str, conditions: Mapping[str, float | str]) -> Key:
    """Return the key of a curve, conditions as files have them."""
    return id_, where, tuple(sorted(conditions.items()))


@dataclass(frozen=True)
class Comparison:
    """A result beside another one."""

    other: str  #: The file of the other one.
    rows: tuple[Compared, ...]  #: All values that both have.
    #: Ids of criteria that were not compared, because the two were tied to the base in different ways.
    left_out: tuple[str, ...] = ()
    #: Ids of criteria of which values were not compared, by why they were planned or read otherwise.
    unlike: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unknown_plan: bool = False  #: Whether the other one does not say what was planned, as those of older versions.
    #: curves, offsets: what is drawn of the other one: deviations along paths, and how far barycentres are from their
    #: commands [mm]. Empty where it was written by an older version, or is tied in another way.
    curves: Mapping[Key, Course] = field(default_factory=dict)
    offsets: Mapping[Key, tuple[float, ...]] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "other": self.other,
            "values": [vars(row) for row in self.rows],
            "left_out": list(self.left_out),
            "unlike": {why: list(ids) for why, ids in self.unlike.items()},
            "unknown_plan": self.unknown_plan,
        }

    def lines(self) -> list[str]:
        """Return what is smaller and what is larger than in the other result."""
        text = [f"Beside {self.other}: {len(self.rows)} values that both have."]
        for verdict in ("smaller", "larger", "not told apart", "no interval"):
            rows = [row for row in self.rows if row.verdict == verdict]
            shown = [row for row in rows if row.component == "position"][:8]
            if rows and verdict in ("smaller", "larger"):
                text.append(f"  {verdict} by more than both intervals leave open: {len(rows)}")
                text += [f"    {row.id} {row.where}, {row.under}: {row.change}" for row in shown]
            elif rows:
                text.append(f"  {verdict}: {len(rows)}")
        return text


#: Criteria whose values depend on how the instrument was tied to the base.
_TIED = ("AP", "AT", "AT-reorientation")


def compared(summary: dict[str, Any], other: Path) -> Comparison:
    """Set a result beside another one.

    The difference of two values is larger than what is not known of it where it exceeds the root sum of squares of the
    two intervals' sides that face each other.

    Args:
        summary: This result, as JSON holds it.
        other: The file of the other one.

    Raises:
        InputError: If the file is no such result, or one of another robot or another tip, or both have no value of the
            same kind.
    """
    second = read_result(other)
    first = ResultFile.model_validate_json(json.dumps(summary))
    if first.robot != second.robot:
        raise InputError(
            "the other result is of another robot", where=str(other), came=second.robot, allowed=first.robot
        )
    if first.plan is not None and second.plan is not None and not same_place(first.plan.tip, second.plan.tip):
        raise InputError(
            "the other result is of another tip",
            where=str(other),
            came=Words(_tip_words(second.plan)),
            allowed=_tip_words(first.plan),
            cure="Compare results of one plan.",
        )
    same_tie = first.alignment.kind == second.alignment.kind
    known = {_key(entry): entry for entry in second.criteria}
    rows: list[Compared] = []
    left: list[str] = []
    unlike: dict[str, dict[str, None]] = {}
    for entry in first.criteria:
        beside = known.get(_key(entry))
        if beside is None or entry.value is None or beside.value is None:
            continue
        if entry.id in _TIED and not same_tie:
            left.append(entry.id)
            continue
        why = _unlike(first, second, entry.id, entry.where, entry.conditions)
        if why is None and entry.id == "FV":
            why = unlike_bandwidths(entry.bandwidth_hz, beside.bandwidth_hz)
        if why is not None:
            unlike.setdefault(why, {})[entry.id] = None
            continue
        under = ", ".join(_shown(name, value) for name, value in entry.conditions.items())
        verdict = _verdict(entry.value, entry.interval_95, beside.value, beside.interval_95)
        rows.append(
            Compared(entry.id, entry.component, entry.where, under, entry.unit, entry.value, beside.value, verdict)
        )
    if not rows:
        raise InputError(
            "the two results have no value of the same kind",
            where=str(other),
            came="; ".join(f"{', '.join(ids)}: {why}" for why, ids in unlike.items()) or None,
            cure="Compare results of one plan." if unlike else "Evaluate the same criteria of both.",
        )
    curves = {
        key_of(one.id, one.where, one.conditions): Course(_numbers(one.along_mm), _numbers(one.distance_mm))
        for one in second.curves
        if _unlike(first, second, one.id, one.where, one.conditions) is None
    }
    offsets = {
        key_of(one.id, one.where, one.conditions): _numbers(one.offset_mm)
        for one in second.offsets
        if _unlike(first, second, one.id, one.where, one.conditions) is None
    }
    drawn = (curves, offsets) if same_tie else ({}, {})
    told = {why: tuple(ids) for why, ids in unlike.items()}
    called = f"{other} (simulated)" if second.simulated and not first.simulated else str(other)
    return Comparison(called, tuple(rows), tuple(dict.fromkeys(left)), told, second.plan is None, *drawn)


def _unlike(
    first: ResultFile, second: ResultFile, id_: str, where: str, conditions: Mapping[str, float | str]
) -> str | None:
    """Return why a value of the two was planned otherwise, None if it was not, or that is not told."""
    if id_ not in TEST_OF:
        return None
    why = None
    if first.rated is not None and second.rated is not None:
        why = unlike_rated(id_, conditions, first.rated, second.rated)
    if why is None and first.plan is not None and second.plan is not None:
        why = unlike_plans(id_, where, first.plan, second.plan)
    return why


def _tip_words(plan: PlanOfResult) -> str:
    place = ", ".join(f"{value:.6g}" for value in plan.tip.points_mm[0]) if plan.tip.points_mm else "nothing"
    return f"{place} mm in the flange frame"


def _numbers(lengths: Sequence[float | None]) -> tuple[float, ...]:
    return tuple(math.nan if length is None else length for length in lengths)


def _shown(name: str, value: float | str) -> str:
    """Return a condition in words."""
    if isinstance(value, str):
        return value
    return f"{'load ' * (name == 'load_percent')}{value:g} %"


def _key(entry: Entry) -> tuple[object, ...]:
    return entry.id, entry.component, entry.where, entry.unit, tuple(sorted(entry.conditions.items()))


def _verdict(
    value: float, interval: Sequence[float] | None, other: float, other_interval: Sequence[float] | None
) -> Verdict:
    if interval is None or other_interval is None:
        return "no interval"
    if value < other:
        open_ = math.hypot(max(interval[1] - value, 0.0), max(other - other_interval[0], 0.0))
        return "smaller" if other - value > open_ else "not told apart"
    open_ = math.hypot(max(value - interval[0], 0.0), max(other_interval[1] - other, 0.0))
    return "larger" if value - other > open_ else "not told apart"
