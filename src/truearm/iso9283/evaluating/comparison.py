"""Two results beside each other: which differences are larger than what is not known of them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from truearm.engine.base.errors import InputError, Words, shortened
from truearm.engine.base.files import read_text
from truearm.engine.document.document import Block, detail, say
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.rows import Component, Status
from truearm.iso9283.planning.criteria import TEST_OF, TESTS, PerformancePlan

#: Places are the same within this length [mm], and turns within this entry of their matrices.
_SAME_LENGTH: Final = 1e-2
_SAME_TURN: Final = 1e-4
#: Rated values, limit bands and times are the same within this share; bandwidths of FV within this factor.
_SAME_SHARE: Final = 1e-3
_SAME_BANDWIDTH: Final = 1.25

_Finite = Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
_Row = tuple[_Finite, _Finite, _Finite]


class Place(BaseModel):
    """A pose or a path: its points [mm], and three columns for each orientation."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    points_mm: tuple[_Row, ...]
    turns: tuple[_Row, ...]


class PlanOfResult(BaseModel):
    """What a result says of its plan."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    tip: Place
    limit_band_mm: _Finite
    drift_h: _Finite
    places: dict[str, Place]


class Rated(BaseModel):
    """What 100 % stands for in a result."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    load_kg: _Finite
    velocity_mm_s: _Finite


def plan_summary(plan: PerformancePlan) -> dict[str, Any]:
    """Return what another result has to know of a plan, as JSON holds it."""
    tip = plan.robot.tool_place(plan.target)
    poses = {**plan.poses, **{f"{pose} from {approach}": start for (pose, approach), start in plan.starts.items()}}
    return {
        "tip": _place([np.array(tip.translation)], [tip.rotation]),
        "limit_band_mm": plan.limit_band * 1e3,
        "drift_h": plan.hours,
        "places": {
            **{name: _place([pose.position], [pose.rotation]) for name, pose in poses.items()},
            **{
                name: _place(
                    [*path.points, [path.stroke, path.wavelength, 0.0]],
                    [path.rotation, *([] if path.other is None else [path.other]), path.normal],
                )
                for name, path in plan.paths.items()
            },
        },
    }


def _place(points: Any, turns: list[Array]) -> dict[str, Any]:
    return {
        "points_mm": [[round(1e3 * float(value), 6) for value in point] for point in points],
        "turns": [[round(float(value), 9) for value in row] for turn in turns for row in np.reshape(turn, (-1, 3))],
    }


def same_place(place: Place, other: Place) -> bool:
    """Return whether two results have a place alike."""
    return _same(place.points_mm, other.points_mm, _SAME_LENGTH) and _same(place.turns, other.turns, _SAME_TURN)


def _same(rows: tuple[_Row, ...], other_rows: tuple[_Row, ...], within: float) -> bool:
    return len(rows) == len(other_rows) and bool(np.allclose(rows, other_rows, rtol=0.0, atol=within))


def unlike_rated(id_: str, conditions: Mapping[str, float | str], rated: Rated, other: Rated) -> str | None:
    """Return why values of a criterion were measured under other rated conditions, None if they were not."""
    loaded = conditions.get("load_percent", 100.0 if id_ == "compliance" else 0.0)
    if loaded != 0.0 and not _near(rated.load_kg, other.load_kg):
        return f"the rated load was {other.load_kg:g} kg there, and is {rated.load_kg:g} kg here"
    if TESTS[TEST_OF[id_]].readings == "paths" and not _near(rated.velocity_mm_s, other.velocity_mm_s):
        return f"the rated velocity was {other.velocity_mm_s:g} mm/s there, and is {rated.velocity_mm_s:g} mm/s here"
    return None


def unlike_plans(id_: str, location: str, plan: PlanOfResult, other: PlanOfResult) -> str | None:
    """Return why values of a criterion were planned otherwise, None if they were not."""
    test = TEST_OF[id_]
    if test in ("t", "posing-time") and not _near(plan.limit_band_mm, other.limit_band_mm):
        return f"the limit band was {other.limit_band_mm:g} mm there, and is {plan.limit_band_mm:g} mm here"
    if test == "dAP" and not _near(plan.drift_h, other.drift_h):
        return f"drift was planned over {other.drift_h:g} h there, and over {plan.drift_h:g} h here"
    for name in sorted({*plan.places, *other.places}):
        if _is_of(name, test, location):
            place, other_place = plan.places.get(name), other.places.get(name)
            if place is None or other_place is None or not same_place(place, other_place):
                return "poses or paths were planned elsewhere"
    return None


def unlike_bandwidths(bandwidth: float | None, other: float | None) -> str | None:
    """Return why values of FV were read otherwise, None if they were not."""
    if bandwidth is None or other is None or max(bandwidth, other) <= _SAME_BANDWIDTH * min(bandwidth, other):
        return None
    return f"fluctuation was read up to {other:.3g} Hz there, and up to {bandwidth:.3g} Hz here"


def _near(value: float, other: float) -> bool:
    return abs(value - other) <= _SAME_SHARE * max(abs(value), abs(other))


def _is_of(name: str, test: str, place: str) -> bool:
    """Return whether a value has to do with a place: ``P1-D10`` with P1 and D10, ``rectangle E2`` with it."""
    if test == "compliance":
        return name in TESTS[test].places
    if place == name or place.startswith((f"{name} ", f"{name}-")) or place.endswith(f"-{name}"):
        return True
    return test == "vAP" and name.startswith(f"{place} from ")


_LENIENT = ConfigDict(extra="ignore", frozen=True)
_Number = Annotated[float, Field(allow_inf_nan=False)]
_Length = _Number | None


class Entry(BaseModel):
    """A value of a criterion in its unit, with the conditions as files have them."""

    model_config = _LENIENT
    id: str
    component: Component
    where: str
    value: _Number | None
    unit: Literal["mm", "deg", "s", "%", "mm/s", "mm/N"]
    interval_95: tuple[float, float] | None
    cycles: int = 0
    conditions: dict[str, float | str]
    status: Status
    range: tuple[_Length, _Length] | None = None
    bandwidth_hz: Annotated[float, Field(allow_inf_nan=False, gt=0)] | None = None


class _Tie(BaseModel):
    model_config = _LENIENT
    kind: str


class InstrumentOfResult(BaseModel):
    """What was said of the instrument."""

    model_config = _LENIENT
    sigma_mm: _Number
    sigma_rot_deg: _Length


class ReadFile(BaseModel):
    """A file that an evaluation has read: as it was named, and its SHA-256."""

    model_config = _LENIENT
    file: str
    sha256: str


class Curve(BaseModel):
    """How far the barycentre of a path is from its command, by the arc length [mm]."""

    model_config = _LENIENT
    id: str
    where: str
    conditions: dict[str, float | str]
    along_mm: tuple[_Length, ...]
    distance_mm: tuple[_Length, ...]


class Offset(BaseModel):
    """From the command of a pose to the barycentre of what was attained, in the base frame [mm]."""

    model_config = _LENIENT
    id: str
    where: str
    conditions: dict[str, float | str]
    offset_mm: tuple[_Length, _Length, _Length]


class ToldNotice(BaseModel):
    """What was to know about the result."""

    model_config = _LENIENT
    code: str
    message: str
    level: Literal["note", "warning", "error"] = "warning"


class ResultFile(BaseModel):
    """Schema ``truearm-iso9283-result/1``; what older versions did not write is empty."""

    model_config = _LENIENT
    truearm: Literal["truearm-iso9283-result/1"]
    simulated: bool = False
    robot: str
    alignment: _Tie
    instrument: InstrumentOfResult | None = None
    inputs: dict[str, ReadFile] | None = None
    rated: Rated | None = None
    plan: PlanOfResult | None = None
    criteria: tuple[Entry, ...]
    curves: tuple[Curve, ...] = ()
    offsets: tuple[Offset, ...] = ()
    warnings: tuple[ToldNotice, ...] = ()


def read_result(path: Path) -> ResultFile:
    """Read the result of an evaluation.

    Raises:
        InputError: If the file is none.
    """
    text = read_text(path)
    try:
        return ResultFile.model_validate_json(text)
    except ValidationError as error:
        raise _no_result(path, error.errors()[0]) from error


def _no_result(path: Path, fault: Any) -> InputError:
    """Return the refusal of a file that is no result, in words of a person who gave another file."""
    entry = ".".join(map(str, fault["loc"]))
    if fault["type"] == "json_invalid":
        content = "a text that is not JSON"
    elif entry in ("", "truearm"):
        kind = fault["input"] if entry and isinstance(fault["input"], str) else None
        content = "JSON of something else" if kind is None else f"a file of the kind {shortened(kind, 60)}"
    else:
        content = f"a result {'without' if fault['type'] == 'missing' else 'with another kind of'} {entry}"
    return InputError(
        "this is no result of tests by ISO 9283",
        where=str(path),
        came=Words(content),
        allowed="the file iso9283.json that an evaluation has written",
        cure="Evaluate the other tests first, and give the iso9283.json of that folder.",
    )


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


def key_of(id_: str, place: str, conditions: Mapping[str, float | str]) -> Key:
    """Return the key of a curve, conditions as files have them."""
    return id_, place, tuple(sorted(conditions.items()))


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

    def blocks(self) -> Iterator[Block]:
        """Give what is smaller and what is larger than in the other result."""
        yield say(
            f"Beside {self.other}: {len(self.rows)} values that both have.",
            other=self.other,
            values=[vars(row) for row in self.rows],
            left_out=list(self.left_out),
            unlike={why: list(ids) for why, ids in self.unlike.items()},
            unknown_plan=self.unknown_plan,
        )
        for verdict in get_args(Verdict):
            rows = [row for row in self.rows if row.verdict == verdict]
            significant = verdict in ("smaller", "larger")
            if rows:
                yield say(f"  {verdict}{' by more than both intervals leave open' * significant}: {len(rows)}")
            if significant:
                shown = [row for row in rows if row.component == "position"] or rows
                yield detail(*(f"    {row.id} {row.where}, {row.under}: {row.change}" for row in shown))


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
        key_of(curve.id, curve.where, curve.conditions): Course(_numbers(curve.along_mm), _numbers(curve.distance_mm))
        for curve in second.curves
        if _unlike(first, second, curve.id, curve.where, curve.conditions) is None
    }
    offsets = {
        key_of(offset.id, offset.where, offset.conditions): _numbers(offset.offset_mm)
        for offset in second.offsets
        if _unlike(first, second, offset.id, offset.where, offset.conditions) is None
    }
    drawn = (curves, offsets) if same_tie else ({}, {})
    reasons = {why: tuple(ids) for why, ids in unlike.items()}
    called = f"{other} (simulated)" if second.simulated and not first.simulated else str(other)
    return Comparison(called, tuple(rows), tuple(dict.fromkeys(left)), reasons, second.plan is None, *drawn)


def _unlike(
    first: ResultFile, second: ResultFile, id_: str, place: str, conditions: Mapping[str, float | str]
) -> str | None:
    """Return why a value of the two was planned otherwise, None if it was not, or that is not told."""
    if id_ not in TEST_OF:
        return None
    why = None
    if first.rated is not None and second.rated is not None:
        why = unlike_rated(id_, conditions, first.rated, second.rated)
    if why is None and first.plan is not None and second.plan is not None:
        why = unlike_plans(id_, place, first.plan, second.plan)
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
