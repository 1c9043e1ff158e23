"""Curves of the joints in a fit: free coefficients, what is expected of each, and what they are off by."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.problem import NOISE_FLOOR, Problem
from truearm.engine.fit.variance_components import CovariancePart
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import PRIOR, JointCurve
from truearm.engine.robot.parameters import FreeParameters, Parameter
from truearm.engine.robot.robot import Robot

# How large each sine and cosine of the joints' curves is expected to be, by restricted maximum likelihood.
#
# A curve with the same freedom for every period would follow noise; one that is stiff would miss what gears do. So the
# coefficients c of a linearised fit ``z = A u + F c + n`` have a normal prior of mean zero, whose variance v is the
# same for sine and cosine of a period of a joint, and the variances that make the residuals likeliest are taken (MacKay
# 1992, "Bayesian interpolation"; Tipping 2001, "Sparse Bayesian learning and the relevance vector machine"). With the
# parameters u of the arm integrated out under their own, wide, priors, what geometry and gravity can say themselves is
# theirs. With ``V = s^2 I + F diag(v) F'``, slopes of the likelihood in log v vanish where ``v = c^2 / g``, summed over
# sine and cosine: c is the likeliest coefficient and ``g = v f' V^-1 f`` what the data know of it, 0 to 1. Each step
# puts in the old v on the right.
#
# A gear makes a few lines, and little between them. The variances of neighbouring periods of a joint therefore have an
# inverse gamma distribution with one scale t, and few degrees of freedom: coefficients are then of Student's t, which
# leaves lines alone and shrinks the rest (Tipping and Lawrence 2005). Its likeliest values are
# ``v = (c^2 + m t) / (g + m)``, and t the harmonic mean of the band's v. Periods that the data cannot tell apart, where
# a joint turned through a part of a turn only, keep t, and are as uncertain where the joint was not measured.

#: First periods in a turn of the bands whose variances are alike.
BANDS: Final = (1, 3, 6, 11, 19, 33)
#: Degrees of freedom of the variances of a band.
_ALIKE: Final = 1.0
#: Sum of the variances of a joint's coefficients that no curve has [rad^2, m^2 of a prismatic joint].
LARGEST: Final = 0.1**2
#: Gain in log-likelihood from which the curve of a joint is believed. A sine of noise alone gains so much at one of
#: 300 000 periods, and a robot has hundreds of periods to look at.
_SIGNIFICANT: Final = 12.5
#: Information of the readings on a coefficient, by that of its variance, that is none.
_NOTHING: Final = 1e-5
#: Of the log-likelihood: a step that gains less is the last.
_SETTLED: Final = 0.05
_STEPS: Final = 40
#: Share of the variance of the readings that all coefficients which are left out may move them by together.
_NEGLIGIBLE: Final = 0.01
#: Share of the best seen combination of coefficients below which one is not seen.
_ALIKE_EQUATIONS: Final = 1e-9


@dataclass(frozen=True, eq=False)
class CurveVariances:
    """How stiff the curves are."""

    variance: Array  #: Of each coefficient [rad^2], ``(coefficients,)``; zero where it is left out.
    full: Array  #: The same before those are left out that move next to nothing.
    noise: float  #: Variance of the residuals by the one assumed.
    informed: Array  #: What the data know of each coefficient, 0 to 1, ``(coefficients,)``.
    likelihood: float  #: Logarithm of the restricted likelihood, up to a constant.
    gains: dict[int, float]  #: What the curve of each joint gains in it, by the index of the joint.


def curve_variances(
    moments: Array,
    rows: float,
    joint: NDArray[np.intp],
    period: NDArray[np.intp],
    least_noise: float = 0.0,
    most: float = np.inf,
) -> CurveVariances:
    """Find the variances of the coefficients of the joints' curves.

    Args:
        moments: From :func:`moments_without`, ``(coefficients + 1, coefficients + 1)``: of the derivatives of the
            equations by the coefficients [1/rad], and of what the curves are to explain.
        rows: How many independent equations there are.
        joint, period: Of each coefficient: the index of its joint, and its periods in a turn.
        least_noise: What the variance of the equations is at least, by the one assumed.
        most: Sum of the variances of a joint's coefficients that no curve has, :data:`LARGEST` of coefficients in SI
            units.
    """
    of = equations_of(moments, rows)
    group = np.unique(np.stack([joint, period]), axis=1, return_inverse=True)[1].reshape(-1)
    band = np.unique(np.stack([joint, np.searchsorted(BANDS, period, side="right")]), axis=1, return_inverse=True)[
        1
    ].reshape(-1)
    climb = _Climb(group, band, least_noise)
    state = climb.climbed(Marginal(of, _start(of, joint, most), max(of.squares / rows, least_noise)))
    gains: dict[int, float] = {}
    while state.variance.any():
        sizes = np.bincount(joint, state.variance)
        if sizes.max() > most:  # of a joint on whose axis the targets lie, any curve is as likely
            left = np.where(joint == int(sizes.argmax()), 0.0, state.variance)
            state = climb.climbed(Marginal(of, left, state.noise))
            continue
        gains = {i: state.likelihood - state.without(joint == i) for i in np.unique(joint[state.variance > 0]).tolist()}
        weakest = min(gains, key=lambda i: gains[i])
        if gains[weakest] >= _SIGNIFICANT:
            break
        left = np.where(joint == weakest, 0.0, state.variance)
        state = climb.climbed(Marginal(of, left, state.noise))
    moved = np.bincount(group, state.variance * of.size)
    order = np.argsort(moved)
    small = np.zeros(len(moved), dtype=bool)
    small[order] = np.cumsum(moved[order]) <= _NEGLIGIBLE * state.noise * rows
    significant = (state.variance > 0.0) & ~small[group]
    return CurveVariances(
        np.where(significant, state.variance, 0.0),
        state.variance,
        state.noise,
        state.known,
        state.likelihood,
        gains if significant.any() else {},
    )


def moments_without(moments: Array, others: int) -> Array:
    """Return products of columns of equations with other parameters integrated out under their priors.

    Args:
        moments: Products of the derivatives by the other parameters, per prior, of those by the coefficients and of the
            residuals, ``(others + coefficients + 1, others + coefficients + 1)``.
        others: How many other parameters there are.
    """
    root = factored(moments[:others, :others] + np.eye(others))[0]
    shared = np.linalg.solve(root, moments[:others, others:])
    return np.asarray(moments[others:, others:] - shared.T @ shared)


def equations_of(moments: Array, rows: float) -> Equations:
    """Return the equations that products of :func:`moments_without` are of."""
    return Equations(*_independent_equations(moments), rows)


def _independent_equations(moments: Array) -> tuple[Array, Array, float]:
    """Return equations that curves take part in, their right side, and the sum of squares of all others.

    Through a part of a turn neighbouring periods look alike, so that these are far fewer than coefficients.
    """
    sizes, axes = np.linalg.eigh(moments[:-1, :-1])
    independent = sizes > _ALIKE_EQUATIONS * max(float(sizes[-1]), 1e-300)
    root, axes = np.sqrt(sizes[independent]), axes[:, independent]
    z = (axes.T @ moments[:-1, -1]) / root
    return root[:, None] * axes.T, z, max(float(moments[-1, -1] - z @ z), 0.0)


def _start(of: Equations, joint: NDArray[np.intp], most: float) -> Array:
    """Return variances with which the curves of the joints would add as much to the residuals as there is noise."""
    variance = np.zeros(len(joint))
    joints = np.unique(joint).tolist()
    for i in joints:
        of_joint = joint == i
        variance[of_joint] = of.rows / max(float(of.size[of_joint].sum()), 1e-300) / len(joints)
        if float(variance[of_joint].sum()) > most:  # the readings do not see the joint turn
            variance[of_joint] = 0.0
    return variance


class Equations:
    """What is left of the equations: derivatives by the coefficients, right side, and what no curve can explain."""

    def __init__(self, F: Array, z: Array, residual_square: float, rows: float) -> None:
        self.F, self.z, self.rows = F, z, rows
        self.H, self.b, self.squares = F.T @ F, F.T @ z, float(z @ z) + residual_square
        self.size = np.diag(self.H).copy()


class Marginal:
    """The likelihood at some variances, with what its slopes need.

    All of it follows from a matrix of coefficients, or from one of equations where these are fewer.
    """

    def __init__(self, of: Equations, variance: Array, noise: float) -> None:
        self.of, self.noise = of, noise
        self.variance = np.where(variance * of.size > _NOTHING * noise, variance, 0.0)
        self._used = used = self.variance > 0.0
        v, b = self.variance[used], of.b[used]
        root = np.sqrt(v / noise)
        self.estimate = np.zeros(len(variance))
        if used.sum() <= len(of.F):
            self._part: Array | None = None
            self._triangle, logs = factored(np.eye(len(v)) + root[:, None] * of.H[np.ix_(used, used)] * root)
            self.estimate[used] = root * _solved(self._triangle, root * b)
        else:
            self._part = part = of.F[:, used] * root
            self._triangle, logs = factored(np.eye(len(part)) + part @ part.T)
            self.estimate[used] = root * (part.T @ _solved(self._triangle, of.z))
        c = self.estimate[used]
        explained = float(b @ c)
        moved = of.F[:, used] @ c
        self.left = max(of.squares - 2.0 * explained + float(moved @ moved), 0.0)
        self.likelihood = -0.5 * (logs + of.rows * float(np.log(noise)) + max(of.squares - explained, 0.0) / noise)

    @cached_property
    def known(self) -> Array:
        """What the data know of each coefficient, 0 to 1, ``(coefficients,)``."""
        from scipy.linalg import solve_triangular

        within = np.eye(len(self._triangle)) if self._part is None else self._part
        squares = (solve_triangular(self._triangle, within, lower=True, check_finite=False) ** 2).sum(axis=0)
        known = np.zeros(len(self.variance))
        known[self._used] = 1.0 - squares if self._part is None else squares
        return known

    def at(self, variance: Array, noise: float) -> Marginal:
        """Return it at other variances."""
        return Marginal(self.of, variance, noise)

    def without(self, coefficients: NDArray[np.bool_]) -> float:
        """Return the likelihood without some coefficients."""
        return self.at(np.where(coefficients, 0.0, self.variance), self.noise).likelihood


def factored(matrix: Array) -> tuple[Array, float]:
    """Return the lower triangle by Cholesky of a matrix that is not below 1, and the logarithm of its determinant.

    The logarithm is infinite where rounding left the matrix indefinite.
    """
    try:
        triangle = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        sizes, axes = np.linalg.eigh(matrix)
        rows = np.sqrt(np.maximum(sizes, 1.0))[:, None] * axes.T
        return np.asarray(np.linalg.qr(rows)[1].T), np.inf
    return np.asarray(triangle), 2.0 * float(np.log(np.diag(triangle)).sum())


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a matrix that is not below 1, which rounding leaves between 0 and 1."""
    half = np.linalg.inv(factored(matrix)[0])
    return np.asarray(half.T @ half)


def _solved(triangle: Array, right: Array) -> Array:
    """Return the solution of equations whose matrix has this Cholesky triangle, ``(n,)``."""
    from scipy.linalg import cho_solve

    return np.asarray(cho_solve((triangle, True), right, check_finite=False))


class _Climb:
    """The way to the likeliest variances, in their logarithms, one for each period of a joint and one of the noise."""

    def __init__(self, group: NDArray[np.intp], band: NDArray[np.intp], least_noise: float) -> None:
        self.group, self.least_noise = group, least_noise
        self.of_group = np.zeros(group.max(initial=-1) + 1, dtype=np.intp)
        self.of_group[group] = band
        self.sizes = np.bincount(group)

    def alike(self, v: Array) -> Array:
        """Return the scale of each group's band."""
        used = v > 0.0
        inverse = np.bincount(self.of_group[used], 1.0 / v[used], minlength=self.of_group.max() + 1)
        return np.asarray(
            (np.bincount(self.of_group[used], minlength=len(inverse)) / np.maximum(inverse, 1e-300))[self.of_group]
        )

    def objective(self, state: Marginal) -> float:
        """Return the likelihood with that of the variances."""
        v = np.bincount(self.group, state.variance) / self.sizes
        used = v > 0.0
        share = self.alike(v)[used] / v[used]
        return state.likelihood + 0.5 * _ALIKE * float(np.sum(np.log(share) - share))

    def following(self, state: Marginal) -> Array:
        """Return where the next step leads: logarithms of the variances of the groups, and of the noise."""
        v = np.bincount(self.group, state.variance) / self.sizes
        squares, known = np.bincount(self.group, state.estimate**2), np.bincount(self.group, state.known)
        new = (squares + _ALIKE * self.alike(v)) / (known + _ALIKE)
        freedom = max(state.of.rows - float(state.known.sum()), 1e-3 * state.of.rows)
        return np.asarray(np.log(np.maximum(np.append(np.where(v > 0.0, new, 0.0), state.left / freedom), 1e-300)))

    def at(self, state: Marginal, place: Array) -> Marginal:
        """Return the state at such logarithms."""
        v = np.exp(place[:-1])[self.group]
        return state.at(np.where(state.variance > 0.0, v, 0.0), max(float(np.exp(place[-1])), self.least_noise))

    def climbed(self, state: Marginal) -> Marginal:
        """Climb: two steps, and a third as far as they lead together (Varadhan and Roland 2008)."""
        current = np.log(
            np.maximum(np.append(np.bincount(self.group, state.variance) / self.sizes, state.noise), 1e-300)
        )
        height = self.objective(state)
        for _ in range(_STEPS):
            first = self.following(state)
            second_state = self.at(state, first)
            second = self.following(second_state)
            way, bend = first - current, second - 2.0 * first + current
            far = min(-float(np.linalg.norm(way)) / max(float(np.linalg.norm(bend)), 1e-300), -1.0)
            place = current - 2.0 * far * way + far**2 * bend
            trial = self.at(state, place)
            reached = self.objective(trial)
            if not reached >= height:
                place = second
                trial = self.at(state, second)
                reached = self.objective(trial)
            gain, height, current, state = reached - height, reached, place, trial
            if gain < _SETTLED:
                break
        return state


# What a fit with joint curves is off by, where variances of the curves were found from the same data.
#
# Likeliest variances are too sure of themselves. What the data do not tell comes out as zero, and the geometry that
# takes its place counts as known. So the covariance is that of other variances. Terms that stand out keep theirs. The
# rest of a band, which has the level of noise, is taken so many times larger or smaller as the likelihood expects
# (integrated over a grid). A term that the data could not tell is expected to be of the size that the same number of
# periods, and its neighbours, have in the joints where they could: with the probability p that there is a line at all,
# and of the line's size (George and McCulloch 1993, "Variable selection via Gibbs sampling"). The probability that a
# line is there although none was seen is ``p (1 - k) / (p (1 - k) + 1 - p)`` with k the share that the data know of a
# line. Where no joint tells, the prior of the effect holds, and falls as one by the number of periods.
#
# With those variances the parameters have a posterior of their own. The covariance returned is its covariance and the
# square of the difference of its mean from what was fitted: the mean squared error of the fitted values.

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
_NEGLIGIBLE_CURVE_ERRORS: Final = 1e-3
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
    expected = np.maximum(seen, size)  # from above: what is taken for zero would tell its neighbours
    for _ in range(_ROUNDS):
        information, squares = _information(equations.F, equations.z, expected)
        known = size * information / (1.0 + size * information)
        size, probable = _levels(known**_WELL, squares, line, of.period, band)
        of_line = size / probable
        missed = probable / (1.0 + of_line * information)
        expected = np.maximum(seen, missed / (missed + 1.0 - probable) * of_line)
    return np.asarray(expected)


def curve_covariance(
    of: CurveMoments, variance: Array, certain: NDArray[np.bool_], expected: Array
) -> tuple[Array, Array, Array]:
    """Return the mean squared error of the fitted values, its part without readings, and which coefficients matter.

    Args:
        variance: Of each coefficient [rad^2].
        expected: What the variance of each of the others is expected to be, by its prior's, ``(others,)``.
        certain: Which of all parameters cannot be off, ``(others + coefficients,)``.

    Returns:
        whole, beforehand: ``(parameters, parameters)`` each: the others per prior, coefficients in rad. The second is
            what priors leave, without the noise of the readings.
        informed: Share of the expected variance of each that the readings removed, ``(parameters,)``.
    """
    expected = np.concatenate([expected, np.maximum(variance, _CERTAIN)])
    root = np.where(certain, 0.0, np.sqrt(expected))
    H = root[:, None] * of.moments[:-1, :-1] * root
    C = inverse_of(H + np.eye(len(root)))
    mean = root * (C @ (root * of.moments[:-1, -1]))
    off = np.where(certain, 0.0, of.away - mean)
    missing = np.outer(off, off)
    whole = root[:, None] * C * root
    return whole + missing, root[:, None] * (C @ C) * root + missing, 1.0 - np.diag(C)


def that_matter(of: CurveMoments, variance: Array) -> NDArray[np.bool_]:
    """Return which coefficients may move readings somewhere in a turn, ``(coefficients,)``."""
    moved = variance * of.size[of.joint] / 2.0
    order = np.argsort(moved)
    small = np.zeros(len(moved), dtype=bool)
    small[order] = np.cumsum(moved[order]) <= _NEGLIGIBLE_CURVE_ERRORS * of.rows
    return ~small


def _quiet(likeliest: Array, joint: NDArray[np.intp], band: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the level of each coefficient's band, and which coefficients stand out as lines."""
    quiet, median = np.zeros(len(likeliest)), np.zeros(len(likeliest))
    for i in np.unique(joint):
        median[joint == i] = np.median(likeliest[joint == i])
        for b in np.unique(band):
            in_band = (joint == i) & (band == b)
            some = likeliest[in_band & (likeliest > 0.0)]
            quiet[in_band] = len(some) / float(np.sum(1.0 / some)) if len(some) else 0.0
    least = np.maximum(_ABOVE_JOINT * median, 1e-9 * PRIOR**2)
    return quiet, (likeliest > _ABOVE_BAND * quiet) | (likeliest > least)


def _information(F: Array, z: Array, variance: Array) -> tuple[Array, Array]:
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
    known_of_period = np.bincount(period, known, count)
    square, lines = np.bincount(period, known * squares, count), np.bincount(period, known * line, count)
    size, probable = np.zeros(count), np.zeros(count)
    for b in np.unique(band):
        periods = np.unique(period[band == b])
        before = float(np.mean((PRIOR / periods) ** 2))
        # The expectation of a variance is larger than its scale, by two degrees of freedom.
        of_band = (square[periods].sum() + _BELIEVED * before) / (known_of_period[periods].sum() + _BELIEVED - 2.0)
        size[periods] = (square[periods] + _BELIEVED_OF_BAND * of_band) / (known_of_period[periods] + _BELIEVED_OF_BAND)
        share = (lines[periods].sum() + _BELIEVED * _PROBABLE) / (known_of_period[periods].sum() + _BELIEVED)
        probable[periods] = (lines[periods] + _BELIEVED_OF_BAND * share) / (
            known_of_period[periods] + _BELIEVED_OF_BAND
        )
    probable = np.clip(probable, _LEAST_PROBABLE, 1.0 - _LEAST_PROBABLE)
    return size[period], np.where(band == 1, 1.0, probable[period])


#: How often stiffness is found: the noise that is left without a curve is not that with it.
_ROUNDS_CURVES: Final = 2
#: Deviation of readings in sums of products at least [m, rad]: of smaller ones rounding is larger than what the priors
#: know.
_SUMMED_FLOOR: Final = 1e-7
#: Equations whose products are summed at once.
_AT_ONCE: Final = 3000
#: Degrees of freedom of the level of the errors: variances of curves are known from a few dozen lines, and what errs
#: more than 60 times in a turn is in none of them. With so many the interval of the expected error holds about as
#: often as it says on twins (docs/benchmarks.md); targets of programs have as many.
_FREEDOM: Final = 12.0
#: Coordinates that say where a target is.
_COORDINATES: Final = 3


@dataclass(frozen=True, eq=False)
class Curves:
    """The curves of the joints in a fit."""

    #: Joint (from 0) and periods in a turn of every coefficient that the model has, by its name.
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    variances: Mapping[str, float] = field(default_factory=dict)  #: Of the coefficients that are free [rad^2].
    #: The variance of every coefficient that has the largest likelihood [rad^2], in the order of `places`.
    likeliest: Array = field(default_factory=lambda: np.zeros(0))
    #: By what the variances of the readings are larger, for the curves' sake, than their residuals (Kish 1965): where
    #: errors of the joints at a visit explain nothing, its readings count as one of three coordinates, and hold the
    #: curves no better.
    design_effect: float = 1.0
    #: What the curve of each joint gains in log-likelihood, by the index of the joint.
    gains: Mapping[int, float] = field(default_factory=dict)
    rounds: int = 0  #: How often stiffness is still to be found.

    def __bool__(self) -> bool:
        return bool(self.places)

    @classmethod
    def none_of(cls, problem: Problem) -> Self:
        """Return those that a problem has, of which nothing is known yet."""
        wanted = {p.name for p in problem.free.parameters if p.group == JointCurve.name}
        places = {
            name: (joint, number // 2 + 1)
            for effect in problem.robot.effects
            if isinstance(effect, JointCurve)
            for joint, names in effect.terms.items()
            for number, name in enumerate(names)
            if name in wanted
        }
        return cls(places, rounds=_ROUNDS_CURVES if places else 0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all coefficients."""
        return tuple(self.places)

    def known_of(self, free: FreeParameters) -> FreeParameters:
        """Return free parameters without the coefficients that were not found, the others as large as was found."""
        return FreeParameters(
            tuple(
                replace(p, prior=math.sqrt(self.variances[p.name])) if p.name in self.variances else p
                for p in free.parameters
                if p.name not in self.places or p.name in self.variances
            )
        )

    def priors_of(self, robot: Robot) -> list[Parameter]:
        """Return a robot's coefficients with what is expected of them."""
        return [replace(robot.parameters[name], prior=math.sqrt(variance)) for name, variance in self.variances.items()]


def with_stiffness(
    problem: Problem, every: FreeParameters, curves: Curves, joints: Array, weight: Array
) -> tuple[Problem, Curves, Array]:
    """Return a problem with the coefficients free that the data tell, each with what is expected of it.

    The deviations of its readings, and the variances of the joints' errors, which are returned too, are those with the
    curves.

    Args:
        problem: At a solution, whose values its free parameters have.
        every: All parameters that the model frees, in their order.
        curves: What was found before.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
    """
    names = curves.names  # all of them again: what is weak shows only where the strong curves are known
    robot = problem.robot
    coefficients = [robot.parameters[name] for name in names]
    crowd = 1.0
    if not joints.any():
        crowd = max(1.0, problem.rows / (_COORDINATES * (int(problem.visits.max(initial=0)) + 1)))
    of = curve_moments(problem, curves, joints, weight, crowd)
    declared = any(block.declared for block in problem.blocks)
    estimate = curve_variances(
        moments_without(of.moments, len(of.away) - len(names)),
        of.rows,
        of.joint,
        of.period,
        least_noise=problem.widened**-2 if declared else 0.0,
        most=LARGEST,
    )
    variances = {name: v for name, v in zip(names, estimate.variance.tolist(), strict=True) if v > 0.0}
    if {curves.places[name][0] for name in curves.variances} - {curves.places[name][0] for name in variances}:
        return problem, replace(curves, rounds=0), joints  # the curve of a joint that was found once is not lost again
    current = {p.name: p for p in problem.free.parameters}
    parameters = [p for p in every.parameters if p.name in (variances if p.name in curves.places else current)]
    free = FreeParameters(
        tuple(
            replace(robot.parameters[p.name], prior=math.sqrt(variances[p.name]))
            if p.name in variances
            else current[p.name]
            for p in parameters
        )
    )
    fixed = {p.name: p.nominal for p in coefficients if p.name not in variances}
    ratio = min(1.0, math.sqrt(estimate.noise)) if variances else 1.0
    joining = bool(variances) and not curves.variances  # what widened declared deviations may have been the curves
    left = replace(
        problem,
        robot=robot.with_values(fixed),
        free=free,
        noise={name: max(ratio * deviation, NOISE_FLOOR) for name, deviation in problem.noise.items()},
        widened=1.0 if joining else max(1.0, problem.widened * ratio),
    )
    known = replace(
        curves,
        variances=variances,
        likeliest=estimate.full,
        design_effect=crowd if variances else 1.0,
        gains=estimate.gains,
        rounds=curves.rounds - 1 if variances else 0,
    )
    return left, known, joints * ratio**2


def curve_moments(problem: Problem, curves: Curves, joints: Array, weight: Array, crowd: float) -> CurveMoments:
    """Return products of the equations of a problem, with every coefficient of the curves beside the other parameters.

    Args:
        problem: At a solution, whose values its free parameters have.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
        crowd: By what the variances of the readings are larger because they hang together.
    """
    names, robot = curves.names, problem.robot
    others = [p for p in problem.free.parameters if p.name not in curves.places]
    noise = {name: max(deviation, _SUMMED_FLOOR) for name, deviation in problem.noise.items()}
    whole = replace(problem, noise=noise, free=FreeParameters((*others, *(robot.parameters[name] for name in names))))
    evaluation = whole.at(whole.free.start)
    prior = np.array([p.prior for p in others])
    whitening = None
    if joints.any():
        whitening = Whitening(Visits(whole.visits), evaluation.by_joints * np.sqrt(joints))
    root = np.sqrt(np.repeat(weight, whole.components) / crowd)
    away = whole.free.start - whole.free.nominal
    moments = np.zeros((len(away) + 1, len(away) + 1))
    scale = np.concatenate([prior, np.ones(len(names))])
    for equations, portion in evaluation.portions():
        residual, jacobian, weights = portion.residual, portion.jacobian, root[equations]
        if whitening is not None:
            alone = whitening.of(equations)
            residual, jacobian = alone.applied(residual), alone.applied(jacobian)
        for first in range(0, len(residual), _AT_ONCE):
            rows = slice(first, first + _AT_ONCE)
            part = np.column_stack([jacobian[rows] * scale, jacobian[rows] @ away - residual[rows]])
            part *= weights[rows, None]
            moments += part.T @ part
    place = np.array([curves.places[name] for name in names], dtype=np.intp).reshape(-1, 2)
    size = np.sum((evaluation.by_joints * root[:, None]) ** 2, axis=0)
    return CurveMoments(moments, whole.rows / crowd, away / scale, place[:, 0], place[:, 1], size)


def parts_with_curves(
    problem: Problem,
    curves: Curves,
    joints: Array,
    erring: NDArray[np.bool_],
    weight: Array,
    certain: NDArray[np.bool_],
    scatter: CovariancePart | None,
    expected_of: Callable[[CurveMoments, Array, Sequence[str]], Array],
) -> tuple[tuple[str, ...], tuple[CovariancePart, ...], Array]:
    """Return what the parameters of a fit with curves are off by, and the coefficients that were not fitted.

    Args:
        problem: At the solution, whose values its free parameters have.
        joints: Variances of the joints' errors that readings are weighed by.
        erring: Which joints were found to err at a visit. If none of its curve was found, what its gears may do is in
            that.
        weight: What the loss leaves of each reading.
        certain: Which of its free parameters are certain, ``(free,)``.
        scatter: What the readings' noise adds to the covariance of the free parameters [SI], where it follows from
            their scatter.
        expected_of: What the variances of the other parameters are expected to be, by their priors'.

    Returns:
        names, parts: Of the coefficients that are zero in the fit and may not be, and the parts of the covariance [SI]
            of the free parameters and, behind them, of these.
        informed: Share of the expected variance of each that the readings removed.
    """
    names, free = list(curves.places), problem.free
    of = curve_moments(problem, curves, joints, weight, 1.0 if scatter is None else curves.design_effect)
    variance = expected_variances(of, curves.likeliest) if names else np.zeros(0)
    others = [p for p in free.parameters if p.name not in curves.places]
    place = {name: k for k, name in enumerate((*(p.name for p in others), *names))}
    sure = np.zeros(len(place), dtype=bool)
    sure[[place[name] for name, is_certain in zip(free.names, certain.tolist(), strict=True) if is_certain]] = True
    expected = expected_of(of, variance, [p.name for p in others])
    whole, beforehand, informed = curve_covariance(of, variance, sure, expected)
    fitted = set(free.names)
    more = [name for name, on in zip(names, that_matter(of, variance).tolist(), strict=True) if on] if names else []
    own = {curves.places[name][0] for name in fitted.intersection(names)}
    open_ = {i for i, errs in enumerate(erring.tolist()) if i in own or not errs}
    more = [name for name in more if name not in fitted and curves.places[name][0] in open_]
    order = [place[name] for name in (*free.names, *more)]
    size = np.concatenate([[p.prior for p in others], np.ones(len(names))])[order]
    if scatter is None:
        parts = [CovariancePart(whole[np.ix_(order, order)], _FREEDOM, tuple(np.flatnonzero(joints).tolist()))]
        return tuple(more), tuple(part.scaled(size) for part in parts), informed[order]
    known = CovariancePart(beforehand[np.ix_(order, order)], _FREEDOM).scaled(size)
    return tuple(more), (scatter.among(np.arange(len(order)) < len(free.names)), known), informed[order]


#: Of a model without any.
NO_CURVES: Final = Curves()
