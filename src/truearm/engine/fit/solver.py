"""Gauss-Newton with Levenberg's damping on a whitened problem, with bounds and losses.

Each step solves a small triangular problem left by a QR decomposition of the whitened Jacobian (never the normal
equations: residuals without noise would drown in them). Bounds are kept by solving that small problem under
bounds (`scipy.optimize.lsq_linear`). Losses other than the linear one reweight whole readings between steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.losses import ABSOLUTE, Loss, norms_of, robust_scale, weighed_together, weights
from truearm.engine.fit.problem import Rows
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters

# The sum of absolute components under bounds: Li's objective, equation 4, read coordinate by coordinate.
#
# Unlike the sum of distances (:mod:`truearm.engine.fit.losses`) it depends on how the axes of the instrument
# lie. Each step is a linear program: with the linearised residual ``J s + r``, minimise ``sum t`` where
# ``-t <= J s + r <= t``. Its solution is a vertex, so few steps do.
_STEPS: Final = 60
_LEAST_PROMISE: Final = 1e-9  # share of the objective that a step must promise
_SMALLEST: Final = 1e-9  # longest step [priors] below which steps that fail are given up


def least_absolute(problem: Solvable, bounds: tuple[Array, Array] | None = None) -> tuple[Evaluated, bool, int]:
    """Minimise the sum of the absolute whitened residuals, without priors.

    Args:
        problem: What is minimised; starts at its free parameters' values, moved inside the bounds.
        bounds: Lowest and highest value of every parameter [SI], infinite where there is none.

    Returns:
        evaluated, converged, steps: The problem at the minimum, whether no step promised more, and how many linear
            programs it took.

    Raises:
        ArithmeticError: If the solver of linear programs fails: residuals or Jacobian are not finite.
    """
    low, high = bounds if bounds is not None else (np.full(len(problem.free.names), side) for side in (-np.inf, np.inf))
    x, longest = np.clip(problem.free.start, low, high), np.inf
    prior = problem.free.prior
    current = problem.at(x)
    converged, steps = False, 0
    while not converged and steps < _STEPS:
        steps += 1
        cost = float(np.abs(current.residual).sum())
        step_limits = np.stack(
            [np.maximum((low - x) / prior, -longest), np.minimum((high - x) / prior, longest)], axis=1
        )
        step, promised = _linear_program(current.jacobian * prior, current.residual, step_limits)
        converged = cost - promised <= _LEAST_PROMISE * cost
        if converged:
            break
        trial = problem.at(np.clip(x + step * prior, low, high))
        if float(np.abs(trial.residual).sum()) < cost:
            x, current = trial.vector, trial
            longest = 2 * longest
        else:
            longest = 0.25 * float(np.abs(step).max())
            converged = longest < _SMALLEST
    return current, converged, steps


def _linear_program(A: Array, r: Array, step_limits: Array) -> tuple[Array, float]:
    """Return the step within its room ``(parameters, 2)`` that is best where `A` holds, and the sum it promises."""
    from scipy.optimize import linprog
    from scipy.sparse import coo_array

    rows, count = A.shape
    twice = np.arange(2 * rows)
    row = np.concatenate([np.repeat(twice, count), twice])
    column = np.concatenate([np.tile(np.arange(count), 2 * rows), count + twice % rows])
    entries = np.concatenate([A.ravel(), -A.ravel(), -np.ones(2 * rows)])
    limits: list[tuple[float, float]] = [(a, b) for a, b in step_limits.tolist()]
    both_sides: Any = coo_array((entries, (row, column)), shape=(2 * rows, count + rows)).tocsc()
    solution = linprog(
        np.concatenate([np.zeros(count), np.ones(rows)]),
        A_ub=both_sides,
        b_ub=np.concatenate([-r, r]),
        bounds=[*limits, *[(0.0, np.inf)] * rows],
        method="highs",
    )
    if solution.x is None or solution.fun is None:
        raise ArithmeticError(f"the linear program of a step was not solved: {solution.message}")
    return np.asarray(solution.x[:count]), float(solution.fun)


#: Called at every step with the problem, the vector of its free parameters ``(parameters,)`` and the cost there: the
#: sum of squares that is made small.
Watch = Callable[[object, Array, float], None]
_WATCH: ContextVar[Watch | None] = ContextVar("watch", default=None)


@contextmanager
def watching(watch: Watch) -> Iterator[None]:
    """Let somebody look on at every step that solvers take in this block."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


def step_taken(problem: object, vector: Array, cost: float) -> None:
    """Tell of a step."""
    watch = _WATCH.get()
    if watch is not None:
        watch(problem, vector, cost)


#: A step this small is the last: the next one would be smaller by the share of the residual that bends, 1e-3 or less.
SMALL: Final = 1e-6
#: Share of that below which steps, which become smaller and smaller, would move the solution no more.
_SURELY: Final = 1e-2
#: Size of a step that counts as one, where the prior is no scale (base and targets) [m or rad].
_GEOMETRIC: Final = 1e-3
_STEPS_SOLVER: Final = {"linear": 60, "huber": 100, "cauchy": 100, "l1": 300, "l1-components": 300}
#: Share of the cost that a step must promise where coordinates pull alone: the way to their vertex never ends.
_CREEPING: Final = 1e-7
#: How much larger the last step may be where single numbers pull with one strength however near they are.
_CREEPING_FACTOR: Final = 10.0


class Solvable(Protocol):
    """A whitened problem, such as :class:`truearm.engine.fit.problem.Problem`."""

    @property
    def free(self) -> FreeParameters:
        """What may change."""

    @property
    def priors(self) -> bool:
        """Whether the parameters' priors are rows of the problem."""

    @property
    def components(self) -> NDArray[np.intp]:
        """Number of consecutive rows of each reading, ``(readings,)``."""

    def at(self, vector: Array) -> Evaluated:
        """Evaluate it at a vector ``(parameters,)``."""

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``."""


class Evaluated(Protocol):
    """A whitened problem at one vector of its free parameters."""

    @property
    def problem(self) -> Solvable:
        """What is evaluated."""

    @property
    def vector(self) -> Array:
        """Where, ``(parameters,)``."""

    @property
    def residual(self) -> Array:
        """Whitened residual of the readings, ``(rows,)``."""

    @property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a solver stopped."""

    vector: Array  #: Parameter values, in the order of the problem.
    converged: bool  #: Whether the last step was too small to matter.
    steps: int  #: Number of steps taken.
    at: Evaluated  #: The problem there, not weighted by a loss; it finds residual and Jacobian when they are asked for.
    weight: Array  #: What the loss left of each reading, ``(readings,)``; where coordinates count alone, of their mean.

    @property
    def residual(self) -> Array:
        """Whitened residual of the readings there, ``(rows,)``."""
        return self.at.residual

    @property
    def jacobian(self) -> Array:
        """Its derivative by the parameters, ``(rows, parameters)``."""
        return self.at.jacobian


def solve(
    problem: Solvable, loss: Loss = "linear", bounds: tuple[Array, Array] | None = None, small: float = SMALL
) -> Solution:
    """Minimise the whitened residuals under a loss.

    Args:
        problem: What is minimised; starts at its free parameters' values, moved inside the bounds.
        loss: ``linear`` is least squares; ``l1`` the sum of the norms of the readings (Li et al. 2016, equation 4, with
            "|X - X'|" read as each point's distance); ``l1-components`` that of the absolute values of their
            coordinates.
        bounds: Lowest and highest value of every parameter [SI], infinite where there is none.
        small: Step that is the last, in priors.
    """
    if loss == "l1-components" and not problem.priors:
        return _by_linear_programs(problem, bounds)
    start = problem.free.start
    current = problem.at(start if bounds is None else np.clip(start, *bounds))
    prior = problem.free.prior
    damping = 0.0
    scale: float | None = None
    components = weighed_together(loss, problem.components)
    steps, converged, size = 0, False, np.inf
    for steps in range(1, _STEPS_SOLVER[loss] + 1):
        norms = _norms(current, loss)
        scale = _next_scale(loss, norms, components, scale, steps)
        w = None if loss == "linear" else np.repeat(weights(loss, norms, scale), components)
        R, c = _triangle(current, w)
        cost = _cost(current, w)
        accepted = False
        for _ in range(25):
            step = (
                _step(R * prior, c, damping, _step_limits(current.vector, bounds, prior), full_rank=problem.priors)
                * prior
            )
            trial = problem.at(current.vector + step)
            gain = cost - _cost(trial, w)
            predicted = float(c @ c) - float(np.sum((R @ step + c) ** 2))
            accepted = gain >= 0.0 or predicted <= 1e-13 * cost
            if accepted:
                damping = 0.0 if damping < 1e-9 else damping / 10
                break
            damping = max(10 * damping, 1e-6 * float(np.sum((R * prior) ** 2)) / len(prior))
        if not accepted:
            break
        current = trial
        step_taken(problem, current.vector, cost - gain)
        before, size = size, float(np.abs(step / np.minimum(prior, _GEOMETRIC)).max())
        last = size < small * (_CREEPING_FACTOR if loss in ABSOLUTE else 1.0)
        if loss == "linear" and damping == 0.0 and bounds is None and size < before < np.inf:
            last = last or size / before * size < _SURELY * small  # what the next step would be, at most
        ended = last or predicted <= (_CREEPING if loss == "l1-components" else 1e-24) * max(cost, 1.0)
        if ended:
            converged = loss not in ABSOLUTE or scale <= _L1_FLOOR * float(np.median(_norms(current, loss)) + 1e-300)
            if converged:
                break
    final = weights(loss, _norms(current, loss), scale or 1.0)
    if loss == "l1-components":
        final = _of_readings(final, problem.components)
    return Solution(current.vector, converged, steps, current, final)


def _by_linear_programs(problem: Solvable, bounds: tuple[Array, Array] | None) -> Solution:
    """Minimise the sum of absolute coordinates without priors: a vertex, which reweighting does not reach."""
    current, converged, steps = least_absolute(problem, bounds)
    norms = _norms(current, "l1-components")
    weight = weights("l1-components", norms, 0.3 * _L1_FLOOR * float(np.median(norms)) + 1e-300)
    return Solution(current.vector, converged, steps, current, _of_readings(weight, problem.components))


def _of_readings(weight: Array, components: NDArray[np.intp]) -> Array:
    """Return the weight of each reading whose coordinates weigh alone: that of their mean size, ``(readings,)``."""
    first = np.concatenate([[0], np.cumsum(components)[:-1]])
    return np.asarray(components / np.add.reduceat(1.0 / weight, first))


_L1_FLOOR: Final = 1e-4  # an l1 reading closer than this share of the median counts as met


def _next_scale(loss: Loss, norms: Array, components: NDArray[np.intp], scale: float | None, step: int) -> float:
    if loss == "linear":
        return 1.0
    if loss in ABSOLUTE:
        floor = 0.3 * _L1_FLOOR * float(np.median(norms)) + 1e-300
        return max(floor, float(np.median(norms)) if scale is None else 0.5 * scale)
    if scale is None or step <= 10:  # then held, so that the weights can settle
        return max(robust_scale(norms, components), 1e-300)
    return scale


def _norms(evaluation: Evaluated, loss: Loss) -> Array:
    """Return the norm of each whitened reading; ones for the linear loss, which does not ask."""
    components = weighed_together(loss, evaluation.problem.components)
    return np.ones(len(components)) if loss == "linear" else norms_of(evaluation.residual, components)


def _cost(evaluation: Evaluated, w: Array | None) -> float:
    prior, _ = evaluation.problem.prior_rows(evaluation.vector)
    squares = evaluation.residual**2
    return float(np.sum(squares if w is None else w * squares)) + float(prior @ prior)


def _triangle(evaluation: Evaluated, w: Array | None) -> tuple[Array, Array]:
    """Return R and c with |R s + c|^2 equal to the linearised cost of a step s, up to a constant.

    Args:
        w: Weight of every row's square, ``(rows,)``; None for ones.
    """
    triangle: Array = np.zeros((0, len(evaluation.vector) + 1))
    if evaluation.problem.priors:
        prior, weight = evaluation.problem.prior_rows(evaluation.vector)
        triangle = np.column_stack([np.diag(weight), prior])
    for rows, part in parts_of(evaluation):
        J, r = part.jacobian, part.residual
        stacked = np.empty((J.shape[1] + 1, len(J) + len(triangle)))  # column by column, as QR takes it
        stacked[:-1, : len(J)], stacked[-1, : len(J)] = J.T, r
        if w is not None:
            stacked[:, : len(J)] *= np.sqrt(w[rows])
        stacked[:, len(J) :] = triangle.T
        triangle = np.asarray(np.linalg.qr(stacked.T, mode="r"), dtype=np.float64)
    return triangle[:, :-1], triangle[:, -1]


def parts_of(evaluation: Evaluated) -> Iterable[tuple[Rows, Evaluated]]:
    """Return the parts in which the derivatives of an evaluated problem are found, each with its equations."""
    portions = getattr(evaluation, "portions", None)
    return ((slice(None), evaluation),) if portions is None else portions()


def _step_limits(x: Array, bounds: tuple[Array, Array] | None, prior: Array) -> tuple[Array, Array] | None:
    if bounds is None:
        return None
    return (bounds[0] - x) / prior, (bounds[1] - x) / prior


def _step(A: Array, c: Array, damping: float, limits: tuple[Array, Array] | None, *, full_rank: bool) -> Array:
    """Minimise |A s + c|^2 + damping |s|^2, within `room` if there are bounds."""
    if limits is not None:
        from scipy.optimize import lsq_linear

        low, high = limits
        fixed = high - low < 1e-15
        low, high = np.where(fixed, -1e-15, np.minimum(low, 0.0)), np.where(fixed, 1e-15, np.maximum(high, 0.0))
        damped = np.concatenate([A, np.sqrt(damping + 1e-24) * np.eye(A.shape[1])])
        target = np.concatenate([-c, np.zeros(A.shape[1])])
        result = lsq_linear(damped, target, bounds=(low, high), method="bvls", tol=1e-14, max_iter=400)
        return np.asarray(np.clip(result.x, *limits))
    if full_rank and damping == 0.0:
        size = A.shape[1]  # the row below is zero: what no step can change
        return np.asarray(-np.linalg.solve(A[:size], c[:size]))
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    significant = s > 1e-14 * s[0]
    factor = np.where(significant, s / np.where(significant, s**2 + damping, 1.0), 0.0)
    return np.asarray(-Vt.T @ (factor * (U.T @ c)))
