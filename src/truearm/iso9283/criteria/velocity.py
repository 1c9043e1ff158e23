"""Path velocity accuracy AV, repeatability RV and fluctuation FV.

Over the middle half of the path: AV is the mean velocity over all cycles minus the commanded one, and RV three times
the standard deviation over cycles (n - 1) of the mean velocity of a cycle, both as shares of the commanded velocity. FV
is the largest over cycles of the largest minus the least velocity of a cycle (the issue's table and the literature on
ISO 9283; the standard's text was not at hand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.intervals import LEAST_CYCLES
from truearm.iso9283.criteria.rows import COARSE, Instrument, Value
from truearm.iso9283.criteria.runs import Run, runs_of
from truearm.iso9283.criteria.streams import Cycle, FoundStream, local_lines
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Samples

#: The part of the path over which velocity is judged.
_MIDDLE = (0.25, 0.75)
#: Of a swing with a frequency of this share of one over the window, smoothing and the time between two samples leave
#: this share or more.
_BANDWIDTH, _SWING_LEFT = 0.325, 0.88
#: Noise may be this share of the commanded velocity, if a window of at most this share of the middle half does it.
_QUIET, _LONGEST_WINDOW = 0.002, 0.05
#: Excess kurtosis that the cycles' velocities may have: with it the interval of RV is a third wider than that of
#: Gaussian cycles, and holds for others too.
_KURTOSIS = 1.1
#: Standard normal samples from which the factors of FV's interval come.
_DRAWS = 20_000


@dataclass(frozen=True, eq=False)
class VelocityCurves:
    """Velocity along a path, for pictures.

    Attributes:
        path, conditions: Name, and in words of the run it belongs to.
    """

    path: str
    run: Run
    commanded: float  #: [m/s].
    middle: tuple[float, float]  #: Between which arc lengths it is judged [m].
    window: Array  #: Over which time it is smoothed [s], of each cycle, ``(cycles,)``.
    #: time, along, velocity: of each cycle: since its first sample [s], arc length [m], velocity along the path [m/s].
    time: tuple[Array, ...]
    along: tuple[Array, ...]
    velocity: tuple[Array, ...]
    mean: Array  #: Of each cycle over the middle half [m/s], ``(cycles,)``.
    least: Array  #: least, largest: of each cycle there [m/s], ``(cycles,)``.
    largest: Array
    noise: Array  #: Standard deviation of the velocity that the instrument alone gives [m/s], ``(cycles,)``.
    stream: FoundStream | None  #: What was found in the stream, if it was one.

    @property
    def bandwidth(self) -> float:
        """Frequency up to which the fluctuation is told [Hz]."""
        return float(_BANDWIDTH / self.window.max())


def velocity_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[VelocityCurves]]:
    """Return AV, RV and FV of every path and condition, and what they come from.

    Intervals: of AV by Student's t, of RV by chi-square with the degrees of freedom that a variance has whose samples
    have an excess kurtosis of 1.1, of the cycles' mean velocities. That of FV
    is of the expected largest range among so many cycles, by pivots of Gaussian ranges; noise widens every range, so
    that the lower end is less what noise alone may give. Smoothing narrows it: the upper end is higher by what it takes
    from a swing of the highest frequency that is told, and what fluctuates faster is not in FV. FV of which that noise
    is more than a quarter, and AV and RV of which the noise of a cycle's mean is more than a quarter of RV, are
    ``instrument-too-coarse``. Fewer than five cycles have no intervals.

    Args:
        transform: The instrument's frame in the robot's base, ``(4, 4)``.
    """
    values: list[Value] = []
    curves: list[VelocityCurves] = []
    for run in runs_of(plan, samples, transform, "AV"):
        curve = _curves(run, instrument)
        values += _values(curve, instrument)
        curves.append(curve)
    return values, curves


def _curves(run: Run, instrument: Instrument) -> VelocityCurves:
    length = run.path.length
    middle = (_MIDDLE[0] * length, _MIDDLE[1] * length)
    rows = [_cycle(cycle, middle, run.velocity, instrument.sigma) for cycle in run.cycles]
    windows, times, alongs, velocities, means, ranges, noises = zip(*rows, strict=True)
    return VelocityCurves(
        run.path.path.name,
        run,
        run.velocity,
        middle,
        np.array(windows),
        times,
        alongs,
        velocities,
        np.array(means),
        np.array([low for low, _ in ranges]),
        np.array([high for _, high in ranges]),
        np.array(noises),
        run.stream,
    )


def _cycle(
    cycle: Cycle, middle: tuple[float, float], commanded: float, sigma: float
) -> tuple[float, Array, Array, Array, float, tuple[float, float], float]:
    """Return window, time, arc length, velocity, mean, range and noise of a cycle.

    The window is the shortest with five samples whose noise is 0.2 % of the commanded velocity, and at most 5 % of the
    time that the middle half takes: a swing of that period or less is flattened out with the noise.
    """
    time = cycle.time - cycle.time[0]
    step = float(np.median(np.diff(time)))
    sigma = float(np.hypot(sigma, commanded * cycle.clock.sigma))
    longest = max(_LONGEST_WINDOW * (middle[1] - middle[0]) / commanded, 5 * step)
    # of a least-squares slope over T with samples every dt: sigma sqrt(12 dt / T^3)
    wanted = (12.0 * step * (sigma / (_QUIET * commanded)) ** 2) ** (1 / 3)
    window = float(np.clip(wanted, 5 * step, longest))
    along, velocity, _ = local_lines(time, cycle.along[:, None], time, window / 2)
    along, velocity = along[:, 0], velocity[:, 0]
    run = np.maximum.accumulate(along)
    ends = [float(np.interp(place, run, time)) for place in middle]
    inside = (time >= ends[0]) & (time <= ends[1])
    mean = (middle[1] - middle[0]) / max(ends[1] - ends[0], step)
    in_middle = velocity[inside] if inside.any() else np.array([mean])
    noise = sigma * np.sqrt(12.0 * step / window**3)
    return window, time, along, velocity, mean, (float(in_middle.min()), float(in_middle.max())), float(noise)


def _values(curve: VelocityCurves, instrument: Instrument) -> list[Value]:
    from scipy.special import gammaincinv, stdtrit

    run, v = curve.run, curve.commanded
    n = len(curve.mean)
    accuracy = float(curve.mean.mean() - v) / v
    spread = float(curve.mean.std(ddof=1)) if n > 1 else np.nan
    ranges = curve.largest - curve.least
    fluctuation = float(ranges.max())
    # the ends of the middle half are read with the noise of a smoothed position
    step = float(np.median(np.diff(curve.time[0])))
    clocks = [cycle.clock for cycle in run.cycles]
    sigma = float(np.hypot(instrument.sigma, v * max(clock.sigma for clock in clocks)))
    ends = sigma * np.sqrt(2.0 * min(1.0, step / float(curve.window.mean())))
    pace = max(clock.pace for clock in clocks)
    noise_of_mean = v * float(np.hypot(ends / (curve.middle[1] - curve.middle[0]), pace))
    coarse = n > 1 and 3 * noise_of_mean > COARSE * max(3 * spread, 1e-300)
    independent = max((curve.middle[1] - curve.middle[0]) / v / float(curve.window.mean()), 2.0)
    noise_range = float(2.0 * curve.noise.mean() * np.sqrt(2.0 * np.log(independent * max(n, 1))))
    coarse_range = noise_range > COARSE * fluctuation
    enough = n >= LEAST_CYCLES
    if enough:
        half = float(stdtrit(n - 1, 0.975) * spread / np.sqrt(n) / v)
        interval_av = (accuracy - half, accuracy + half)
        degrees = 2.0 / (2.0 / (n - 1) + _KURTOSIS / n)
        low, high = (float(np.sqrt(0.5 * degrees / gammaincinv(0.5 * degrees, p))) for p in (0.975, 0.025))
        interval_rv = (3 * spread / v * low, 3 * spread / v * high)
        few, many = _largest_of(ranges)
        interval_fv = (max(few - noise_range, 0.0), many / _SWING_LEFT)
    return [
        Value(
            "AV",
            "position",
            curve.path,
            accuracy,
            "ratio",
            interval_av if enough else None,
            n,
            run.conditions,
            run.status(coarse=noise_of_mean / np.sqrt(n) > COARSE * max(abs(accuracy) * v, 2 * spread if n > 1 else 0)),
        ),
        Value(
            "RV",
            "position",
            curve.path,
            3 * spread / v,
            "ratio",
            interval_rv if enough else None,
            n,
            run.conditions,
            run.status(coarse=coarse) if n > 1 else "not-measured",
        ),
        Value(
            "FV",
            "position",
            curve.path,
            fluctuation,
            "speed",
            interval_fv if enough else None,
            n,
            run.conditions,
            run.status(coarse=coarse_range),
            float(ranges.min()),
            fluctuation,
            curve.bandwidth,
        ),
    ]


def _largest_of(ranges: Array) -> tuple[float, float]:
    """Return 95 % limits of the expected largest of as many Gaussian numbers as there are.

    With mean m and standard deviation s of n of them, (E - m) / s does not depend on their mean and deviation; its
    quantiles are those of standard normal numbers.
    """
    n = len(ranges)
    drawn = np.random.default_rng(9283).standard_normal((_DRAWS, n))
    expected = float(drawn.max(axis=1).mean())
    pivot = (expected - drawn.mean(axis=1)) / drawn.std(axis=1, ddof=1)
    low, high = np.quantile(pivot, [0.025, 0.975])
    spread = float(ranges.std(ddof=1))
    return float(ranges.mean() + low * spread), float(ranges.mean() + high * spread)
