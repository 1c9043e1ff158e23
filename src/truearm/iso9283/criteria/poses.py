"""The criteria of poses: AP, RP, vAP, AD, RD, dAP, dRP and E.

The formulas are those that Nubiola (section 2.6), Patel (chapter 3) and public descriptions give for ISO 9283:1998; its
text was not at hand. Angles a, b, c are those of the rotation vector from the commanded to the attained orientation,
about the axes of the robot's base.

What the instrument scatters is in every value, as in the standard's: RP is that of robot and instrument together, and
nothing is subtracted. Intervals hold what would be found with infinitely many cycles and the same instrument
(:mod:`truearm.iso9283.criteria.intervals`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.drift import DriftCourse, drift_values
from truearm.iso9283.criteria.intervals import (
    LEAST_CYCLES,
    Interval,
    largest_difference,
    mean_interval,
    norm_interval,
    repeatability,
    repeatability_interval,
    spread_interval,
)
from truearm.iso9283.criteria.outlying_rows import OutlyingRow, UnusualRows, unusual_rows, without
from truearm.iso9283.criteria.rows import (
    ANGLES,
    AXES,
    Component,
    Conditions,
    Cycles,
    Instrument,
    Value,
    cycles_of,
    valued,
)
from truearm.iso9283.planning.criteria import TEST_OF, TESTS, PerformancePlan, PlannedTest
from truearm.iso9283.planning.records import AttainedPoses

#: Robots that are exchanged.
ROBOTS: Final = 5


def missing_rows(plan: PerformancePlan, cycles: Sequence[Cycles]) -> tuple[str, ...]:
    """Return what is missing in tests of poses that have rows: ``AP: P3``, ``vAP: P2 from y``, ``AP: P3 at 50 %``."""
    missing = []
    for test in plan.tests:
        of_test = [cycle for cycle in cycles if cycle.test == test.id]
        if of_test:
            robots = sorted({cycle.robot for cycle in of_test})
            missing += [line for robot in robots for line in _missing_of(test, of_test, robot, len(robots) > 1)]
            if test.id == "E" and len(robots) < ROBOTS:
                missing.append(f"E: {ROBOTS - len(robots)} of {ROBOTS} robots")
    return tuple(missing)


def _missing_of(test: PlannedTest, cycles: Sequence[Cycles], robot: str, several: bool) -> list[str]:
    measured = {(cycle.pose, cycle.approach, cycle.velocity, cycle.load) for cycle in cycles if cycle.robot == robot}
    of = f" of {robot}" if several else ""
    approaches = test.approaches if test.id == "vAP" else ("",)
    conditions = [*product(test.velocities, test.loads)]
    missing = []
    for pose, approach in product(test.places, approaches):
        absent = [under for under in conditions if (pose, approach, *under) not in measured]
        label = f"{test.id}: {pose}{f' from {approach}' if approach else ''}"
        missing += [f"{label}{of}{under}" for under in _at(absent, conditions, test)]
    return missing


def _at(absent: Sequence[tuple[float, float]], all_: Sequence[tuple[float, float]], test: PlannedTest) -> list[str]:
    """Return under which conditions, in words; nothing to say of all of them."""
    if len(absent) == len(all_):
        return [""]
    return [
        f" at {100 * velocity:g} %{f', load {100 * load:g} %' if len(test.loads) > 1 else ''}"
        for velocity, load in absent
    ]


@dataclass(frozen=True)
class MissingPlace:
    """A place of a test under a condition that has no value, while others of the test have one."""

    test: str  #: test, where: which, the place as values have it.
    where: str
    conditions: Conditions  #: As values have them.
    words: str  #: ``AT: line``, ``AT: line at 50 %``.


def missing_places(plan: PerformancePlan, values: Sequence[Value]) -> tuple[MissingPlace, ...]:
    """Return what is missing in tests of paths, of settling and of forces that have values."""
    missing = []
    for test in plan.tests:
        of_test = [v for v in values if TEST_OF[v.id] == test.id and math.isfinite(v.value)]
        if TESTS[test.id].readings == "poses" or not of_test:
            continue
        conditions = [*product(test.velocities, test.loads)]
        for place in test.approaches or test.places:
            measured = [v.conditions for v in of_test if _is_at(v.where, place)]
            absent = [under for under in conditions if not any(_is_under(attained, under) for attained in measured)]
            value_place = f"{test.places[0]}-{place}" if test.id == "posing-time" else place
            for under, words in zip(absent, _at(absent, conditions, test), strict=False):
                known = of_test[0].conditions
                velocity = None if known.velocity is None else under[0]
                load = None if known.load is None else under[1]
                missing.append(
                    MissingPlace(test.id, value_place, Conditions(velocity, load), f"{test.id}: {value_place}{words}")
                )
    return tuple(missing)


def _is_at(value_place: str, place: str) -> bool:
    """Return whether a value is of a place: ``rectangle E2`` of the rectangle, ``P1-D10`` of D10."""
    return value_place == place or value_place.startswith(f"{place} ") or value_place.endswith(f"-{place}")


def _is_under(conditions: Conditions, under: tuple[float, float]) -> bool:
    """Return whether a value is of a velocity and a load, which are not said where they do not matter."""
    return all(
        own is None or abs(own - planned) < 1e-6
        for own, planned in zip((conditions.velocity, conditions.load), under, strict=True)
    )


_NOTHING: Final = math.nan
_LENGTHS: Final[tuple[Component, ...]] = ("position", *AXES)


@dataclass(frozen=True, eq=False)
class PoseCloud:
    """Attained poses of one test at one pose under one condition, for a picture."""

    test: str  #: test, robot, pose, approach, velocity, load: which.
    robot: str
    pose: str
    approach: str
    velocity: float
    load: float
    command: Array  #: command, barycentre: [m], ``(3,)``, in the base frame.
    points: Array  #: [m], ``(n, 3)``.
    barycentre: Array
    rp: float  #: RP, the radius of the sphere about the barycentre [m]; NaN for one cycle.


@dataclass(frozen=True, eq=False)
class PoseEvaluation:
    """What comes out of a file of attained poses."""

    #: Of every planned criterion of poses, in the order of the plan; those that were not measured too.
    values: tuple[Value, ...]
    clouds: tuple[PoseCloud, ...]  #: Of all tests but drift.
    drift: tuple[DriftCourse, ...]  #: AP and RP over time.
    unusual: UnusualRows  #: Rows far from the others, and poses with two places of rest.
    missing: tuple[str, ...]  #: Places of tests that were measured, and have no row themselves.


@dataclass(frozen=True, eq=False)
class _Judge:
    alignment: Alignment
    instrument: Instrument

    @property
    def sigma(self) -> float:
        return self.instrument.sigma

    @property
    def sigma_rot(self) -> float:
        return self.instrument.sigma_rot or 0.0


_Values = Iterator[Value]


def evaluate(
    plan: PerformancePlan, readings: AttainedPoses, alignment: Alignment, instrument: Instrument
) -> PoseEvaluation:
    """Evaluate the criteria of poses.

    Raises:
        InputError: If rows do not fit the plan: see :func:`truearm.iso9283.criteria.rows.cycles_of`.
    """
    cycles = cycles_of(plan, readings, alignment)
    judge = _Judge(alignment, instrument)
    values, courses = _evaluated(plan.tests, cycles, judge)
    unusual = unusual_rows(cycles, instrument)
    if unusual.outlying:
        tests = {row.of.test for row in unusual.outlying}
        left = without(cycles, unusual.outlying)
        others, _ = _evaluated([test for test in plan.tests if test.id in tests], left, judge)
        unusual = replace(
            unusual, outlying=tuple(replace(row, changes=_changes(row, values, others)) for row in unusual.outlying)
        )
    clouds = tuple(_cloud(cycle) for cycle in cycles if cycle.test != "dAP")
    return PoseEvaluation(tuple(values), clouds, tuple(courses), unusual, missing_rows(plan, cycles))


def _evaluated(
    tests: Iterable[PlannedTest], cycles: Sequence[Cycles], judge: _Judge
) -> tuple[list[Value], list[DriftCourse]]:
    values: list[Value] = []
    courses: list[DriftCourse] = []
    for test in tests:
        of_test = [cycle for cycle in cycles if cycle.test == test.id]
        if test.id == "dAP":
            test_values, test_courses = drift_values(test, of_test, judge.instrument, judge.alignment)
            values += test_values
            courses += test_courses
        elif test.id in _EVALUATED:
            values += _EVALUATED[test.id](test, of_test, judge)
    return values, courses


def _changes(row: OutlyingRow, values: Sequence[Value], others: Sequence[Value]) -> tuple[tuple[Value, Value], ...]:
    """Return the values that a row is in, each with the same without it."""
    of = row.of
    under = Conditions(of.velocity, of.load, "" if of.test == "E" else of.robot)
    parts = ("position",) if row.kind == "position" else ANGLES
    affected = [
        value
        for value in values
        if value.id in TESTS[of.test].criteria
        and value.component in parts
        and of.pose in value.where.split("-")
        and value.conditions == under
        and math.isfinite(value.value)
    ]
    key = {(v.id, v.component, v.where, v.conditions): v for v in others}
    pairs = [(v, key.get((v.id, v.component, v.where, v.conditions))) for v in affected]
    changes = [(with_row, without_row) for with_row, without_row in pairs if without_row is not None]
    return tuple(sorted(changes, key=lambda pair: -abs(pair[0].value - pair[1].value)))


def _cloud(group: Cycles) -> PoseCloud:
    rp = float(repeatability(group.points)) if len(group) > 1 else _NOTHING
    return PoseCloud(
        group.test,
        group.robot,
        group.pose,
        group.approach,
        group.velocity,
        group.load,
        group.command,
        group.points,
        group.barycentre,
        rp,
    )


def _conditions(test: PlannedTest, cycles: list[Cycles], *, robots: bool = True) -> list[Conditions]:
    """Return the conditions that were planned, of each robot that was measured."""
    names = list(dict.fromkeys(cycle.robot for cycle in cycles)) if robots else [""]
    return [Conditions(v, load, name) for name in names or [""] for v in test.velocities for load in test.loads]


def _same(conditions: Conditions, other: Conditions) -> bool:
    pairs = ((conditions.velocity, other.velocity), (conditions.load, other.load))
    return conditions.robot == other.robot and all(abs((a or 0.0) - (b or 0.0)) < 1e-9 for a, b in pairs)


def _at_poses(cycles: Iterable[Cycles], under: Conditions, pose: str, *, any_robot: bool = False) -> list[Cycles]:
    """Return those cycles at a pose under a condition."""
    return [
        cycle
        for cycle in cycles
        if cycle.pose == pose and _same(Conditions(cycle.velocity, cycle.load, "" if any_robot else cycle.robot), under)
    ]


def _pose_accuracy(test: PlannedTest, cycles: list[Cycles], judge: _Judge) -> _Values:
    """Yield AP, the distance of the barycentre from the command, and RP, ``mean l + 3 S_l`` with n - 1.

    Of angles: mean angle minus commanded angle, with its sign, and ``3 S``.
    """
    for under in _conditions(test, cycles):
        for pose in test.places:
            of_pose = _at_poses(cycles, under, pose)
            n = len(of_pose[0]) if of_pose else 0
            common = (pose, n, test.cycles, under)
            if not of_pose:
                for id in ("AP", "RP"):
                    yield valued(id, "position", *common, _NOTHING, "length")
                    yield from (valued(id, angle, *common, _NOTHING, "angle") for angle in ANGLES)
                continue
            group = of_pose[0]
            yield _accuracy(group, common, judge)
            interval = repeatability_interval(group.points)
            rp = float(repeatability(group.points)) if n > 1 else _NOTHING
            yield from _angles_of(group, "AP", common, judge, judge.alignment.sigma_rot)
            yield valued("RP", "position", *common, rp, "length", interval, judge.sigma)
            yield from _spreads_of(group.angles, "RP", common, judge.sigma_rot)


_Common = tuple[str, int, int, Conditions]


def _accuracy(group: Cycles, common: _Common, judge: _Judge) -> Value:
    n = len(group)
    away = group.points - group.command
    known = judge.alignment.covariance_at(group.barycentre)
    interval = None
    if n >= LEAST_CYCLES:
        interval = norm_interval(away.mean(axis=0), np.cov(away.T), n, known)
    distance = np.linalg.norm(away, axis=1)
    few = interval is None
    return valued(
        "AP",
        "position",
        *common,
        float(np.linalg.norm(away.mean(axis=0))),
        "length",
        interval,
        math.sqrt(judge.sigma**2 + float(np.trace(known)) / 3.0),
        least=float(distance.min()) if few else None,
        largest=float(distance.max()) if few else None,
    )


def _angles_of(group: Cycles, id: str, common: _Common, judge: _Judge, tie: float) -> _Values:
    """Yield the mean angles."""
    for k, angle in enumerate(ANGLES):
        if group.angles is None:
            yield valued(id, angle, *common, _NOTHING, "angle")
            continue
        angles = group.angles[:, k]
        unknown = math.hypot(judge.sigma_rot, tie)
        yield valued(id, angle, *common, float(angles.mean()), "angle", mean_interval(angles, tie**2), unknown)


def _spreads_of(angles: Array | None, id: str, common: _Common, unknown: float) -> _Values:
    """Yield ``3 S`` of angles."""
    for k, angle in enumerate(ANGLES):
        spread, interval = (_NOTHING, None) if angles is None else _spread(angles[:, k])
        yield valued(id, angle, *common, spread, "angle", interval, unknown)


def _spread(numbers: Array) -> tuple[float, Interval | None]:
    if len(numbers) < 2:
        return _NOTHING, None
    deviation = float(numbers.std(ddof=1))
    return 3.0 * deviation, spread_interval(deviation, len(numbers))


def _variation(test: PlannedTest, cycles: list[Cycles], judge: _Judge) -> _Values:
    """Yield vAP, the largest distance between the barycentres of the approaches, and the largest angle between them."""
    for under in _conditions(test, cycles):
        for pose in test.places:
            of_pose = _at_poses(cycles, under, pose)
            n = min((len(group) for group in of_pose), default=0)
            enough = len(of_pose) >= len(test.approaches)
            yield from _differences("vAP", of_pose, (pose, n, test.cycles, under), judge, enough=enough, angles=True)


def _differences(
    id: str, groups: list[Cycles], common: _Common, judge: _Judge, *, enough: bool, angles: bool
) -> _Values:
    """Yield the largest distance between barycentres at the same pose, and the largest difference of each angle."""
    pairs = [(i, j) for i in range(len(groups)) for j in range(i) if groups[i].pose == groups[j].pose]
    nothing: tuple[float, Interval | None] = (_NOTHING, None)
    value, interval = largest_difference([group.points for group in groups], pairs) if pairs else nothing
    unknown = math.sqrt(2.0) * judge.sigma
    yield valued(id, "position", *common, value, "length", interval, unknown, enough=enough)
    for k, angle in enumerate(ANGLES if angles else ()):
        read = [group.angles[:, k : k + 1] for group in groups if group.angles is not None]
        value, interval = largest_difference(read, pairs) if pairs and len(read) == len(groups) else nothing
        unknown = math.sqrt(2.0) * judge.sigma_rot
        yield valued(id, angle, *common, value, "angle", interval, unknown, enough=enough)


def _distances(test: PlannedTest, cycles: list[Cycles], judge: _Judge) -> _Values:
    """Yield AD, the mean distance of two poses minus the commanded one, and RD, ``3 S`` of the distances.

    Each cycle gives one distance. Along an axis, distances count as positive the way that is commanded; of an angle,
    the change of the error from the first pose to the second.
    """
    first, second = test.places[0], test.places[-1]
    pair = f"{first}-{second}"
    for under in _conditions(test, cycles):
        ends = [_at_poses(cycles, under, pose) for pose in (first, second)]
        both: tuple[Cycles, ...] = ()
        rows = (np.empty(0, np.intp), np.empty(0, np.intp))
        if all(ends):
            both = (ends[0][0], ends[1][0])
            _, *rows = np.intersect1d(both[0].cycle, both[1].cycle, return_indices=True)  # type: ignore[assignment]
        n = len(rows[0])
        common = (pair, n, test.cycles, under)
        if n == 0:
            for id in ("AD", "RD"):
                yield from (valued(id, part, *common, _NOTHING, "length") for part in _LENGTHS)
                yield from (valued(id, angle, *common, _NOTHING, "angle") for angle in ANGLES)
            continue
        a, b = both
        command = b.command - a.command
        apart = b.points[rows[1]] - a.points[rows[0]]
        sense = np.where(command < 0, -1.0, 1.0)
        lengths: list[tuple[Component, Array, float, float]] = [
            ("position", np.linalg.norm(apart, axis=1), float(np.linalg.norm(command)), 0.0)
        ]
        for k, axis in enumerate(AXES):
            tie = judge.alignment.sigma_rot**2 * float(command @ command - command[k] ** 2)
            lengths.append((axis, sense[k] * apart[:, k], abs(float(command[k])), tie))
        turned = None if a.angles is None or b.angles is None else b.angles[rows[1]] - a.angles[rows[0]]
        unknown, unknown_angle = math.sqrt(2.0) * judge.sigma, math.sqrt(2.0) * judge.sigma_rot
        for part, length, commanded, tie in lengths:
            off = length - commanded
            u = math.sqrt(unknown**2 + tie)
            yield valued("AD", part, *common, float(off.mean()), "length", mean_interval(off, tie), u)
        for k, angle in enumerate(ANGLES):
            mean = _NOTHING if turned is None else float(turned[:, k].mean())
            interval = None if turned is None else mean_interval(turned[:, k])
            yield valued("AD", angle, *common, mean, "angle", interval, unknown_angle)
        for part, length, _, _ in lengths:
            spread, interval = _spread(length)
            yield valued("RD", part, *common, spread, "length", interval, unknown)
        yield from _spreads_of(turned, "RD", common, unknown_angle)


def _exchangeability(test: PlannedTest, cycles: list[Cycles], judge: _Judge) -> _Values:
    """Yield E, the largest distance between the barycentres of robots at each pose, and the largest of all poses.

    The instrument stands still while robots are exchanged, so that its tie to the base is common to all. Fewer than
    five robots are too few.
    """
    for under in _conditions(test, cycles, robots=False):
        whole: list[Cycles] = []
        for pose in test.places:
            of_pose = _at_poses(cycles, under, pose, any_robot=True)
            whole += of_pose
            n = min((len(group) for group in of_pose), default=0)
            enough = len(of_pose) >= ROBOTS
            yield from _differences("E", of_pose, (pose, n, test.cycles, under), judge, enough=enough, angles=False)
        n = min((len(group) for group in whole), default=0)
        enough = len(whole) >= ROBOTS * len(test.places)
        yield from _differences("E", whole, ("all poses", n, test.cycles, under), judge, enough=enough, angles=False)


_EVALUATED: Final[dict[str, Callable[[PlannedTest, list[Cycles], _Judge], _Values]]] = {
    "AP": _pose_accuracy,
    "vAP": _variation,
    "AD": _distances,
    "E": _exchangeability,
}
