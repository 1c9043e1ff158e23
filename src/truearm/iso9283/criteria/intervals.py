"""Intervals of 95 % for means, spreads, norms and largest values of a few cycles.

The standard has none. What an interval is meant to hold (the estimand) is what the criterion would be after
infinitely many cycles under the same conditions, scatter of the instrument included:

- AP: the distance of the true mean pose from the command. RP: ``E l + 3 SD l``, l the distance from the true mean.
- AD: mean distance minus the commanded one. RD and RP of an angle: 3 SD.
- vAP, E, dAP and dRP: the largest difference of the true ones, among those that were measured.

Norms and largest values are biased upward: scatter alone gives a perfect robot an AP above zero. A bootstrap draws
its samples about the barycentre that is already too far away, and takes its percentiles for an interval, which then
hardly ever holds the zero of a perfect robot. Here such criteria are inverted tests, which know the bias: the
interval holds all values under which an estimate as large, or as small, as the one found is not too rare. Barycentres
scatter about their true places by a multivariate t distribution, with the scatter of the cycles as its scale. Where
zero is not too rare the interval begins at zero, and is an upper bound alone. The test that gives the upper end is
divided by the chance of so small an estimate at zero, as Read (2002) does for signals near a background, so that an
estimate that is small by luck does not give an interval that is empty.

RP has no bias to speak of, but its scatter depends on the distribution, half as large for a uniform ball as for a
Gaussian. So the logarithm of RP is divided by its standard error, from the influence of each cycle (Efron and
Tibshirani 1993, chapter 21), and the quotient is compared with that of simulated Gaussian campaigns with the
covariance that was found.

How often the intervals hold was measured: ``benchmarks/iso9283_coverage.py``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array

#: Fewer cycles say too little of their own scatter for an interval.
LEAST_CYCLES: Final = 5
#: What may lie beyond either end.
TAIL: Final = 0.025
#: Campaigns simulated for RP.
_CAMPAIGNS: Final = 8000
#: The standard error of RP is at least this share of a Gaussian's: cycles on a circle have none.
_LEAST_ERROR: Final = 0.4

Interval = tuple[float, float]


def mean_interval(values: Array, known_variance: float = 0.0) -> Interval | None:
    """Return the interval of the mean of a number's distribution, from its values in a few cycles.

    Student's t; where the mean is also off by something common to all cycles, whose variance is known, the degrees of
    freedom are those of Welch and Satterthwaite.

    Args:
        values: ``(n,)``.
        known_variance: Of what all have in common.

    Returns:
        tuple or None: None for fewer than :data:`LEAST_CYCLES` values.
    """
    from scipy.special import stdtrit

    n = len(values)
    if n < LEAST_CYCLES:
        return None
    variance = float(values.var(ddof=1)) / n
    whole = variance + known_variance
    # Of a variance of zero any degrees of freedom do.
    freedom = (n - 1) * (whole / variance) ** 2 if variance > 0 else 1e9
    half = float(stdtrit(freedom, 1.0 - TAIL)) * math.sqrt(whole)
    mean = float(values.mean())
    return mean - half, mean + half


def spread_interval(deviation: float, cycles: int) -> Interval | None:
    """Return the interval of ``3 SD`` of a number, from its standard deviation S with n - 1.

    Chi-square: exact for a Gaussian, too wide for what has shorter tails. None for fewer than :data:`LEAST_CYCLES`
    cycles or no scatter at all.
    """
    from scipy.special import gammaincinv

    if cycles < LEAST_CYCLES or not deviation > 0:
        return None
    low, high = (2.0 * float(gammaincinv(0.5 * (cycles - 1), share)) for share in (TAIL, 1.0 - TAIL))
    return 3.0 * deviation * math.sqrt((cycles - 1) / high), 3.0 * deviation * math.sqrt((cycles - 1) / low)


def repeatability(points: Array) -> Array:
    """Return ``mean l + 3 S``, l the distances of points from their barycentre, S with n - 1.

    The formula is that of Nubiola (section 2.6) for ISO 9283; the standard's text was not at hand.

    Args:
        points: ``(..., n, 3)``.

    Returns:
        Array: ``(...,)``.
    """
    distance = np.linalg.norm(points - points.mean(axis=-2, keepdims=True), axis=-1)
    return np.asarray(distance.mean(axis=-1) + 3.0 * distance.std(axis=-1, ddof=1))


def repeatability_interval(points: Array) -> Interval | None:
    """Return the interval of RP from the poses of a few cycles, ``(n, 3)``.

    None for fewer than :data:`LEAST_CYCLES` cycles or no scatter at all.
    """
    n = len(points)
    if n < LEAST_CYCLES:
        return None
    centred = points - points.mean(axis=0)
    value, error = _log_of_distances(np.linalg.norm(centred, axis=1))
    if not math.exp(float(value)) > 0:
        return None
    true, simulated, errors = _gaussian_campaigns(centred, n)
    quotient = np.sort((simulated - true) / errors)
    low, high = np.quantile(quotient, (TAIL, 1.0 - TAIL))
    own = max(float(error), _LEAST_ERROR * float(np.median(errors)))
    return math.exp(float(value) - float(high) * own), math.exp(float(value) - float(low) * own)


def repeatability_scatter(points: Array, cycles: int) -> Array:
    """Return RP of simulated groups of cycles over the true one, for a Gaussian with the covariance of points.

    Args:
        points: About their barycentre, ``(n, 3)``.
        cycles: Of a group, 2 or more.
    """
    true, simulated, _ = _gaussian_campaigns(points, cycles)
    return np.asarray(np.exp(simulated - true))


def _gaussian_campaigns(centred: Array, cycles: int) -> tuple[float, Array, Array]:
    """Return log RP of a Gaussian with the covariance of points, those of simulated campaigns, and their errors."""
    variances = np.maximum(np.linalg.eigvalsh(centred.T @ centred), 0.0)
    variances /= variances.sum()
    squares, many = _squares(cycles)
    length = np.sqrt(many @ variances)
    true = math.log(float(length.mean() + 3.0 * length.std()))
    simulated, errors = _log_of_distances(np.sqrt(squares @ variances))
    return true, simulated, errors


@lru_cache(maxsize=8)
def _squares(cycles: int) -> tuple[Array, Array]:
    """Return squares of standard normal numbers about the mean of each campaign, and of very many about zero."""
    rng = np.random.default_rng(9283)
    drawn = rng.standard_normal((_CAMPAIGNS, cycles, 3))
    return (drawn - drawn.mean(axis=1, keepdims=True)) ** 2, rng.standard_normal((100_000, 3)) ** 2


def _log_of_distances(distance: Array) -> tuple[Array, Array]:
    """Return log RP from distances ``(..., n)``, and its standard error from the influence of each."""
    n = distance.shape[-1]
    mean = distance.mean(axis=-1, keepdims=True)
    away = distance - mean
    deviation = np.sqrt((away**2).sum(axis=-1, keepdims=True) / (n - 1))
    value = (mean + 3.0 * deviation)[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        influence = away + 1.5 * np.where(deviation > 0, (away**2 - deviation**2) / deviation, 0.0)
        error = np.sqrt((influence**2).sum(axis=-1) / (n * (n - 1))) / value
        return np.log(value), error


#: Barycentres simulated for a test.
_DRAWS: Final = 2000
#: Values of a norm that are tested; between them the test is interpolated.
_TESTED: Final = 80
#: Halvings that find an end of other intervals, to 1e-6 of what is searched, and Lagrange's factor of a norm.
_HALVINGS: Final = 20
_HALVINGS_FACTOR: Final = 60

#: What may lie below the lower end of a largest difference: places that seem apart by scatter make it too high, so that
#: it would be missed twice as often.
_TAIL_BELOW: Final = 0.5 * TAIL

Statistic = Callable[[Array], Array]


def norm_interval(mean: Array, covariance: Array, cycles: int, known: Array) -> Interval | None:
    """Return the interval of the norm of the true mean, from the mean of a few cycles.

    Under each value to be tested the true mean is the place of that norm that is likeliest, the nearest to the mean in
    the metric of its scatter, as in a profile likelihood; about it the mean is simulated.

    Args:
        mean: ``(d,)``.
        covariance: Of the cycles with n - 1, ``(d, d)``.
        cycles: Two or more.
        known: Covariance of what all cycles share, ``(d, d)``.

    Returns:
        tuple or None: From zero where zero cannot be ruled out. None if nothing scatters.
    """
    variances, axes = np.linalg.eigh(covariance / cycles + known)
    if not variances[-1] > 0:
        return None
    axes = axes * np.where(mean @ axes < 0, -1.0, 1.0)  # so that no frame draws another noise
    noise = barycentre_scatter(axes.T @ covariance @ axes, cycles, axes.T @ known @ axes, 0)
    squares = (noise**2).sum(axis=1)
    norm = float(np.linalg.norm(mean))
    span = float(np.sqrt(squares.max()))
    tested = np.linspace(max(0.0, norm - span), norm + span, _TESTED)
    places = _likeliest(axes.T @ mean, np.maximum(variances, 1e-9 * variances[-1]), tested)
    squared_norms = tested[:, None] ** 2 + 2.0 * places @ noise.T + squares
    share_below = np.minimum.accumulate((squared_norms <= norm**2).mean(axis=1))
    at_zero = float(np.mean(squares <= norm**2))
    upper = float(np.interp(-TAIL * max(at_zero, 1.0 / _DRAWS), -share_below, tested))
    if at_zero <= 1.0 - TAIL:
        return 0.0, max(upper, norm)
    return float(np.interp(TAIL - 1.0, -share_below, tested)), upper


def _likeliest(mean: Array, variances: Array, norms: Array) -> Array:
    """Return the places of these norms ``(k,)`` that are nearest to a mean in the metric of its variances, ``(k, d)``.

    They are ``mean / (1 + f variance)`` axis by axis with Lagrange's factor f, of which the norm falls.
    """
    lowest = 1.0 / float(variances.max())
    low, high = np.full(len(norms), -lowest), np.full(len(norms), lowest)

    squares = norms**2

    def too_long(factor: Array) -> Array:
        return np.asarray(((mean / (1.0 + factor[:, None] * variances)) ** 2).sum(axis=1) > squares)

    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_HALVINGS_FACTOR):
            long = too_long(high)
            if not long.any():
                break
            high = np.where(long, 4.0 * high, high)
        for _ in range(_HALVINGS_FACTOR):
            middle = 0.5 * (low + high)
            long = too_long(middle)
            low, high = np.where(long, middle, low), np.where(long, high, middle)
    place = mean / np.maximum(1.0 + high[:, None] * variances, 1e-12)
    size = np.linalg.norm(place, axis=1)
    return np.asarray(place * np.where(size > 0, norms / np.where(size > 0, size, 1.0), 0.0)[:, None])


def largest_interval(statistic: Statistic, places: Array, noise: Array, other: Array) -> Interval | None:
    """Return the interval of a largest difference between places.

    For each value to be tested the true places differ by as much, with a shape that is drawn from what the measured
    places leave open; they scatter, and the statistic of the scattered ones is compared with that of the measured.

    Args:
        statistic: Of places ``(m, ...)``, ``(m,)``: never negative, and k times as large for places k times as large.
        places: The measured places, ``(...)``.
        noise, other: Two drawings of how the places scatter, ``(m, ...)``.

    Returns:
        tuple or None: From zero where zero cannot be ruled out. None if nothing scatters.
    """
    value = float(statistic(places[None])[0])
    scale = float(statistic(noise).max())
    if not scale > 0:
        return None
    shapes = places[None] + other
    shapes = shapes / statistic(shapes).reshape(-1, *(1,) * places.ndim)

    def share_below(tested: float) -> float:
        return float(np.mean(statistic(tested * shapes + noise) <= value))

    at_zero = share_below(0.0)
    upper = _crossing(share_below, TAIL * max(at_zero, 1.0 / _DRAWS), value, value + scale)
    if at_zero <= 1.0 - _TAIL_BELOW:
        return 0.0, upper
    return _crossing(share_below, 1.0 - _TAIL_BELOW, max(0.0, value - scale), value), upper


def _crossing(falling: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Return where a function that falls comes down to a level."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if falling(middle) > level:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def barycentre_scatter(covariance: Array, cycles: int, known: Array | None, stream: int) -> Array:
    """Return how a barycentre may lie beside the true mean, drawn: multivariate t, and what all cycles share.

    Args:
        covariance: Of the cycles with n - 1, ``(d, d)`` with d up to 3.
        cycles: Two or more.
        known: Covariance of what all cycles share, ``(d, d)``; None for nothing.
        stream: Which drawing: one number for each barycentre, and each use.

    Returns:
        Array: ``(m, d)``.
    """
    d = len(covariance)
    drawn, _ = _drawn(stream)
    scale = _scale(stream, cycles)
    scatter = scale[:, None] * (drawn[:, :d] @ _root(covariance / cycles).T)
    if known is not None:
        scatter = scatter + drawn[:, 3 : 3 + d] @ _root(known).T
    return np.asarray(scatter)


@lru_cache(maxsize=256)
def _drawn(stream: int) -> tuple[Array, Array]:
    """Return standard normal numbers ``(m, 6)``, and evenly spread ones between 0 and 1, ``(m,)``."""
    rng = np.random.default_rng((9283, stream))
    return rng.standard_normal((_DRAWS, 6)), rng.random(_DRAWS)


@lru_cache(maxsize=256)
def _scale(stream: int, cycles: int) -> Array:
    """Return roots of degrees of freedom over chi-square, drawn, ``(m,)``: what makes a Gaussian a multivariate t."""
    from scipy.special import gammaincinv

    freedom = cycles - 1
    return np.asarray(np.sqrt(0.5 * freedom / gammaincinv(0.5 * freedom, _drawn(stream)[1])))


def _root(covariance: Array) -> Array:
    """Return the symmetric square root of a covariance, which may be singular, ``(d, d)``."""
    variances, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.sqrt(np.maximum(variances, 0.0))) @ axes.T)


def largest_difference(places: Sequence[Array], pairs: Sequence[tuple[int, int]]) -> tuple[float, Interval | None]:
    """Return the largest distance between barycentres, and its interval.

    Args:
        places: The cycles at each place, ``(n, d)``.
        pairs: Between which places, one pair or more.

    Returns:
        tuple: The interval is None where a place has fewer than :data:`LEAST_CYCLES` cycles, or nothing scatters.
    """
    first, second = np.array(pairs, dtype=np.intp).T
    barycentres = np.array([place.mean(axis=0) for place in places])

    def largest(simulated: Array) -> Array:
        return np.asarray(np.linalg.norm(simulated[:, first] - simulated[:, second], axis=-1).max(axis=-1))

    value = float(largest(barycentres[None])[0])
    if min(map(len, places)) < LEAST_CYCLES:
        return value, None
    covariances = [np.atleast_2d(np.cov(place.T)) for place in places]
    noise, shapes = (
        np.stack(
            [
                barycentre_scatter(covariance, len(place), None, 2 * k + draw)
                for k, (covariance, place) in enumerate(zip(covariances, places, strict=True))
            ],
            axis=1,
        )
        for draw in (1, 2)
    )
    return value, largest_interval(largest, barycentres - barycentres.mean(axis=0), noise, shapes)
