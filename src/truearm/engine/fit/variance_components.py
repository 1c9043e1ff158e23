"""The variances of readings and joints, and what parameters are uncertain by because of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.likelihood import Likelihood, Linearised, Moments, Visits, Whitening, lower_inverse
from truearm.engine.fit.problem import Rows
from truearm.engine.robot.chain import Array

# How large the noise of the readings and the error of the joints are, by restricted maximum likelihood.
#
# The residuals of a linearised fit are ``z = A u + G e + n``: parameters u with their Gaussian priors, errors e of the
# joints that all readings of a visit share, and noise n of the readings. With ``V = D + G S G'``, the parameters
# integrated out, ``z`` is normal with the precision ``P = V^-1 - V^-1 A (A' V^-1 A + K)^-1 A' V^-1``, K the information
# of the priors. That is the restricted likelihood of Patterson and Thompson (1971) where priors are wide. Its maximum
# is found by Newton steps in the logarithms of the variances, with the average of the observed and the expected
# information (Gilmour, Thompson and Cullis 1995). All it needs of the readings are products of few numbers by visit,
# formed once.

#: Twice the gain in log-likelihood from which joint errors are believed.
_SIGNIFICANT: Final = 5.41
_STEPS: Final = 40
_LARGEST_STEP: Final = 2.0  # in the logarithm of a variance
_FURTHER: Final = 4.0  # how many times longer than the information says
_SETTLED: Final = 1e-5  # what a step may still gain in twice the log-likelihood
#: Least excess of a variance without errors of the joints that a difference of the parameters is judged by.
_LEAST_DIFFERENCE: Final = 0.05
#: Of the logarithm of a variance: what is known of it beforehand.
_LEAST_INFORMATION: Final = 0.05
#: Times the readings' variance above which a variance of the joints is not told apart from it: it would be an
#: instrument whose noise is below a hundredth of what the joints do. Of one target any residual is some joint error.
_MOST: Final = 1e4
#: Share of the readings' variance below which a variance of the joints is none.
_LEAST: Final = 1e-8


@dataclass(frozen=True, eq=False)
class Variances:
    """Variances of readings and of joints."""

    factors: Array  #: What the variance of the equations of each factor is, by the variance assumed, ``(factors,)``.
    #: Variance of the error of each joint that the readings of a visit share [rad^2 or m^2], ``(joints,)``.
    joints: Array
    #: Degrees of freedom behind the variance of each joint (Satterthwaite 1946), ``(joints,)``; infinite where there is
    #: none.
    freedom: Array


@dataclass(frozen=True, eq=False)
class CovariancePart:
    """What one source of error adds to the covariance of the parameters."""

    #: Of the parameters, ``(parameters, parameters)``, if the variance of the source is as estimated.
    covariance: Array
    freedom: float  #: Degrees of freedom behind that variance; infinite where it is known.
    joints: tuple[int, ...] = ()  #: Indices of the joints whose errors are the source.

    def among(self, places: NDArray[np.bool_]) -> CovariancePart:
        """Return it among more parameters, `places` of which these are; zero for the others."""
        covariance = np.zeros((len(places), len(places)))
        covariance[np.ix_(places, places)] = self.covariance
        return replace(self, covariance=covariance)

    def scaled(self, sizes: Array) -> CovariancePart:
        """Return it for parameters that are so many times as large."""
        return replace(self, covariance=self.covariance * np.outer(sizes, sizes))


@dataclass(frozen=True, eq=False)
class Components:
    """Variances, and what the parameters are worth with them."""

    likeliest: Variances  #: The variances with the largest likelihood.
    #: Those that readings are to be weighed by: the same where errors of the joints explain how residuals of a visit
    #: hang together, else the likeliest ones without errors of the joints.
    weighing: Variances
    estimated: tuple[bool, ...]  #: Whether the variance of each factor was.
    holds: bool  #: Whether the residuals look as they do with the variances that readings are weighed by.
    #: What gives :attr:`worth`, when that is asked for.
    found_worth: Callable[[], tuple[Array, tuple[CovariancePart, ...]]]
    #: squares, freedom: sum of the squared residuals of each factor, divided by these variances, and what to expect of
    #: it, ``(factors,)``.
    squares: Array
    freedom: Array

    @cached_property
    def worth(self) -> tuple[Array, tuple[CovariancePart, ...]]:
        """Covariance of the parameters, per prior, and its parts.

        The first, ``(parameters, parameters)``, has the uncertainty of the variances; its parts, by sources, have not.
        """
        return self.found_worth()


def variance_components(
    at: Linearised,
    estimated: Sequence[bool],
    least: Array,
    kinds: Sequence[NDArray[np.intp]],
    before: Components | None = None,
) -> Components:
    """Estimate the variances of the readings and of the joints' errors.

    Errors of the joints are believed where they raise the likelihood by more than chance would in 1 of 100 cases
    without any (half of the time such a variance is estimated as zero; Self and Liang 1987). The covariance of the
    parameters contains what the variances are uncertain by: an interval of 1.96 deviations holds what one of Student's
    t with the degrees of freedom of Satterthwaite (1946) would, see :func:`_widened`.

    Args:
        estimated: Whether the variance of each factor is free; else it is as assumed.
        least: What each factor is at least, ``(factors,)``: readings without noise leave but rounding.
        kinds: Joints that share one variance; of joints that are in none it is zero.
        before: What was found at a solution nearby, with the same factors, by whose variances readings are now weighed.
            Whether there are errors of the joints, and whether they explain the residuals, is as it was.
    """
    moments = Moments(at, len(estimated))
    start, noise = _start(at, estimated, least)
    if before is None:
        alone, best = _with_and_without(moments, start, kinds, noise)
        believed = 2.0 * (best.likelihood - alone.likelihood) >= _SIGNIFICANT and not _alone_in(best)
        best = best if believed else alone
        likeliest = _variances(best, kinds, noise)
        holds = (best is alone or _agree(alone, best)) and _independent(best)
        best = best if holds else alone
    else:
        best = Likelihood(moments, np.where(start > least, 1.0, start), before.weighing.joints)
        if not np.isfinite(best.likelihood):  # the readings' variance has left that of the joints far behind
            best = Likelihood(moments, start, np.zeros(moments.M.shape[-1]))
        best = _maximised(moments, best, [kind for kind in kinds if best.joints[kind].any()], noise)
        if _alone_in(best):
            best = _maximised(moments, Likelihood(moments, start, np.zeros(moments.M.shape[-1])), [], noise)
        holds, likeliest = before.holds, _variances(best, kinds, noise)
        if before.likeliest is not before.weighing:
            factors = before.likeliest.factors / before.weighing.factors * best.factors
            likeliest = replace(before.likeliest, factors=factors)
    taken = [kind for kind in kinds if best.joints[kind].any()]
    squares, traces, _ = best.slopes(range(len(estimated)))
    weighing = likeliest if holds else _variances(best, kinds, noise)
    worth = partial(_covariance, best, taken, noise)
    return Components(
        likeliest, weighing, tuple(estimated), holds, worth, squares * best.factors, traces * best.factors
    )


def largest_likelihood(
    at: Linearised,
    estimated: Sequence[bool],
    least: Array,
    kinds: Sequence[NDArray[np.intp]],
    joints: Array | None = None,
) -> tuple[Variances, float]:
    """Return the variances with the largest likelihood, and its logarithm: to compare what may be said of readings.

    Parameters are those of :func:`variance_components`. Errors of the joints count however little they gain. How well
    variances are known is not asked.

    Args:
        joints: Variance of the error of each joint where it is known, ``(joints,)``; otherwise it is estimated.
    """
    moments = Moments(at, len(estimated))
    start, noise = _start(at, estimated, least)
    if joints is not None:
        best = _maximised(moments, Likelihood(moments, start, joints), [], noise)
    else:
        alone, best = _with_and_without(moments, start, kinds, noise)
        best = max(alone, best, key=lambda state: state.likelihood)
    return Variances(best.factors, best.joints, np.full(len(best.joints), np.inf)), best.likelihood


def _start(at: Linearised, estimated: Sequence[bool], least: Array) -> tuple[Array, list[int]]:
    """Return the variances of the readings to begin with, ``(factors,)``, and which of them are to be found."""
    start = np.ones(len(estimated))
    for index in np.flatnonzero(estimated).tolist():
        start[index] = max(float(np.mean(at.residual[at.factor == index] ** 2)), float(least[index]))
    return start, [index for index, free in enumerate(estimated) if free and start[index] > least[index]]


def _variances(state: Likelihood, kinds: Sequence[NDArray[np.intp]], noise: Sequence[int]) -> Variances:
    """Return the variances of a state, and how well those of the joints are known."""
    taken = [kind for kind in kinds if state.joints[kind].any()]
    freedom = np.full(len(state.joints), np.inf)
    for kind, known in zip(taken, _freedoms(_relative(state, [*taken, *noise])), strict=False):
        freedom[kind] = known
    return Variances(state.factors, state.joints, freedom)


def _relative(state: Likelihood, kinds: Sequence[NDArray[np.intp] | int]) -> Array:
    """Return the covariance of the logarithms of variances, ``(kinds, kinds)``."""
    if not kinds:
        return np.zeros((0, 0))
    _, _, information = state.slopes(kinds)
    value = np.array([state.factors[i] if isinstance(i, int) else state.joints[i[0]] for i in kinds])
    return np.asarray(np.linalg.inv(information * np.outer(value, value) + _LEAST_INFORMATION * np.eye(len(kinds))))


def _freedoms(relative: Array) -> list[float]:
    """Return the degrees of freedom of variances from the covariance of their logarithms."""
    return [2.0 / float(share) for share in np.diag(relative)]


def _covariance(
    state: Likelihood, taken: Sequence[NDArray[np.intp]], noise: Sequence[int]
) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of the parameters, with what the variances are uncertain by, and its parts without.

    A variance v_i that were another one would change the covariance of the same estimate in proportion:
    ``C A' V^-1 V_i V^-1 A C`` is the part of each, and what is left is of the priors.
    """
    directions = state.of.at.directions
    inverse = lower_inverse(state.L)
    turned = directions @ inverse.T
    unseen = state.of.at.unseen @ state.of.at.unseen.T
    kinds: list[NDArray[np.intp] | int] = [*taken, *noise]
    relative = _relative(state, kinds)
    changes = []
    for kind in [*taken, *range(len(state.factors))]:
        size = state.factors[kind] if isinstance(kind, int) else state.joints[kind[0]]
        changes.append(size * inverse @ state.curvature(kind) @ inverse.T)
    known = dict(zip([*range(len(taken)), *(len(taken) + index for index in noise)], _freedoms(relative), strict=True))
    parts = [
        CovariancePart(
            turned @ change @ turned.T,
            known.get(place, np.inf),
            tuple(taken[place].tolist()) if place < len(taken) else (),
        )
        for place, change in enumerate(changes)
    ]
    if state.of.at.priors:
        unexplained = np.eye(len(inverse)) - sum(changes)
        parts.append(CovariancePart(turned @ unexplained @ turned.T + unseen, np.inf))
    free = [changes[place] for place in known]
    return turned @ _widened(free, relative, len(inverse)) @ turned.T + unseen, tuple(parts)


def _with_and_without(
    moments: Moments, start: Array, kinds: Sequence[NDArray[np.intp]], noise: Sequence[int]
) -> tuple[Likelihood, Likelihood]:
    """Return the largest likelihood without errors of the joints, and with them if any seem to help."""
    alone = _maximised(moments, Likelihood(moments, start, np.zeros(moments.M.shape[-1])), [], noise)
    best = alone
    for _ in kinds:
        waiting = [kind for kind in kinds if not best.joints[kind].any()]
        if not waiting:
            break
        squares, traces, information = best.slopes([*waiting])
        with np.errstate(over="ignore"):  # where nothing is left over, no step is finite
            steps = 0.5 * (squares - traces) / np.maximum(np.diag(information), 1e-300)
        most = _MOST * float(best.factors.max()) / max(_effect(moments), 1e-300)  # beyond, the readings say nothing
        rising = [(kind, step) for kind, step in zip(waiting, steps.tolist(), strict=True) if 0.0 < step < most]
        if not rising:
            break
        joints = best.joints.copy()
        for kind, step in rising:
            joints[kind] = step
        taken = [kind for kind in kinds if joints[kind].any()]
        best = _maximised(moments, Likelihood(moments, best.factors, joints), taken, noise)
    return alone, best


def _alone_in(state: Likelihood) -> bool:
    """Return whether errors of the joints explain all that there is, and leave no noise to the readings."""
    return bool(state.joints.max(initial=0.0) * _effect(state.of) > _MOST * state.factors.max())


def _agree(alone: Likelihood, best: Likelihood) -> bool:
    """Return whether the parameters with and without errors of the joints differ by no more than chance allows.

    With them both are right, and one is better (Hausman 1978): the covariance of the difference is the difference of
    the covariances.
    """
    of, by = best.of, 1.0 / alone.factors
    p = len(of.known)
    spread = np.tensordot(best.factors * by**2, of.C, 1) + of.known
    for _, by_factor in of.parts():
        T = np.tensordot(by, by_factor, 1)
        spread += (T * best.joints[:, None]).reshape(-1, p).T @ T.reshape(-1, p)
    turned = np.asarray(np.linalg.solve(alone.L, best.L), dtype=np.float64)
    turned = np.asarray(np.linalg.solve(alone.L.T, turned), dtype=np.float64)
    values, vectors = np.linalg.eigh(turned.T @ spread @ turned - np.eye(p))
    differ = values > _LEAST_DIFFERENCE
    if not differ.any():
        return True
    apart = vectors[:, differ].T @ (best.L.T @ (alone.estimate - best.estimate)) / np.sqrt(values[differ])
    return not beyond_chance(float(apart @ apart), float(differ.sum()))


def _independent(state: Likelihood) -> bool:
    """Return whether the pulls of visits on the parameters are no larger than those of independent ones.

    Visits at which the joints stand alike pull together. The sum of the squares, in deviations of the parameters, is
    what an estimate from the scatter of the visits finds of the parameters' variance, by what the variances say (the
    idea of White 1982).
    """
    at = state.of.at
    root = np.sqrt(state.factors)[at.factor]
    whitening = Whitening(at.visits, at.by_joints * np.sqrt(state.joints) / root[:, None])
    expected = variance = squares = 0.0
    for rows, Q, z in at.turned():
        part = whitening.of(rows)
        X = np.asarray(np.linalg.solve(state.L, part.applied(Q / root[rows, None]).T).T, dtype=np.float64)
        standings = (at.standings or at.visits).of(rows)
        pulls = standings.products(X, part.applied((z - Q @ state.estimate) / root[rows])[:, None])
        squares += float(np.sum(pulls**2))
        for _, alike in standings.alike:
            few = X[alike]
            few = few if few.shape[1] > few.shape[2] else np.swapaxes(few, 1, 2)
            gram = np.swapaxes(few, 1, 2) @ few
            left = gram - gram @ gram
            expected += float(np.trace(left, axis1=1, axis2=2).sum())
            variance += 2.0 * float(np.sum(left**2))
    if variance <= 0.0:
        return True
    freedom = 2.0 * expected**2 / variance
    return not beyond_chance(squares / expected * freedom, freedom)


def beyond_chance(squares: float, freedom: float) -> bool:
    """Return whether chi squared is larger than chance allows, 1 in 1000, by Wilson and Hilferty (1931)."""
    k = 2.0 / (9.0 * freedom)
    return squares / freedom > (1.0 - k + 3.09 * float(np.sqrt(k))) ** 3


def _maximised(
    moments: Moments, start: Likelihood, kinds: Sequence[NDArray[np.intp]], noise: Sequence[int]
) -> Likelihood:
    """Climb to the largest likelihood from some variances, all of them above zero."""
    current, kinds = start, list(kinds)
    size = _effect(moments)
    before: tuple[Array, Array] | None = None
    for _ in range(_STEPS):
        free: list[NDArray[np.intp] | int] = [*kinds, *noise]
        if not free:
            break
        value = np.array([current.factors[i] if isinstance(i, int) else current.joints[i[0]] for i in free])
        squares, traces, information = current.slopes(free)
        slope = 0.5 * (squares - traces) * value
        curvature = information * np.outer(value, value)
        step = np.linalg.solve(curvature + 1e-9 * (1.0 + float(np.trace(curvature))) * np.eye(len(free)), slope)
        if float(slope @ step) < _SETTLED:
            break
        if before is not None:  # as much further as the last step fell short: the information is but an average
            last, then = before
            gain, fall = float(then @ last), float((then - slope) @ last)
            step *= _FURTHER if gain > max(0.0, _FURTHER * fall) else 0.3 if fall <= 0.0 else max(0.3, gain / fall)
        step *= min(1.0, _LARGEST_STEP / float(np.abs(step).max() + 1e-300))
        for _ in range(12):
            trial = _at(moments, current, free, value * np.exp(step))
            if trial.likelihood >= current.likelihood - 1e-9 * abs(current.likelihood):
                break
            step *= 0.4
        else:
            break
        current, before = trial, (step, slope)
        if any(current.joints[kind[0]] * size > _MOST * current.factors.max() for kind in kinds):
            break
        gone = [kind for kind in kinds if current.joints[kind[0]] * size < _LEAST * current.factors.min()]
        for kind in gone:
            current, before = _at(moments, current, [kind], np.zeros(1)), None
        kinds = [kind for kind in kinds if not any(kind is other for other in gone)]
    return current


def _effect(moments: Moments) -> float:
    """Return the mean variance of an equation by the variance of a joint."""
    return float(np.trace(moments.M.sum(axis=(0, 1))) / moments.rows.sum())


def _at(moments: Moments, current: Likelihood, kinds: Sequence[NDArray[np.intp] | int], values: Array) -> Likelihood:
    """Return the state with some variances changed."""
    factors, joints = current.factors.copy(), current.joints.copy()
    for kind, value in zip(kinds, values.tolist(), strict=True):
        if isinstance(kind, int):
            factors[kind] = value
        else:
            joints[kind] = value
    return Likelihood(moments, factors, joints)


def _widened(changes: Sequence[Array], relative: Array, count: int) -> Array:
    """Return what the covariance of the parameters is multiplied by, in directions where that is one.

    The variance f of a combination of parameters is itself estimated, with the variance Var(f) that follows from the
    covariance W of the logarithms of the variances. Satterthwaite's degrees of freedom are ``2 f^2 / Var(f)``, and an
    interval of Student's t is ``t / 1.96`` times as wide. That is no covariance: each combination has its own factor.
    This is the smallest one that is quadratic and nowhere narrower: with ``E_i`` the relative change of the covariance
    by a variance, ``Var(f) / f <= c' (sum_ij W_ij E_i E_j) c`` by Cauchy and Schwarz.
    """
    if not changes:
        return np.eye(count)
    weighted = [sum(relative[i, j] * changes[j] for j in range(len(changes))) for i in range(len(changes))]
    spread = sum(change @ other for change, other in zip(changes, weighted, strict=True))
    sizes, vectors = np.linalg.eigh(0.5 * (spread + spread.T))
    sizes = np.maximum(sizes, 0.0)  # where no reading is left over, rounding may say less than nothing
    if sizes[-1] <= 0.0:
        return np.eye(count)
    freedom = max(2.0 / float(sizes[-1]), 1.0)
    more = (widening(freedom) ** 2 - 1.0) / sizes[-1] * sizes
    return np.asarray(np.eye(count) + (vectors * more) @ vectors.T)


def widening(freedom: float) -> float:
    """Return how many times wider an interval of Student's t is than one of the normal distribution, for 95 %."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.975)) / 1.959963984540054


#: Share that a visit may have in what is known of a direction, for its pull to be made up for.
_LARGEST_SHARE: Final = 0.999
#: Share of the prior variance that the data should remove for a parameter to count in the degrees of freedom.
_INFORMED: Final = 0.5
_LEAST_FREEDOM: Final = 1.0
#: Of how many of them it is taken: each costs a product of all directions.
_MOST_ASKED: Final = 60
#: Numbers that are in memory at once, of the visits' shares and of their products.
_MOST_STORED: Final = 16_000_000


# What parameters are uncertain by where no model of the residuals holds: from the scatter of the visits themselves.
#
# The parameters answer to the sum of the visits' pulls, so the variance of that sum, found from the pulls, gives
# theirs (Huber 1967; Liang and Zeger 1986): ``H^-1 (M + K) H^-1`` with H the information, K that of the priors, and M
# the sum of the squared pulls. A fit has followed each visit part of the way; the pulls are those of Bell and
# McCaffrey (2002, their second estimator), which are right on average where visits are alike and independent, and an
# interval has their degrees of freedom (Pustejovsky and Tipton 2018). With priors all of that holds as it stands, if
# truths come from them.
def cluster_covariance(
    parts: Callable[[], Iterable[tuple[Rows, Array, Array]]],
    visits: Visits,
    uncertain: NDArray[np.bool_],
    beforehand: Array,
) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of parameters scaled by their priors, zero for those that are not uncertain.

    With it come its parts: of the visits' scatter, without what that is uncertain by, and of the priors.

    Args:
        parts: Goes through the equations of some whole visits at a time, each part with their indices, with the
            square root of the information: a Jacobian, per prior, whose square is what the parameters are known by,
            ``(k, parameters)``; and with what each equation pulls the parameters with, ``(k, parameters)``: its
            residual times its weight times its derivative, per prior.
        uncertain: Which parameters are, ``(parameters,)``.
        beforehand: What is known of each parameter before any reading: one by its deviation, in priors,
            ``(parameters,)``; 1 with priors, 0 where nothing is known.
    """
    root = triangle = np.diag(beforehand[uncertain])
    for _, sensitivity, _ in parts():
        triangle = np.asarray(
            np.linalg.qr(np.concatenate([sensitivity[:, uncertain], triangle]), mode="r"), dtype=np.float64
        )
    _, s, Vt = np.linalg.svd(triangle, full_matrices=False)
    directions = Vt.T / np.maximum(s, 1e-12 * s[:1])
    along = root @ directions
    meat, freedom = _meat(_Scatter(parts, visits, uncertain, directions), bool(root.any()))
    known = along.T @ along
    whole = CovariancePart(directions @ (widening(freedom) ** 2 * meat + known) @ directions.T, np.inf)
    scatter = CovariancePart(directions @ meat @ directions.T, freedom)
    known_part = CovariancePart(directions @ known @ directions.T, np.inf)
    return whole.among(uncertain).covariance, (scatter.among(uncertain), known_part.among(uncertain))


@dataclass(frozen=True, eq=False)
class _Scatter:
    """Visits with their equations and pulls for :func:`cluster_covariance`, and directions to see them in."""

    parts: Callable[[], Iterable[tuple[Rows, Array, Array]]]
    visits: Visits
    uncertain: NDArray[np.bool_]
    directions: Array  #: Of unit information, ``(parameters, p)``.

    def alike(self) -> Iterable[tuple[Array, Array, Array]]:
        """Go through visits with equally many equations, all at once where that takes little memory.

        Each comes with its share of what is known: eigenvalues ``(k, m)``, their vectors ``(k, p, m)``, and its pull
        ``(k, p)``.
        """
        return self._computed() if self._stored is None else self._stored

    @cached_property
    def _stored(self) -> list[tuple[Array, Array, Array]] | None:
        few = len(self.visits.of_row) * self.directions.shape[1] <= _MOST_STORED
        return list(self._computed()) if few else None

    def _computed(self) -> Iterator[tuple[Array, Array, Array]]:
        for rows, sensitivity, pull in self.parts():
            visits = self.visits.of(rows)
            X = sensitivity[:, self.uncertain] @ self.directions
            pulled = pull[:, self.uncertain] @ self.directions
            pulls = visits.products(pulled, np.ones((len(pull), 1)))[..., 0]
            for visit, places in visits.alike:
                yield *_eigen(X[places]), pulls[visit]


def _eigen(part: Array) -> tuple[Array, Array]:
    """Return the eigenvalues ``(k, m)`` and vectors ``(k, p, m)`` of the squares of matrices ``(k, m, p)``."""
    turned = np.swapaxes(part, 1, 2)
    if part.shape[1] < part.shape[2]:  # eigenvectors of the smaller of two matrices
        values, left = np.linalg.eigh(part @ turned)
        values = np.clip(values, 1e-300, _LARGEST_SHARE)
        return values, turned @ left / np.sqrt(values)[:, None, :]
    values, vectors = np.linalg.eigh(turned @ part)
    return np.clip(values, 0.0, _LARGEST_SHARE), vectors


def _meat(scatter: _Scatter, known_before: bool) -> tuple[Array, float]:
    """Return the squared pulls in directions of unit information, and their degrees of freedom."""
    directions = scatter.directions
    count = directions.shape[1]
    informed = np.ones(len(directions), dtype=bool)
    if known_before:
        informed = 1.0 - np.sum(directions**2, axis=1) > _INFORMED
        informed = informed if informed.any() else ~informed
    asked = directions[informed]
    asked = asked[:: -(-len(asked) // _MOST_ASKED)]
    meat = np.zeros((count, count))
    # Of each parameter, over the visits: variance of its shares, their squares, what they have in common.
    total, squares, mixed, spent = np.zeros((4, len(asked)))
    crossed = np.empty(len(asked))
    at_once = max(1, _MOST_STORED // count**2)
    for first in range(0, len(asked), at_once):
        some = slice(first, first + at_once)
        products = np.zeros((len(asked[some]), count, count))
        for values, vectors, pull in scatter.alike():
            along = np.swapaxes(vectors, 1, 2)
            if first == 0:
                factor = 1.0 / np.sqrt(1.0 - values) - 1.0
                made_up = (pull[..., None] + vectors @ (factor[..., None] * (along @ pull[..., None])))[..., 0]
                meat += made_up.T @ made_up
            seen = along @ asked[some].T
            sizes = np.sum((values / (1.0 - values))[..., None] * seen**2, axis=1)
            weighed = (values / np.sqrt(1.0 - values))[..., None] * seen
            total[some] += sizes.sum(axis=0)
            squares[some] += np.sum(sizes**2, axis=0)
            for j in range(len(products)):
                share = (vectors @ weighed[..., j : j + 1])[..., 0]
                lengths = np.sum(share**2, axis=1)
                mixed[first + j] += float(sizes[:, j] @ lengths)
                spent[first + j] += float(lengths.sum())
                products[j] += share.T @ share
        crossed[some] = np.sum(products**2, axis=(1, 2))
    squared = squares - 2.0 * mixed + crossed
    freedom = (total - spent) ** 2 / np.maximum(squared, 1e-300)
    return meat, float(1.0 / np.mean(1.0 / np.maximum(freedom, _LEAST_FREEDOM)))
