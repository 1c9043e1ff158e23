"""What a fit with joint curves is off by, where variances of the curves were found from the same data.

Likeliest variances are too sure of themselves. What the data do not tell comes out as zero, and the geometry that takes
its place counts as known. So the covariance is that of other variances. Terms that stand out keep theirs. The rest of a
band, which has the level of noise, is taken so many times larger or smaller as the likelihood expects (integrated over
a grid). A term that the data could not tell is expected to be of the size that the same number of periods, and its
neighbours, have in the joints where they could: with the probability p that there is a line at all, and of the line's
size (George and McCulloch 1993, "Variable selection via Gibbs sampling"). The probability that a line is there although
none was seen is ``p (1 - k) / (p (1 - k) + 1 - p)`` with k the share that the data know of a line. Where no joint
tells, the prior of the effect holds, and falls as one by the number of periods.

With those variances the parameters have a posterior of their own. The covariance returned is its covariance and the
square of the difference of its mean from what was fitted: the mean squared error of the fitted values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.curve_stiffness import BANDS, Marginal, equations_of, moments_without
from truearm.modeling.chain import Array
from truearm.modeling.effects.joint_curve import PRIOR

#: What the level of a band without lines may be times the likeliest one.
_LEVELS: Final = (0.03, 0.1, 0.3, 1.0, 3.0)
#: Times the level of its band, or the median of its joint, above which a variance is that of a line.
_ABOVE_BAND: Final = 4.0
_ABOVE_JOINT: Final = 100.0
#: Terms that what is believed of a band beforehand counts for, and the band for each of its numbers of periods.
_BELIEVED: Final = 4.0
_BELIEVED_OF_BAND: Final = 2.0
#: Probability of a line beforehand, above two periods. At one and two, where encoders err, there is one.
_PROBABLE: Final = 0.1
_LEAST_PROBABLE: Final = 0.02
#: Only what the data know well counts as told: the share is taken to this power.
_WELL: Final = 3
_ROUNDS: Final = 3
#: Share of the variance of the readings that all coefficients which are left out may move them by together.
_NEGLIGIBLE: Final = 1e-3
#: Variance of a coefficient that is certain [rad^2].
_CERTAIN: Final = 1e-22


@dataclass(frozen=True, eq=False)
class CurveMoments:
    """Products of all equations at a solution."""

    #: Of the derivatives by the other parameters, per prior, by the coefficients [1/rad], and of the right side,
    #: ``(others + coefficients + 1, others + coefficients + 1)``.
    moments: Array
    rows: float  #: How many equations there are.
    #: How far the solution is from the priors' centre: the others per prior, coefficients [rad], ``(others +
    #: coefficients,)``.
    away: Array
    joint: NDArray[np.intp]  #: joint, period: of each coefficient.
    period: NDArray[np.intp]
    size: Array  #: Sum over the equations of the square of their derivative by each joint [1/rad^2], ``(joints,)``.


def expected_variances(of: CurveMoments, likeliest: Array) -> Array:
    """Return what the variance of each coefficient is expected to be [rad^2], ``(coefficients,)``.

    Args:
        likeliest: The variances with the largest likelihood, ``(coefficients,)``.
    """
    left = moments_without(of.moments, len(of.away) - len(likeliest))
    band = np.searchsorted(BANDS, of.period, side="right")
    quiet, line = _quiet(likeliest, of.joint, band)
    equations = equations_of(left, of.rows)
    heights = [Marginal(equations, np.where(line, likeliest, a * quiet), 1.0).likelihood for a in _LEVELS]
    weights = np.exp(np.array(heights) - max(heights))
    level = float(weights @ _LEVELS / weights.sum())
    seen = np.where(line, likeliest, level * quiet)
    size, probable = (PRIOR / of.period) ** 2, np.where(band == 1, 1.0, _PROBABLE)
    found = np.maximum(seen, size)  # from above: what is taken for zero would tell its neighbours
    for _ in range(_ROUNDS):
        information, squares = _told(equations.F, equations.z, found)
        known = size * information / (1.0 + size * information)
        size, probable = _levels(known**_WELL, squares, line, of.period, band)
        of_line = size / probable
        missed = probable / (1.0 + of_line * information)
        found = np.maximum(seen, missed / (missed + 1.0 - probable) * of_line)
    return np.asarray(found)


def curve_covariance(of: CurveMoments, variance: Array, certain: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the mean squared error of the fitted values, its part without readings, and which coefficients matter.

    Args:
        variance: Of each coefficient [rad^2].
        certain: Which of all parameters cannot be off, ``(others + coefficients,)``.

    Returns:
        whole, beforehand: ``(parameters, parameters)`` each: the others per prior, coefficients in rad. The second is
            what priors leave, without the noise of the readings.
    """
    others = len(of.away) - len(variance)
    expected = np.concatenate([np.ones(others), np.maximum(variance, _CERTAIN)])
    root = np.where(certain, 0.0, np.sqrt(expected))
    H = root[:, None] * of.moments[:-1, :-1] * root
    C = np.linalg.inv(H + np.eye(len(root)))
    mean = root * (C @ (root * of.moments[:-1, -1]))
    off = np.where(certain, 0.0, of.away - mean)
    missing = np.outer(off, off)
    whole = root[:, None] * C * root
    return whole + missing, root[:, None] * (C @ C) * root + missing


def that_matter(of: CurveMoments, variance: Array) -> NDArray[np.bool_]:
    """Return which coefficients may move readings somewhere in a turn, ``(coefficients,)``."""
    moved = variance * of.size[of.joint] / 2.0
    order = np.argsort(moved)
    small = np.zeros(len(moved), dtype=bool)
    small[order] = np.cumsum(moved[order]) <= _NEGLIGIBLE * of.rows
    return ~small


def _quiet(likeliest: Array, joint: NDArray[np.intp], band: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the level of each coefficient's band, and which coefficients stand out as lines."""
    quiet, median = np.zeros(len(likeliest)), np.zeros(len(likeliest))
    for i in np.unique(joint):
        median[joint == i] = np.median(likeliest[joint == i])
        for b in np.unique(band):
            mine = (joint == i) & (band == b)
            some = likeliest[mine & (likeliest > 0.0)]
            quiet[mine] = len(some) / float(np.sum(1.0 / some)) if len(some) else 0.0
    least = np.maximum(_ABOVE_JOINT * median, 1e-9 * PRIOR**2)
    return quiet, (likeliest > _ABOVE_BAND * quiet) | (likeliest > least)


def _told(F: Array, z: Array, variance: Array) -> tuple[Array, Array]:
    """Return what the equations know of each coefficient with the others of such variances, and its second moment."""
    turned = np.linalg.solve(np.eye(len(F)) + (F * variance) @ F.T, np.column_stack([F, z]))
    with_own = np.einsum("ij,ij->j", F, turned[:, :-1])
    known = np.minimum(variance * with_own, 1.0 - 1e-6)
    value = variance * (F.T @ turned[:, -1])
    return with_own / (1.0 - known), value**2 + variance * (1.0 - known)


def _levels(
    known: Array, squares: Array, line: NDArray[np.bool_], period: NDArray[np.intp], band: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Return what the square of a coefficient is expected to be by its periods, and the probability of a line."""
    count = int(period.max(initial=0)) + 1
    told = np.bincount(period, known, count)
    square, lines = np.bincount(period, known * squares, count), np.bincount(period, known * line, count)
    size, probable = np.zeros(count), np.zeros(count)
    for b in np.unique(band):
        mine = np.unique(period[band == b])
        before = float(np.mean((PRIOR / mine) ** 2))
        # The expectation of a variance is larger than its scale, by two degrees of freedom.
        of_band = (square[mine].sum() + _BELIEVED * before) / (told[mine].sum() + _BELIEVED - 2.0)
        size[mine] = (square[mine] + _BELIEVED_OF_BAND * of_band) / (told[mine] + _BELIEVED_OF_BAND)
        share = (lines[mine].sum() + _BELIEVED * _PROBABLE) / (told[mine].sum() + _BELIEVED)
        probable[mine] = (lines[mine] + _BELIEVED_OF_BAND * share) / (told[mine] + _BELIEVED_OF_BAND)
    probable = np.clip(probable, _LEAST_PROBABLE, 1.0 - _LEAST_PROBABLE)
    return size[period], np.where(band == 1, 1.0, probable[period])
