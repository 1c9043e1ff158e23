"""How large each sine and cosine of the joints' curves is expected to be, by restricted maximum likelihood.

A curve with the same freedom for every period would follow noise; one that is stiff would miss what gears do. So the
coefficients c of a linearised fit ``z = A u + F c + n`` have a normal prior of mean zero, whose variance v is the same
for sine and cosine of a period of a joint, and the variances that make the residuals likeliest are taken (MacKay 1992,
"Bayesian interpolation"; Tipping 2001, "Sparse Bayesian learning and the relevance vector machine"). With the
parameters u of the arm integrated out under their own, wide, priors, what geometry and gravity can say themselves is
theirs. With ``V = s^2 I + F diag(v) F'``, slopes of the likelihood in log v vanish where ``v = c^2 / g``, summed over
sine and cosine: c is the likeliest coefficient and ``g = v f' V^-1 f`` what the data know of it, 0 to 1. Each step puts
in the old v on the right.

A gear makes a few lines, and little between them. The variances of neighbouring periods of a joint therefore have an
inverse gamma distribution with one scale t, and few degrees of freedom: coefficients are then of Student's t, which
leaves lines alone and shrinks the rest (Tipping and Lawrence 2005). Its likeliest values are
``v = (c^2 + m t) / (g + m)``, and t the harmonic mean of the band's v. Periods that the data cannot tell apart, where a
joint turned through a part of a turn only, keep t, and are as uncertain where the joint was not measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

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
    kept = (state.variance > 0.0) & ~small[group]
    return CurveVariances(
        np.where(kept, state.variance, 0.0),
        state.variance,
        state.noise,
        state.known,
        state.likelihood,
        gains if kept.any() else {},
    )


def moments_without(moments: Array, others: int) -> Array:
    """Return products of columns of equations with other parameters integrated out under their priors.

    Args:
        moments: Products of the derivatives by the other parameters, per prior, of those by the coefficients and of the
            residuals, ``(others + coefficients + 1, others + coefficients + 1)``.
        others: How many other parameters there are.
    """
    root = np.linalg.cholesky(moments[:others, :others] + np.eye(others))
    shared = np.linalg.solve(root, moments[:others, others:])
    return np.asarray(moments[others:, others:] - shared.T @ shared)


def equations_of(moments: Array, rows: float) -> Equations:
    """Return the equations that products of :func:`moments_without` are of."""
    return Equations(*_told_apart(moments), rows)


def _told_apart(moments: Array) -> tuple[Array, Array, float]:
    """Return equations that curves take part in, their right side, and the sum of squares of all others.

    Through a part of a turn neighbouring periods look alike, so that these are far fewer than coefficients.
    """
    sizes, axes = np.linalg.eigh(moments[:-1, :-1])
    kept = sizes > _ALIKE_EQUATIONS * max(float(sizes[-1]), 1e-300)
    root, axes = np.sqrt(sizes[kept]), axes[:, kept]
    z = (axes.T @ moments[:-1, -1]) / root
    return root[:, None] * axes.T, z, max(float(moments[-1, -1] - z @ z), 0.0)


def _start(of: Equations, joint: NDArray[np.intp], most: float) -> Array:
    """Return variances with which the curves of the joints would add as much to the residuals as there is noise."""
    found = np.zeros(len(joint))
    joints = np.unique(joint).tolist()
    for i in joints:
        mine = joint == i
        found[mine] = of.rows / max(float(of.size[mine].sum()), 1e-300) / len(joints)
        if float(found[mine].sum()) > most:  # the readings do not see the joint turn
            found[mine] = 0.0
    return found


class Equations:
    """What is left of the equations: derivatives by the coefficients, right side, and what no curve can explain."""

    def __init__(self, F: Array, z: Array, rest: float, rows: float) -> None:
        self.F, self.z, self.rows = F, z, rows
        self.H, self.b, self.squares = F.T @ F, F.T @ z, float(z @ z) + rest
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
        self.found = np.zeros(len(variance))
        if used.sum() <= len(of.F):
            self._part: Array | None = None
            self._triangle, logs = _factored(np.eye(len(v)) + root[:, None] * of.H[np.ix_(used, used)] * root)
            self.found[used] = root * _solved(self._triangle, root * b)
        else:
            self._part = part = of.F[:, used] * root
            self._triangle, logs = _factored(np.eye(len(part)) + part @ part.T)
            self.found[used] = root * (part.T @ _solved(self._triangle, of.z))
        c = self.found[used]
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


def _factored(matrix: Array) -> tuple[Array, float]:
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
        squares, known = np.bincount(self.group, state.found**2), np.bincount(self.group, state.known)
        new = (squares + _ALIKE * self.alike(v)) / (known + _ALIKE)
        freedom = max(state.of.rows - float(state.known.sum()), 1e-3 * state.of.rows)
        return np.asarray(np.log(np.maximum(np.append(np.where(v > 0.0, new, 0.0), state.left / freedom), 1e-300)))

    def at(self, state: Marginal, place: Array) -> Marginal:
        """Return the state at such logarithms."""
        v = np.exp(place[:-1])[self.group]
        return state.at(np.where(state.variance > 0.0, v, 0.0), max(float(np.exp(place[-1])), self.least_noise))

    def climbed(self, state: Marginal) -> Marginal:
        """Climb: two steps, and a third as far as they lead together (Varadhan and Roland 2008)."""
        here = np.log(np.maximum(np.append(np.bincount(self.group, state.variance) / self.sizes, state.noise), 1e-300))
        height = self.objective(state)
        for _ in range(_STEPS):
            first = self.following(state)
            second_state = self.at(state, first)
            second = self.following(second_state)
            way, bend = first - here, second - 2.0 * first + here
            far = min(-float(np.linalg.norm(way)) / max(float(np.linalg.norm(bend)), 1e-300), -1.0)
            place = here - 2.0 * far * way + far**2 * bend
            there = self.at(state, place)
            reached = self.objective(there)
            if not reached >= height:
                place = second
                there = self.at(state, second)
                reached = self.objective(there)
            gain, height, here, state = reached - height, reached, place, there
            if gain < _SETTLED:
                break
        return state
