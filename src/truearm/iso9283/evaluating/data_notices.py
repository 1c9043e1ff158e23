"""What is to be said of drift, pushes, rounding and samples over time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, listed
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.compliance import GRAVITY, PushLine
from truearm.iso9283.criteria.drift import DriftCourse
from truearm.iso9283.criteria.paths import outlying_cycle
from truearm.iso9283.criteria.rows import Instrument
from truearm.iso9283.criteria.runs import Run
from truearm.iso9283.criteria.streams import Clock, pace_along
from truearm.iso9283.evaluating.doubts import unusual_samples
from truearm.iso9283.evaluating.evaluation import Evaluation
from truearm.iso9283.planning.criteria import PerformancePlan

#: From the first group to the last drift is watched for at least and at most this share of the planned time.
_SHORTEST: Final = 0.9
_LONGEST: Final = 1.25
#: Times in other units, by how many seconds they have.
_UNITS: Final = {"minutes": 60.0, "hours": 3600.0, "milliseconds": 1e-3}


SINGLE_DRIFT_GROUP: Final = Rule(
    "single-drift-group", "warning", "all cycles of drift are one group, so that there is no change to be told"
)
DRIFT_TIME: Final = Rule(
    "drift-time",
    "warning",
    "drift was watched over another time than planned, or without times; the hours and groups are said",
)


def drift_notices(plan: PerformancePlan, courses: Sequence[DriftCourse]) -> tuple[Notice, ...]:
    """Return what is to be said of courses that are one group alone, or do not last as long as planned."""
    planned = 3600.0 * plan.hours
    single, other, timeless = [], [], False
    for course in courses:
        of = f" of {course.robot}" if course.robot else ""
        name = f"{course.pose}{of}, {100 * course.velocity:g} %, load {100 * course.load:g} %"
        if len(course.cycles) < 2:
            single.append(f"{name} ({course.cycles[0]} cycles)")
        elif not np.isfinite(course.time).all():
            timeless = True
        else:
            lasts = float(course.time[-1] - course.time[0])
            if not _fits(lasts, planned):
                units = [unit for unit, seconds in _UNITS.items() if _fits(lasts * seconds, planned)]
                asked = f" (are the times in {units[0]}?)" if units else ""
                other.append(f"{name}: {len(course.cycles)} groups over {lasts / 3600.0:.3g} h{asked}")
    notices = []
    if single:
        notices.append(
            SINGLE_DRIFT_GROUP(
                f"All cycles of drift are one group at {'; '.join(single)}: there is no change to be told. A group "
                "begins where the numbers of the cycles begin anew, or after a pause."
            )
        )
    if other or timeless:
        durations = "; ".join(other) or "the rows of dAP have no times"
        notices.append(
            DRIFT_TIME(
                f"Drift is planned over {plan.hours:g} h; measured: {durations}. dAP and dRP tell the change over the "
                "time that was measured, and are not those of the plan."
            )
        )
    return tuple(notices)


def _fits(lasts: float, planned: float) -> bool:
    return _SHORTEST * planned <= lasts <= _LONGEST * planned


#: The largest force of a direction is low below this share of the rated load's weight.
_LOW: Final = 0.85
#: Forces are kilograms if the largest is the rated load within this share.
_ROUNDED: Final = 0.06
#: A slope is more than noise above so many standard errors.
_ABOVE_NOISE: Final = 6.0


def push_notices(plan: PerformancePlan, pushes: Sequence[PushLine], instrument: Instrument) -> tuple[Notice, ...]:
    """Return what is to be said of pushes: forces far below the rated ones, and directions that cannot be right."""
    notices = (_low(plan, pushes), _sideways(pushes, instrument))
    return tuple(notice for notice in notices if notice is not None)


LOW_FORCES: Final = Rule(
    "low-forces",
    "warning",
    "the largest forces are well below the weight of the rated load. Push further, or check the unit",
)


def _low(plan: PerformancePlan, pushes: Sequence[PushLine]) -> Notice | None:
    test = plan.test("compliance")
    if test is None or not plan.rated_load > 0:
        return None
    most = GRAVITY * plan.rated_load * max(test.loads)
    largest: dict[str, float] = {}
    for push in pushes:
        largest[push.direction] = max(largest.get(push.direction, 0.0), float(push.force.max()))
    low = [direction for direction, force in largest.items() if force < _LOW * most]
    if not low:
        return None
    kilograms = all(abs(largest[name] * GRAVITY / most - 1.0) < _ROUNDED for name in low)
    asked = (
        f" Their largest number is that of the load in kg: are these kg? Then compliance is {GRAVITY:.2f} times too "
        "large; multiply them by that."
        if kilograms
        else " Push up to the rated load, or check the unit."
    )
    forces = ", ".join(f"{name} {largest[name]:.4g} N" for name in low)
    return LOW_FORCES(f"The largest forces are well below the weight of the rated load, {most:.4g} N: {forces}.{asked}")


SIDEWAYS_PUSH: Final = Rule(
    "sideways-push",
    "warning",
    "the tip moves more at right angles to the force than along it",
    cure="Check that the directions are axes of the robot's base, not of the instrument, and that none are exchanged.",
)


def _sideways(pushes: Sequence[PushLine], instrument: Instrument) -> Notice | None:
    """Return directions along which the tip moves less than at right angles, where no arm can do so.

    An arm at rest gives way by a symmetric matrix without negative eigenvalues, and may well move more at right angles
    to a force than along it. Forces under the names of other axes change columns of that matrix: then it has a negative
    one. Where not all axes were pushed along, the matrix is not known.
    """
    names = tuple(dict.fromkeys(push.direction for push in pushes))
    error = {name: _standard_error(pushes, name, instrument) for name in names}
    slope = {name: np.mean([push.slopes for push in pushes if push.direction == name], axis=0) for name in names}
    by_axis = {
        axis: [(1.0 if name[0] == "+" else -1.0) * slope[name] for name in names if name[1] == axis] for axis in "xyz"
    }
    if all(by_axis.values()):
        matrix = np.stack([np.mean(by_axis[axis], axis=0) for axis in "xyz"], axis=1)
        least = float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
        if least > -_ABOVE_NOISE * max(error.values()):
            return None
    directions = []
    for name in names:
        k = "xyz".index(name[1])
        along, across = float(abs(slope[name][k])), np.delete(slope[name], k)
        sideways = float(np.linalg.norm(across))
        if sideways - along > _ABOVE_NOISE * error[name]:
            most = [axis for axis in "xyz" if axis != name[1]][int(np.abs(across).argmax())]
            directions.append(f"{name} ({1e3 * sideways:.3g} mm/N, most along {most}; along it {1e3 * along:.3g})")
    if not directions:
        return None
    return SIDEWAYS_PUSH(f"The tip moves more at right angles to the force than along it: {listed(directions)}.")


def _standard_error(pushes: Sequence[PushLine], name: str, instrument: Instrument) -> float:
    squares: list[float] = []
    for push in pushes:
        if push.direction == name:
            about: Array = push.force - push.force.mean()
            squares.append(float(about @ about))
    return instrument.sigma / float(np.sqrt(sum(squares)))


#: So many records are named.
_NAMED = 4


def rounding_notices(evaluation: Evaluation, instrument: Instrument) -> tuple[Notice, ...]:
    """Return what is to be said of rounding.

    Args:
        instrument: As stated, without what rounding adds.
    """
    notices = (_readings(evaluation, instrument), _times(evaluation, instrument))
    return tuple(notice for notice in notices if notice is not None)


READINGS_ROUNDED: Final = Rule(
    "readings-rounded",
    "note",
    "readings in the file are rounded more coarsely than the instrument reads; rounding stands in place of its noise",
    cure="Write more decimals.",
)


def _readings(evaluation: Evaluation, instrument: Instrument) -> Notice | None:
    rounded = []
    for name, reading in evaluation.readings.items():
        if reading.rounding > instrument.sigma:
            step = 1e3 * math.sqrt(12.0) * reading.rounding
            rounded.append(f"positions of {name} to {step:.3g} mm ({1e3 * reading.rounding:.2g} mm)")
        if instrument.sigma_rot is not None and reading.rounding_rot > instrument.sigma_rot:
            step = math.sqrt(3.0) * reading.rounding_rot
            rounded.append(f"quaternions of {name} to {step:.2g} ({math.degrees(reading.rounding_rot):.2g} deg)")
    if not rounded:
        return None
    return READINGS_ROUNDED(
        f"Readings are rounded more coarsely than the instrument reads: {', '.join(rounded)}. What that leaves open "
        "as a standard deviation, in brackets, stands in place of the instrument's."
    )


TIMES_ROUNDED: Final = Rule(
    "times-rounded",
    "note",
    "times are rounded to more than the tip is known to move in; the message says where an even clock was found",
    cure="Samples that an even clock fits were placed on it; where none does, rounding counts as noise, and what it "
    "leaves open is marked. Write the times with more decimals.",
)


def _times(evaluation: Evaluation, instrument: Instrument) -> Notice | None:
    rounded: dict[str, str] = {}
    for of, clock, pace in _clocks(evaluation):
        off = pace * clock.resolution / math.sqrt(12.0)
        if off > instrument.sigma and of not in rounded:
            even = "on an even clock" if clock.even else "no even clock fits"
            rounded[of] = f"{of} to {clock.resolution:g} s, {1e3 * pace * clock.resolution:.2g} mm ({even})"
    if not rounded:
        return None
    more = f", and {len(rounded) - _NAMED} more" if len(rounded) > _NAMED else ""
    return TIMES_ROUNDED(
        f"Times are rounded to more than the tip is known to move in: "
        f"{', '.join(list(rounded.values())[:_NAMED])}{more}."
    )


def _clocks(evaluation: Evaluation) -> Iterator[tuple[str, Clock, float]]:
    """Yield whose each clock is, and how fast the tip is there: at rest where it enters the band [m/s]."""
    runs = [velocity.run for velocity in evaluation.velocities] + [deviation.run for deviation in evaluation.deviations]
    runs += [corner.run for corner in evaluation.corners] + [weave.run for weave in evaluation.weaves]
    for run in runs:
        for clock in {id(cycle.clock): cycle.clock for cycle in run.cycles}.values():
            yield f"{run.test} on {run.path.path.name}", clock, run.velocity
    for curve in evaluation.settling:
        row = int(np.clip(np.searchsorted(curve.time, curve.entry), 1, len(curve.time) - 1))
        pace = abs(np.diff(curve.distance)[row - 1]) / max(curve.time[row] - curve.time[row - 1], 1e-9)
        yield f"{curve.test} at {curve.where}", curve.clock, float(pace)


#: So many samples are named.
_NAMED_PATHS = 5
#: A path that is run at less than this share of the commanded velocity is said: on circles and weaves the robot slows
#: down by itself.
_SLOW = {"polyline": 0.5, "circle": 0.1, "weave": 0.1}
#: Samples of a cycle on the way, its ends left aside, among which a corner is not taken for an outlying sample.
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


def stream_notices(evaluation: Evaluation) -> tuple[Notice, ...]:
    """Return what is to be said of paths and settling."""
    runs = _runs(evaluation)
    notices = (
        _unusual(_records(evaluation, runs)),
        _outlying(evaluation),
        _gaps(runs),
        _slow(runs),
        _sparse(evaluation),
        _bandwidth(evaluation),
        _aside(evaluation),
    )
    return tuple(notice for notice in notices if notice is not None)


def _runs(evaluation: Evaluation) -> list[Run]:
    runs = [curve.run for curve in evaluation.deviations] + [curve.run for curve in evaluation.corners]
    runs += [curve.run for curve in evaluation.velocities] + [curve.run for curve in evaluation.weaves]
    return list({id(run): run for run in runs}.values())


def _records(evaluation: Evaluation, runs: Sequence[Run]) -> list[_Record]:
    of_paths, of_settling = (
        evaluation.readings[name].rounding if name in evaluation.readings else 0.0 for name in ("paths", "settling")
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
    for row, curve in enumerate(evaluation.settling):
        settling.setdefault((curve.test, curve.where, curve.conditions), []).append(row)
    for rows in settling.values():
        curves = [evaluation.settling[row] for row in rows]
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


UNUSUAL_SAMPLES: Final = Rule(
    "unusual-samples",
    "warning",
    "samples lie apart from those about them, as in no other cycle. Look at the paths in the report; remove the "
    "lines if it was the instrument",
)


def _unusual(records: Sequence[_Record]) -> Notice | None:
    named = []
    for record in records:
        for sample in unusual_samples(record.times, record.positions, record.places, record.rounding):
            line = int(record.lines[sample.cycle][sample.sample])
            text = (
                f"line {line} (cycle {record.numbers[sample.cycle]} of {record.name}, {1e3 * sample.distance:.2g} mm)"
            )
            named.append((sample.distance, text))
    if not named:
        return None
    return UNUSUAL_SAMPLES(
        f"Samples lie apart from those about them, as in no other cycle there: {_worst(named)}. If it was the "
        "instrument, remove these lines: samples may be missing. If it was the robot, they belong into the figures."
    )


def _worst(named: Sequence[tuple[float, str]]) -> str:
    """Return the texts with the largest numbers, and how many more there are."""
    shown = [text for _, text in sorted(named, key=lambda both: -both[0])[:_NAMED_PATHS]]
    return ", ".join([*shown, f"and {len(named) - _NAMED_PATHS} more"] if len(named) > _NAMED_PATHS else shown)


def _called(run: Run) -> str:
    return f"{run.test} on {run.path.path.name}"


SLOW_PATH: Final = Rule(
    "slow-path", "warning", "paths were run much slower than commanded. Check `velocity [%]` and the rated velocity"
)


def _slow(runs: Sequence[Run]) -> Notice | None:
    slow_paths = []
    for run in runs:
        pace = float(np.median([pace_along(run.path, cycle.time, cycle.along) for cycle in run.cycles]))
        if pace < _SLOW[run.path.path.kind] * run.velocity:
            slow_paths.append(f"{_called(run)} at {1e3 * pace:.4g} of {1e3 * run.velocity:.4g} mm/s")
    if not slow_paths:
        return None
    more = f", and {len(slow_paths) - _NAMED_PATHS} more" if len(slow_paths) > _NAMED_PATHS else ""
    return SLOW_PATH(
        f"Paths were run much slower than commanded: {', '.join(slow_paths[:_NAMED_PATHS])}{more}. If the robot cannot,"
        " that is what AV says; otherwise check velocity [%] and the rated velocity of the plan."
    )


SAMPLED_TOO_SLOWLY: Final = Rule(
    "sampled-too-slowly", "warning", "samples are too far apart for some values, which are marked. Sample faster"
)


def _sparse(evaluation: Evaluation) -> Notice | None:
    criteria: dict[str, None] = {}
    for path in evaluation.deviations:
        if path.sparse:
            criteria |= dict.fromkeys((path.run.test, path.run.test.replace("AT", "RT", 1)))
    for corner in evaluation.corners:
        criteria |= dict.fromkeys(id_ for id_, far in zip(("CR", "CO"), corner.sparse, strict=True) if far)
    for curve in evaluation.settling:
        ids = ("t", "OV") if curve.test == "t" else ("posing-time",)
        criteria |= dict.fromkeys(id_ for id_, far in zip(ids, curve.sparse, strict=False) if far)
    if not criteria:
        return None
    return SAMPLED_TOO_SLOWLY(
        f"Samples are too far apart for some values of {listed(tuple(criteria))}: what lies between two of them is not "
        "seen. Those values are marked; sample faster."
    )


OUTLYING_CYCLE: Final = Rule(
    "outlying-cycle",
    "warning",
    "cycles lie apart from the others of their path as a whole; AT and RT with and without them are said",
    cure="Look at the record, and measure the cycle again if the instrument or its mount moved.",
    formerly="wild-cycle",
    gravity=2,
)


def _outlying(evaluation: Evaluation) -> Notice | None:
    named = []
    for path in evaluation.deviations:
        outlying = outlying_cycle(path)
        if outlying is None:
            continue
        cycle, far, accuracy, repeatability = outlying
        values = f"RT is {1e3 * float(path.spread.max()):.4f} mm, without it {1e3 * repeatability:.4f}"
        values += f"; AT is {1e3 * float(path.distance.max()):.4f} mm, without it {1e3 * accuracy:.4f}"
        number = path.run.cycles[cycle].number
        named.append((far, f"cycle {number} of {_called(path.run)} by {1e3 * far:.4f} mm ({values})"))
    if not named:
        return None
    return OUTLYING_CYCLE(
        f"Cycles lie apart from the others of their path as a whole: {_worst(named)}. The standard excludes no cycle, "
        "and none was left out."
    )


GAP_IN_PATH: Final = Rule(
    "gap-in-path",
    "warning",
    "samples are missing on a part of the way",
    cure="Measure these cycles again, or leave them out.",
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
    return GAP_IN_PATH(
        f"Samples are missing on a part of the way: {_worst(named)}. Values there come from straight lines between the "
        "samples before and behind."
    )


VELOCITY_BANDWIDTH: Final = Rule(
    "velocity-bandwidth",
    "note",
    "up to which frequency FV tells fluctuation",
    cure="Compare robots at the same bandwidth.",
)


def _bandwidth(evaluation: Evaluation) -> Notice | None:
    bandwidths = [curve.bandwidth for curve in evaluation.velocities]
    if not bandwidths:
        return None
    low, high = min(bandwidths), max(bandwidths)
    upto = f"{high:.2g} Hz" if high < 1.1 * low else f"{low:.2g} to {high:.2g} Hz"
    return VELOCITY_BANDWIDTH(
        f"FV and its interval tell what fluctuates with up to {upto}: faster fluctuation is smoothed away together "
        "with the instrument's noise."
    )


CORNER_OFFSET: Final = Rule(
    "corner-offset",
    "note",
    "most of CR is that the path as a whole lies beside its command; CR from its own corner is said",
)


def _aside(evaluation: Evaluation) -> Notice | None:
    offset_corners = [corner for corner in evaluation.corners if corner.offset > _ASIDE * float(corner.rounding.mean())]
    if not offset_corners:
        return None
    worst = max(offset_corners, key=lambda corner: corner.offset)
    return CORNER_OFFSET(
        f"At {len(offset_corners)} of {len(evaluation.corners)} corners the path as a whole lies beside its command by "
        f"more than half of CR, which CR and CO contain. At {worst.where} it lies {1e3 * worst.offset:.3f} mm beside, "
        f"and CR of {1e3 * float(worst.rounding.mean()):.3f} mm would be "
        f"{1e3 * float(worst.own.mean()):.3f} mm from its own corner."
    )
