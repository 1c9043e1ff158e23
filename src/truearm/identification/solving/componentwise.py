"""The sum of absolute components under bounds: Li's objective, equation 4, read coordinate by coordinate.

Unlike the sum of distances (:mod:`truearm.identification.solving.losses`) it depends on how the axes of the instrument
lie. Each step is a linear program: with the linearised residual ``J s + r``, minimise ``sum t`` where
``-t <= J s + r <= t``. Its solution is a vertex, so few steps do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from truearm.identification.solving.solver import Evaluated, Solvable
    from truearm.modeling.chain import Array

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
    here = problem.at(x)
    converged, steps = False, 0
    while not converged and steps < _STEPS:
        steps += 1
        cost = float(np.abs(here.residual).sum())
        room = np.stack([np.maximum((low - x) / prior, -longest), np.minimum((high - x) / prior, longest)], axis=1)
        step, promised = _linear_program(here.jacobian * prior, here.residual, room)
        converged = cost - promised <= _LEAST_PROMISE * cost
        if converged:
            break
        trial = problem.at(np.clip(x + step * prior, low, high))
        if float(np.abs(trial.residual).sum()) < cost:
            x, here = trial.vector, trial
            longest = 2 * longest
        else:
            longest = 0.25 * float(np.abs(step).max())
            converged = longest < _SMALLEST
    return here, converged, steps


def _linear_program(A: Array, r: Array, room: Array) -> tuple[Array, float]:
    """Return the step within its room ``(parameters, 2)`` that is best where `A` holds, and the sum it promises."""
    from scipy.optimize import linprog
    from scipy.sparse import coo_array

    rows, count = A.shape
    twice = np.arange(2 * rows)
    row = np.concatenate([np.repeat(twice, count), twice])
    column = np.concatenate([np.tile(np.arange(count), 2 * rows), count + twice % rows])
    entries = np.concatenate([A.ravel(), -A.ravel(), -np.ones(2 * rows)])
    limits: list[tuple[float, float]] = [(a, b) for a, b in room.tolist()]
    both_sides: Any = coo_array((entries, (row, column)), shape=(2 * rows, count + rows)).tocsc()
    found = linprog(
        np.concatenate([np.zeros(count), np.ones(rows)]),
        A_ub=both_sides,
        b_ub=np.concatenate([-r, r]),
        bounds=[*limits, *[(0.0, np.inf)] * rows],
        method="highs",
    )
    if found.x is None or found.fun is None:
        raise ArithmeticError(f"the linear program of a step was not solved: {found.message}")
    return np.asarray(found.x[:count]), float(found.fun)
