"""Drift of AP and RP from cold: the largest change against the first group of cycles.

Formulas as public descriptions of ISO 9283:1998 give them: groups of cycles are measured again and again while the
robot warms up, each group has an AP and an RP, and dAP and dRP are the largest changes of these against the first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.intervals import (
    LEAST_CYCLES,
    Interval,
    barycentre_scatter,
    largest_interval,
    repeatability,
    repeatability_scatter,
)
from truearm.iso9283.criteria.rows import ANGLES, Conditions, Cycles, Instrument, Value, valued
from truearm.iso9283.planning.criteria import PlannedTest

#: A pause of so many times the usual time between two cycles begins a new group.
_PAUSE: Final = 5.0
#: Ties that are drawn.
_TIES: Final = 4000


@dataclass(frozen=True, eq=False)
class DriftCourse:
    """AP and RP over time at one pose under one condition."""

    robot: str  #: robot, pose, velocity, load: which.
    pose: str
    velocity: float
    load: float
    time: Array  #: Mean time of each group [s], ``(k,)``; NaN where no times are given.
    cycles: tuple[int, ...]  #: Of each group, ``(k,)``.
    ap: Array  #: ap, rp: [m], ``(k,)``; RP of a single cycle is NaN.
    rp: Array


def groups_of(cycles: Cycles) -> list[Cycles]:
    """Return the groups of cycles in the order of time.

    A new one begins where the number of the cycle does not go on upwards, and after a pause of more than five times the
    usual time between two cycles.
    """
    begins = cycles.cycle[1:] <= cycles.cycle[:-1]
    between = np.diff(cycles.time)
    if len(between) and np.isfinite(between).all():
        begins = begins | (between > _PAUSE * max(float(np.median(between)), 1e-9))
    ends = [0, *(np.flatnonzero(begins) + 1).tolist(), len(cycles)]
    return [cycles.rows(slice(a, b)) for a, b in pairwise(ends)]


def drift_values(
    test: PlannedTest, cycles: list[Cycles], instrument: Instrument, alignment: Alignment | None = None
) -> tuple[list[Value], list[DriftCourse]]:
    """Return dAP and dRP of every pose, and the courses they are taken from.

    Where the instrument stands is common to all groups. What its tie to the base leaves open moves all of them by the
    same, and so changes dAP where AP is not far above it: that is drawn, and widens the interval. `alignment` is that
    tie; None if it is exact.
    """
    values: list[Value] = []
    courses: list[DriftCourse] = []
    for cycle in cycles:
        under = Conditions(cycle.velocity, cycle.load, cycle.robot)
        groups = groups_of(cycle)
        course = _course(cycle, groups)
        courses.append(course)
        n = min(course.cycles)
        common = (cycle.pose, n, test.cycles, under)
        unknown = math.sqrt(2.0) * instrument.sigma
        unknown_angle = math.sqrt(2.0) * (instrument.sigma_rot or 0.0)
        for id, course_of, scatter in (
            ("dAP", course.ap, _scatter_of_accuracy(groups, cycle.command)),
            ("dRP", course.rp, _scatter_of_spread([group.points for group in groups], course.rp)),
        ):
            value, interval = _largest_change(course_of, scatter)
            tied = _changes_by_tie(groups, cycle.command, alignment) if id == "dAP" else None
            left = unknown
            if id == "dAP" and interval is not None:
                interval = interval[0], interval[1] + _raised(groups[0])
            if tied is not None:
                left = math.hypot(unknown, float(np.std(tied)))
                interval = None if interval is None else _widened(interval, value, tied)
            values.append(valued(id, "position", *common, value, "length", interval, left))
            for k, angle in enumerate(ANGLES):
                value, interval = math.nan, None
                if cycle.angles is not None:
                    value, interval = _change_of_angle(id, [group.angles[:, k] for group in groups])  # type: ignore[index]
                values.append(valued(id, angle, *common, value, "angle", interval, unknown_angle))
    if not cycles:
        for pose in test.places:
            for under in (Conditions(v, load) for v in test.velocities for load in test.loads):
                for id in ("dAP", "dRP"):
                    nothing = (pose, 0, test.cycles, under, math.nan)
                    values.append(valued(id, "position", *nothing, "length"))
                    values += [valued(id, angle, *nothing, "angle") for angle in ANGLES]
    return values, courses


def _course(cycles: Cycles, groups: list[Cycles]) -> DriftCourse:
    return DriftCourse(
        robot=cycles.robot,
        pose=cycles.pose,
        velocity=cycles.velocity,
        load=cycles.load,
        time=np.array([group.time.mean() for group in groups]),
        cycles=tuple(map(len, groups)),
        ap=np.array([float(np.linalg.norm(group.barycentre - cycles.command)) for group in groups]),
        rp=np.array([float(repeatability(group.points)) if len(group) > 1 else math.nan for group in groups]),
    )


_Scatter = tuple[Array, Array] | None


def _raised(first: Cycles) -> float:
    """Return by how much scatter alone raises the AP of the first group [m], so that changes from it are too small."""
    accuracy = float(np.linalg.norm(first.barycentre - first.command))
    scatter = float(first.points.var(axis=0, ddof=1).sum()) / len(first)
    return accuracy - math.sqrt(max(accuracy**2 - scatter, 0.0))


def _largest_change(course: Array, scatter: _Scatter) -> tuple[float, Interval | None]:
    """Return the largest change of a course against its first value, and its interval."""
    if len(course) < 2 or np.isnan(course).any():
        return math.nan, None
    value = float(_changes(course[None])[0])
    return value, None if scatter is None else largest_interval(_changes, course - course[0], *scatter)


def _changes_by_tie(groups: list[Cycles], command: Array, alignment: Alignment | None) -> Array | None:
    """Return what dAP would be with other ties that are as likely, ``(m,)`` [m]."""
    if alignment is None or len(groups) < 2:
        return None
    away = np.array([group.barycentre - command for group in groups])
    rng = np.random.default_rng(9283)
    moved = rng.multivariate_normal(np.zeros(3), alignment.covariance_at(command), _TIES)
    return _changes(np.linalg.norm(away + moved[:, None, :], axis=2))


def _widened(interval: Interval, value: float, tied: Array) -> Interval:
    """Return an interval widened by what other ties would give.

    A change of a norm is at most the way that the poses went, and close to it for many ties: so each side has the
    outermost hundredth of them, and what cycles scatter by is added to it.
    """
    low, high = np.quantile(tied, [0.005, 0.995])
    return (max(min(value, float(low)) - (value - interval[0]), 0.0), max(value, float(high)) + (interval[1] - value))


def _changes(courses: Array) -> Array:
    return np.asarray(np.abs(courses[:, 1:] - courses[:, :1]).max(axis=1))


def _pooled(groups: list[Array]) -> Array:
    """Return the covariance of cycles about the barycentres of their groups, ``(d, d)``."""
    about = np.concatenate([group - group.mean(axis=0) for group in groups])
    return np.asarray(about.T @ about / (len(about) - len(groups)))


def _scatter_of_accuracy(groups: list[Cycles], command: Array) -> _Scatter:
    """Return how the AP of each group may lie beside the true one, drawn twice, ``(m, k)``.

    The scatter of cycles is pooled over the groups. What norms are biased by is common to all of them, as far as they
    are all near the mean of the barycentres.
    """
    if len(groups) < 2 or min(map(len, groups)) < LEAST_CYCLES:
        return None
    covariance = _pooled([group.points for group in groups])
    away = np.mean([group.barycentre - command for group in groups], axis=0)

    def drawn(draw: int) -> Array:
        norms = [
            np.linalg.norm(away + barycentre_scatter(covariance, len(group), None, 2 * k + draw), axis=1)
            for k, group in enumerate(groups)
        ]
        return np.stack([norm - norm.mean() for norm in norms], axis=1)

    return drawn(1), drawn(2)


def _scatter_of_spread(groups: list[Array], spread: Array) -> _Scatter:
    """Return how the RP of each group may lie beside the true one, drawn twice, ``(m, k)``."""
    if len(groups) < 2 or min(map(len, groups)) < LEAST_CYCLES or not spread.max() > 0:
        return None
    about = np.concatenate([group - group.mean(axis=0) for group in groups])
    of_cycles = {cycles: repeatability_scatter(about, cycles) for cycles in {*map(len, groups)}}

    def drawn(draw: int) -> Array:
        columns = []
        for k, group in enumerate(groups):
            ratios = of_cycles[len(group)]
            order = np.random.default_rng((9283, 2 * k + draw)).permutation(len(ratios))
            columns.append(spread.mean() * (ratios[order] - 1.0))
        return np.stack(columns, axis=1)

    return drawn(1), drawn(2)


def _change_of_angle(id: str, groups: list[Array]) -> tuple[float, Interval | None]:
    """Return the largest change of the mean of an angle, or of its ``3 S``."""
    n = [len(group) for group in groups]
    if len(groups) < 2 or (id == "dRP" and min(n) < 2):
        return math.nan, None
    course = np.array([group.mean() if id == "dAP" else 3.0 * group.std(ddof=1) for group in groups])
    scatter = None
    if min(n) >= LEAST_CYCLES:
        pooled = _pooled([group[:, None] for group in groups])
        if id == "dAP":
            scatter = tuple(
                np.concatenate([barycentre_scatter(pooled, m, None, 2 * k + draw) for k, m in enumerate(n)], axis=1)
                for draw in (1, 2)
            )
        elif pooled[0, 0] > 0:
            rng = np.random.default_rng(9283)
            chi = [np.sqrt(rng.chisquare(m - 1, (2, 2000)) / (m - 1)) - 1.0 for m in n]
            scatter = tuple(
                3.0 * math.sqrt(pooled[0, 0]) * np.stack([ratios[draw] for ratios in chi], 1) for draw in (0, 1)
            )
    return _largest_change(course, scatter)  # type: ignore[arg-type]
