"""Intervals of 95 % for means, spreads, norms and largest values of a few cycles.

The standard has none. What an interval is meant to hold (the estimand) is what the criterion would be after infinitely
many cycles under the same conditions, scatter of the instrument included:

- AP: the distance of the true mean pose from the command. RP: ``E l + 3 SD l``, l the distance from the true mean pose.
- AD: mean distance minus the commanded one. RD and RP of an angle: 3 SD.
- vAP, E, dAP and dRP: the largest difference of the true ones, among those that were measured.

Norms and largest values are biased upward: scatter alone gives a perfect robot an AP above zero. A bootstrap draws its
samples about the barycentre that is already too far away, and takes its percentiles for an interval, which then hardly
ever holds the zero of a perfect robot. Here such criteria are inverted tests, which know the bias: the interval holds
all values under which an estimate as large, or as small, as the one found is not too rare. Barycentres scatter about
their true places by a multivariate t distribution, with the scatter of the cycles as its scale. Where zero is not too
rare the interval begins at zero, and is an upper bound alone. The test that gives the upper end is divided by the
chance of so small an estimate at zero, as Read (2002) does for signals near a background, so that an estimate that is
small by luck does not give an interval that is empty.

These tests are in :mod:`truearm.validation.iso9283.inverted_tests`.

RP has no bias to speak of, but its scatter depends on the distribution, half as large for a uniform ball as for a
Gaussian. So the logarithm of RP is divided by its standard error, from the influence of each cycle (Efron and
Tibshirani 1993, chapter 21), and the quotient is compared with that of simulated Gaussian campaigns with the
covariance that was found.

How often the intervals hold was measured: ``benchmarks/iso9283_coverage.py``.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np

from truearm.modeling.chain import Array

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
    true, found, errors = _gaussian_campaigns(centred, n)
    quotient = np.sort((found - true) / errors)
    low, high = np.quantile(quotient, (TAIL, 1.0 - TAIL))
    own = max(float(error), _LEAST_ERROR * float(np.median(errors)))
    return math.exp(float(value) - float(high) * own), math.exp(float(value) - float(low) * own)


def repeatability_scatter(points: Array, cycles: int) -> Array:
    """Return RP of simulated groups of cycles over the true one, for a Gaussian with the covariance of points.

    Args:
        points: About their barycentre, ``(n, 3)``.
        cycles: Of a group, 2 or more.
    """
    true, found, _ = _gaussian_campaigns(points, cycles)
    return np.asarray(np.exp(found - true))


def _gaussian_campaigns(centred: Array, cycles: int) -> tuple[float, Array, Array]:
    """Return log RP of a Gaussian with the covariance of points, those of simulated campaigns, and their errors."""
    variances = np.maximum(np.linalg.eigvalsh(centred.T @ centred), 0.0)
    variances /= variances.sum()
    squares, many = _squares(cycles)
    length = np.sqrt(many @ variances)
    true = math.log(float(length.mean() + 3.0 * length.std()))
    found, errors = _log_of_distances(np.sqrt(squares @ variances))
    return true, found, errors


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
