"""Path accuracy AT and path repeatability RT, of position and of the angles a, b, c.

In planes at right angles to the commanded path at many stations: AT is the largest distance from the barycentre of the
cycles' intersections to the command, RT the largest mean distance of the intersections to their barycentre plus three
standard deviations (n - 1) of it; of an angle AT is the largest mean minus command and RT the largest three standard
deviations (the issue's table and the literature on ISO 9283; the standard's text was not at hand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rotation_vector
from truearm.iso9283.criteria.intervals import LEAST_CYCLES
from truearm.iso9283.criteria.rows import COARSE, Component, Instrument, Value
from truearm.iso9283.criteria.runs import Run, runs_of
from truearm.iso9283.criteria.streams import Cycle, local_lines
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Samples

#: Stations along a path.
STATIONS = 50
#: An intersection is the straight line through the samples so near to the plane, as a share of the way between two
#: stations.
_HALF = 0.5
#: Between two samples at most so many stations may lie: deviations that change faster are not seen.
_SPARSE = 2.0
#: A cycle so many times as far from the middle of all as every other one is outlying; so many times of fewer than so
#: many.
_OUTLYING, _OUTLYING_OF_FEW, _FEW = 4.0, 12.0, 8
#: Simulated campaigns for an interval, and normal numbers for the mean and spread of distances.
_TRIALS, _DRAWS = 400, 500
_ANGLES: tuple[Component, ...] = ("a", "b", "c")


@dataclass(frozen=True, eq=False)
class PathDeviations:
    """How far a path is from its command, station by station, for pictures."""

    path: str  #: Its name.
    run: Run  #: What it comes from.
    along: Array  #: Arc length of the stations [m], ``(m,)``.
    #: Of each cycle from the command, in the plane at right angles to the path, in the base frame [m], ``(cycles, m,
    #: 3)``.
    deviation: Array
    mean: Array  #: Of the cycles [m], ``(m, 3)``.
    #: distance, half_width: of the barycentre from the command, and of its 95 % interval at each station for itself
    #: [m], ``(m,)``.
    distance: Array
    half_width: Array
    spread: Array  #: Mean distance to the barycentre plus three standard deviations [m], ``(m,)``.
    #: Rotation vectors from the commanded to the attained orientation [rad], ``(cycles, m, 3)``; None without.
    angles: Array | None
    pooled: float  #: So many samples make up an intersection, in the middle of all.

    @property
    def sparse(self) -> bool:
        """Whether samples are too far apart to show how the deviation changes along the path."""
        length = self.run.path.length
        steps = np.concatenate([np.abs(np.diff(_middle(cycle.along, length))) for cycle in self.run.cycles])
        return not len(steps) or float(np.median(steps)) > _SPARSE * length / STATIONS


def path_values(
    plan: PerformancePlan,
    samples: Samples,
    transform: Array,
    instrument: Instrument,
    test: str = "AT",
    tie: Array | None = None,
    tie_rot: float = 0.0,
    seed: int = 9283,
) -> tuple[list[Value], list[PathDeviations]]:
    """Return AT and RT of every path and condition, and what they come from.

    What the interval of AT holds is the largest distance from the command of the path that the robot takes on average
    over very many cycles, and that of RT the largest mean plus three standard deviations of very many. A largest of
    noisy stations is too large, so both come from simulated campaigns with the covariance of the cycles along the path,
    which say how much (parametric bootstrap of a basic kind, its spread corrected for the few cycles). Fewer than five
    cycles have none.

    Args:
        transform: The instrument's frame in the robot's base, ``(4, 4)``.
        test: ``AT`` or ``AT-reorientation``.
        tie: Standard deviation with which that frame is known at each path's place, of each base axis [m], ``(3,)``;
            None if it is exact.
        tie_rot: Standard deviation with which each angle of that frame is known [rad].
        seed: Of the simulated campaigns.

    Raises:
        InputError: If there are no orientations and the orientation alternates.
    """
    values: list[Value] = []
    of_paths: list[PathDeviations] = []
    suffix = "-reorientation" if test == "AT-reorientation" else ""
    for run in runs_of(plan, samples, transform, test):
        if suffix and samples.rotation is None:
            raise InputError(
                "the samples have no orientations",
                where=f"{samples.source}, line {run.cycles[0].line}",
                allowed=f"columns qw, qx, qy, qz for {test}",
                cure="Measure with an instrument that reads orientations, or leave the test out.",
            )
        rng = np.random.default_rng(seed)
        course = deviations_of(run)
        of_paths.append(course)
        values += _position_values(course, suffix, instrument, tie, rng)
        if course.angles is not None:
            values += _angle_values(course, suffix, instrument, tie_rot, rng)
    return values, of_paths


def deviations_of(run: Run, stations: int = STATIONS) -> PathDeviations:
    """Return the deviations of a run at stations that lie evenly between its ends.

    Stations that some cycle does not reach, because it begins or ends aside along the path, are left out.
    """
    length = run.path.length
    along = (np.arange(stations) + 0.5) / stations * length
    reached = [(float(cycle.along.min()), float(cycle.along.max())) for cycle in run.cycles]
    along = along[(along >= max(low for low, _ in reached)) & (along <= min(high for _, high in reached))]
    rows = [_intersections(cycle, run, along, _HALF * length / stations) for cycle in run.cycles]
    deviation = np.stack([row for row, _, _ in rows])
    angles = None if rows[0][1] is None else np.stack([row for _, row, _ in rows if row is not None])
    pooled = float(np.median(np.concatenate([count for _, _, count in rows])))
    n = len(deviation)
    mean = deviation.mean(axis=0)
    distance = np.linalg.norm(mean, axis=1)
    half = np.full(len(along), np.nan)
    if n > 1:
        from scipy.special import stdtrit

        unit = mean / np.maximum(distance, 1e-12)[:, None]
        of_cycle = (deviation * unit).sum(axis=2)
        half = stdtrit(n - 1, 0.975) * of_cycle.std(axis=0, ddof=1) / np.sqrt(n)
    return PathDeviations(
        run.path.path.name, run, along, deviation, mean, distance, half, _spread(deviation), angles, pooled
    )


def outlying_cycle(course: PathDeviations) -> tuple[int, float, float, float] | None:
    """Return a cycle that is elsewhere as a whole: which, how far [m], and AT and RT without it; None if none is.

    It is four times as far from the middle of the cycles as every other one, root mean square over the stations; of
    five to seven cycles twelve times. Fewer do not tell.
    """
    n = len(course.deviation)
    if n < LEAST_CYCLES:
        return None
    away = course.deviation - np.median(course.deviation, axis=0)
    far = np.sqrt((away**2).sum(axis=2).mean(axis=1))
    order = np.argsort(far)
    worst = int(order[-1])
    if far[worst] <= (_OUTLYING if n >= _FEW else _OUTLYING_OF_FEW) * far[order[-2]]:
        return None
    others = np.delete(course.deviation, worst, axis=0)
    return (
        worst,
        float(far[worst]),
        float(np.linalg.norm(others.mean(axis=0), axis=1).max()),
        float(_spread(others).max()),
    )


def _middle(along: Array, length: float) -> Array:
    """Return the arc lengths of samples that do not stand at an end of the path [m]."""
    return along[(along > 0.05 * length) & (along < 0.95 * length)]


def _spread(deviation: Array) -> Array:
    """Return mean distance to the barycentre plus three standard deviations of cycles ``(..., n, m, 3)``."""
    n = deviation.shape[-3]
    if n < 2:
        return np.full((*deviation.shape[:-3], deviation.shape[-2]), np.nan)
    away = np.sqrt(((deviation - deviation.mean(axis=-3, keepdims=True)) ** 2).sum(axis=-1))
    return np.asarray(away.mean(axis=-2) + 3 * away.std(axis=-2, ddof=1))


def _intersections(cycle: Cycle, run: Run, along: Array, half: float) -> tuple[Array, Array | None, Array]:
    """Return deviations at stations, ``(m, 3)``, of position [m] and of orientation [rad], and samples for each.

    The foot of a point on the path lies at a station if the point lies in the plane there, so that an intersection is
    the deviation interpolated at that arc length.
    """
    order = np.argsort(cycle.along, kind="stable")
    s = cycle.along[order]
    tangent = run.path.tangents(s)
    away = cycle.position[order] - run.path.points(s)
    away -= (away * tangent).sum(axis=1)[:, None] * tangent
    columns = away
    if cycle.rotation is not None:
        turned = rotation_vector(cycle.rotation[order] @ np.swapaxes(run.path.rotations(s), 1, 2))
        columns = np.concatenate([away, turned], axis=1)
    intersections, _, count = local_lines(s, columns, along, half)
    return intersections[:, :3], intersections[:, 3:] if cycle.rotation is not None else None, np.maximum(count, 1.0)


def _position_values(
    course: PathDeviations, suffix: str, instrument: Instrument, tie: Array | None, rng: np.random.Generator
) -> list[Value]:
    run = course.run
    n = len(course.deviation)
    accuracy = float(course.distance.max())
    sigma = instrument.sigma / np.sqrt(course.pooled)
    known = 0.0 if tie is None else float(np.linalg.norm(tie) / np.sqrt(3.0))
    values = [
        Value(
            f"AT{suffix}",
            "position",
            course.path,
            accuracy,
            "length",
            _accuracy_interval(course.deviation, tie, rng) if n >= LEAST_CYCLES else None,
            n,
            run.conditions,
            run.status(coarse=course.sparse or np.hypot(sigma / np.sqrt(n), known) > COARSE * accuracy),
        )
    ]
    repeatability = float(course.spread.max())
    values.append(
        Value(
            f"RT{suffix}",
            "position",
            course.path,
            repeatability,
            "length",
            _repeatability_interval(course.deviation, repeatability, rng, factor=None) if n >= LEAST_CYCLES else None,
            n,
            run.conditions,
            run.status(coarse=course.sparse or sigma > COARSE * repeatability) if n > 1 else "not-measured",
        )
    )
    return values


def _angle_values(
    course: PathDeviations, suffix: str, instrument: Instrument, tie_rot: float, rng: np.random.Generator
) -> list[Value]:
    run = course.run
    values = []
    assert course.angles is not None
    sigma = (instrument.sigma_rot or 0.0) / np.sqrt(course.pooled)
    for axis, component in enumerate(_ANGLES):
        angle = course.angles[:, :, axis : axis + 1]
        n = len(angle)
        accuracy = float(np.abs(angle.mean(axis=0)).max())
        values.append(
            Value(
                f"AT{suffix}",
                component,
                course.path,
                accuracy,
                "angle",
                _accuracy_interval(angle, np.array([tie_rot]) if tie_rot else None, rng) if n >= LEAST_CYCLES else None,
                n,
                run.conditions,
                run.status(coarse=course.sparse or np.hypot(sigma / np.sqrt(n), tie_rot) > COARSE * accuracy),
            )
        )
        spread = 3 * float(angle.std(axis=0, ddof=1).max()) if n > 1 else np.nan
        values.append(
            Value(
                f"RT{suffix}",
                component,
                course.path,
                spread,
                "angle",
                _repeatability_interval(angle, spread, rng, factor=3.0) if n >= LEAST_CYCLES else None,
                n,
                run.conditions,
                run.status(coarse=course.sparse or sigma > COARSE * spread) if n > 1 else "not-measured",
            )
        )
    return values


def _accuracy_interval(deviation: Array, tie: Array | None, rng: np.random.Generator) -> tuple[float, float]:
    """Return the interval of the largest distance of the mean path from the command, of cycles ``(n, m, d)``.

    Errors of the mean path are drawn with the covariance of the cycles along it, each campaign with a covariance that
    n cycles might show (scaled inverse chi-square, which is Student's t at every station), and set upon the mean path
    shrunk by what noise adds to its square: the lower end is the estimate less what noise then adds to the largest,
    and 0 where errors alone give as much.
    The upper end is the largest over stations of the upper end of each for itself, Student's t in the direction in
    which cycles scatter most: it lies above the truth if that at the station with the largest true distance does.
    """
    from scipy.special import ndtri, stdtrit

    n, m, d = deviation.shape
    mean = deviation.mean(axis=0)
    residual = (deviation - mean).reshape(n, m * d)
    weight = rng.standard_normal((_TRIALS, n)) / np.sqrt(n * (n - 1))
    inflation = np.sqrt((n - 1) / rng.chisquare(n - 1, _TRIALS))
    error = (weight @ residual).reshape(_TRIALS, m, d) * inflation[:, None, None]
    if tie is not None:
        error = error + (rng.standard_normal((_TRIALS, d)) * tie)[:, None, :]
    distance = np.linalg.norm(mean, axis=1)
    added = (deviation.var(axis=0, ddof=1) / n).sum(axis=1)
    share = np.sqrt(np.maximum(distance**2 - added, 0.0)) / np.maximum(distance, 1e-15)
    centre = mean * share[:, None]
    true = float(np.linalg.norm(centre, axis=1).max())
    largest = np.linalg.norm(centre + error, axis=2).max(axis=1)
    estimate = float(distance.max())
    low = estimate - float(np.quantile(largest - true, 0.975))
    if estimate <= float(np.quantile(np.linalg.norm(error, axis=2).max(axis=1), 0.975)):
        low = 0.0
    away = residual.reshape(n, m, d)
    scatter = np.einsum("nmi,nmj->mij", away, away) / (n * (n - 1))
    half = stdtrit(n - 1, 0.975) * np.sqrt(np.maximum(np.linalg.eigvalsh(scatter)[:, -1], 0.0))
    if tie is not None:
        half = np.hypot(half, ndtri(0.975) * float(np.max(tie)))
    return max(low, 0.0), float((distance + half).max())


def _repeatability_interval(
    deviation: Array, estimate: float, rng: np.random.Generator, factor: float | None
) -> tuple[float, float]:
    """Return the interval of the largest spread over stations, of cycles ``(n, m, d)``.

    Campaigns are drawn with the covariance of the cycles along the path; the ratio of what they give to what very many
    cycles of that covariance give is taken to be that of the estimate to the truth.

    Args:
        factor: Times the standard deviation is the spread, of an angle; None for the mean plus three of the distance.
    """
    n, m, d = deviation.shape
    residual = (deviation - deviation.mean(axis=0)).reshape(n, m * d) / np.sqrt(n - 1)
    ratios = []
    if factor is None:
        many = (rng.standard_normal((_DRAWS, n)) @ residual).reshape(_DRAWS, m, d)
        away = np.linalg.norm(many, axis=2)
        true = float((away.mean(axis=0) + 3 * away.std(axis=0)).max())
    else:
        true = factor * float(np.sqrt((residual**2).sum(axis=0)).max())
    if true <= 0.0:
        return estimate, estimate
    for _ in range(4):
        drawn = (rng.standard_normal((_TRIALS // 4, n, n)) @ residual).reshape(_TRIALS // 4, n, m, d)
        spread = _spread(drawn) if factor is None else factor * drawn[..., 0].std(axis=1, ddof=1)
        ratios.append(spread.max(axis=1) / true)
    low, high = np.quantile(np.concatenate(ratios), [0.025, 0.975])
    return estimate / float(high), estimate / float(low)
