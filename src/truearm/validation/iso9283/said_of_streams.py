"""What is to be said of samples over time, and of the figures that come from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.shown import listed
from truearm.validation.iso9283.evaluation import Evaluation
from truearm.validation.iso9283.paths import wild_cycle
from truearm.validation.iso9283.runs import Run
from truearm.validation.iso9283.synchronise import pace_along
from truearm.validation.iso9283.unusual_samples import unusual_samples

#: So many samples are named.
_NAMED = 5
#: A path that is run at less than this share of the commanded velocity is said: on circles and weaves the robot slows
#: down by itself.
_SLOW = {"polyline": 0.5, "circle": 0.1, "weave": 0.1}
#: Samples of a cycle on the way, its ends left aside, among which a corner is not taken for a wild sample.
_LEAST_MOVING, _END = 90, 0.02
#: Samples are missing where two are further apart than this share of the path, and than so many usual steps.
_GAP, _GAP_STEPS = 0.06, 6.0
#: A corner that lies as far beside as this share of CR is said.
_ASIDE = 0.5


@dataclass(frozen=True, eq=False)
class _Record:
    """Cycles of one place that are compared with each other: lines, times, positions, where in the cycle, rounding."""

    name: str
    numbers: tuple[int, ...]
    lines: tuple[NDArray[np.intp], ...]
    times: tuple[Array, ...]
    positions: tuple[Array, ...]
    places: tuple[Array, ...]
    rounding: float


def said_of_streams(found: Evaluation) -> tuple[Notice, ...]:
    """Return what is to be said of paths and settling."""
    runs = _runs(found)
    notices = (
        _unusual(_records(found, runs)),
        _wild(found),
        _gaps(runs),
        _slow(runs),
        _sparse(found),
        _bandwidth(found),
        _aside(found),
    )
    return tuple(notice for notice in notices if notice is not None)


def _runs(found: Evaluation) -> list[Run]:
    runs = [curve.run for curve in found.deviations] + [curve.run for curve in found.corners]
    runs += [curve.run for curve in found.velocities] + [curve.run for curve in found.weaves]
    return list({id(run): run for run in runs}.values())


def _records(found: Evaluation, runs: Sequence[Run]) -> list[_Record]:
    of_paths, of_settling = (
        found.readings[name].rounding if name in found.readings else 0.0 for name in ("paths", "settling")
    )
    records = []
    for run in runs:
        cycles = run.cycles
        if _angular(run) and min(_moving(cycle.along, run.path.length) for cycle in cycles) < _LEAST_MOVING:
            continue
        numbers, lines = tuple(c.number for c in cycles), tuple(c.lines for c in cycles)
        times, positions = tuple(c.time for c in cycles), tuple(c.position for c in cycles)
        places = tuple(c.along for c in cycles)
        records.append(_Record(_called(run), numbers, lines, times, positions, places, of_paths))
    settling: dict[tuple[object, ...], list[int]] = {}
    for row, curve in enumerate(found.settling):
        settling.setdefault((curve.test, curve.where, curve.conditions), []).append(row)
    for rows in settling.values():
        curves = [found.settling[row] for row in rows]
        # half of the way is passed at one time in each cycle: the clocks are set by it
        half = [float(c.time[int((c.distance < 0.5 * c.distance[0]).argmax())]) for c in curves]
        records.append(
            _Record(
                f"{curves[0].test} at {curves[0].where}",
                tuple(c.cycle for c in curves),
                tuple(c.lines for c in curves),
                tuple(c.time for c in curves),
                tuple(c.position for c in curves),
                tuple(c.time - begin for c, begin in zip(curves, half, strict=True)),
                of_settling,
            )
        )
    return records


def _angular(run: Run) -> bool:
    return run.path.path.kind == "weave" or len(run.path.vertices) > 2


def _moving(along: Array, length: float) -> int:
    """Return how many samples a cycle has between its ends."""
    return int(((along > _END * length) & (along < (1 - _END) * length)).sum())


def _unusual(records: Sequence[_Record]) -> Notice | None:
    named = []
    for record in records:
        for one in unusual_samples(record.times, record.positions, record.places, record.rounding):
            line = int(record.lines[one.cycle][one.sample])
            text = f"line {line} (cycle {record.numbers[one.cycle]} of {record.name}, {1e3 * one.distance:.2g} mm)"
            named.append((one.distance, text))
    if not named:
        return None
    return Notice(
        "unusual-samples",
        f"Samples lie apart from those about them, as in no other cycle there: {_worst(named)}. If it was the "
        "instrument, remove these lines: samples may be missing. If it was the robot, they belong into the figures.",
    )


def _worst(named: Sequence[tuple[float, str]]) -> str:
    """Return the texts with the largest numbers, and how many more there are."""
    shown = [text for _, text in sorted(named, key=lambda both: -both[0])[:_NAMED]]
    return ", ".join([*shown, f"and {len(named) - _NAMED} more"] if len(named) > _NAMED else shown)


def _called(run: Run) -> str:
    return f"{run.test} on {run.path.path.name}"


def _slow(runs: Sequence[Run]) -> Notice | None:
    told = []
    for run in runs:
        pace = float(np.median([pace_along(run.path, cycle.time, cycle.along) for cycle in run.cycles]))
        if pace < _SLOW[run.path.path.kind] * run.velocity:
            told.append(f"{_called(run)} at {1e3 * pace:.4g} of {1e3 * run.velocity:.4g} mm/s")
    if not told:
        return None
    more = f", and {len(told) - _NAMED} more" if len(told) > _NAMED else ""
    return Notice(
        "slow-path",
        f"Paths were run much slower than commanded: {', '.join(told[:_NAMED])}{more}. If the robot cannot, that "
        "is what AV says; otherwise check velocity [%] and the rated velocity of the plan.",
    )


def _sparse(found: Evaluation) -> Notice | None:
    told: dict[str, None] = {}
    for path in found.deviations:
        if path.sparse:
            told |= dict.fromkeys((path.run.test, path.run.test.replace("AT", "RT", 1)))
    for corner in found.corners:
        told |= dict.fromkeys(id_ for id_, far in zip(("CR", "CO"), corner.sparse, strict=True) if far)
    for curve in found.settling:
        ids = ("t", "OV") if curve.test == "t" else ("posing-time",)
        told |= dict.fromkeys(id_ for id_, far in zip(ids, curve.sparse, strict=False) if far)
    if not told:
        return None
    return Notice(
        "sampled-too-slowly",
        f"Samples are too far apart for some values of {listed(tuple(told))}: what lies between two of them is not "
        "seen. Those values are marked; sample faster.",
    )


def _wild(found: Evaluation) -> Notice | None:
    named = []
    for path in found.deviations:
        wild = wild_cycle(path)
        if wild is None:
            continue
        cycle, far, accuracy, repeatability = wild
        now = f"RT is {1e3 * float(path.spread.max()):.4f} mm, without it {1e3 * repeatability:.4f}"
        now += f"; AT is {1e3 * float(path.distance.max()):.4f} mm, without it {1e3 * accuracy:.4f}"
        number = path.run.cycles[cycle].number
        named.append((far, f"cycle {number} of {_called(path.run)} by {1e3 * far:.4f} mm ({now})"))
    if not named:
        return None
    return Notice(
        "wild-cycle",
        f"Cycles lie apart from the others of their path as a whole: {_worst(named)}. The standard excludes no cycle, "
        "and none was left out. Look at the record, and measure the cycle again if the instrument or its mount moved.",
    )


def _gaps(runs: Sequence[Run]) -> Notice | None:
    """Return where samples are missing over more than a part of a path."""
    named = []
    for run in runs:
        length = run.path.length
        for cycle in run.cycles:
            gap = np.diff(np.clip(cycle.along, 0.0, length))
            moving = gap[gap > 0.1 * length / len(gap)]
            usual = float(np.median(moving)) if len(moving) else 0.0
            worst = int(gap.argmax())
            if gap[worst] > max(_GAP * length, _GAP_STEPS * usual):
                lines = f"lines {cycle.lines[worst]} and {cycle.lines[worst + 1]}"
                text = f"{1e3 * gap[worst]:.3g} mm between {lines} (cycle {cycle.number} of {_called(run)})"
                named.append((float(gap[worst]), text))
    if not named:
        return None
    return Notice(
        "gap-in-path",
        f"Samples are missing on a part of the way: {_worst(named)}. Values there come from straight lines between the "
        "samples before and behind. Measure these cycles again, or leave them out.",
    )


def _bandwidth(found: Evaluation) -> Notice | None:
    bandwidths = [curve.bandwidth for curve in found.velocities]
    if not bandwidths:
        return None
    low, high = min(bandwidths), max(bandwidths)
    upto = f"{high:.2g} Hz" if high < 1.1 * low else f"{low:.2g} to {high:.2g} Hz"
    return Notice(
        "velocity-bandwidth",
        f"FV and its interval tell what fluctuates with up to {upto}: faster fluctuation is smoothed away together "
        "with the instrument's noise. Compare robots at the same bandwidth.",
        "note",
    )


def _aside(found: Evaluation) -> Notice | None:
    there = [corner for corner in found.corners if corner.offset > _ASIDE * float(corner.rounding.mean())]
    if not there:
        return None
    worst = max(there, key=lambda corner: corner.offset)
    return Notice(
        "corner-offset",
        f"At {len(there)} of {len(found.corners)} corners the path as a whole lies beside its command by more than "
        f"half of CR, which CR and CO contain. At {worst.where} it lies {1e3 * worst.offset:.3f} mm beside, and CR of "
        f"{1e3 * float(worst.rounding.mean()):.3f} mm would be {1e3 * float(worst.own.mean()):.3f} mm from its own "
        "corner.",
        "note",
    )
