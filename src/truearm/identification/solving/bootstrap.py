"""What parameters are uncertain by, from fits to configurations drawn anew from those that were measured.

Efron (1979): whole configurations are drawn with replacement, because readings of one share errors of the joints, and
each draw is fitted as the readings were, under the same loss and bounds. It needs no model of the residuals, and no
derivative of a loss that has none, such as a sum of absolute values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.rounds import Solved, solve_with_joints
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters

#: Configurations below which draws are too much alike, and fits from which deviations are known to a tenth or so.
LEAST_CONFIGURATIONS: Final = 10
LEAST_FITS: Final = 20
#: Step of each fit that is the last, in priors or mm: deviations need no more digits.
_SMALL: Final = 1e-4


def refit_draws(
    solved: Solved, loss: Loss, count: int, seed: int = 0, progress: Callable[[str], None] = lambda _: None
) -> Array:
    """Return what fits to configurations drawn anew find, ``(count, parameters)`` [SI].

    Deviations of the readings, and which parameters are held, are those of the fit.

    Args:
        solved: The fit to all training configurations, where each search begins.
        loss: Of the fit.
        count: How many draws.
        seed: Of the draws.
        progress: Called with a few words at each fit.

    Raises:
        InputError: If there are too few configurations to draw from.
    """
    problem, n = solved.problem, solved.problem.data.configurations
    if n < LEAST_CONFIGURATIONS:
        raise InputError(
            "there are too few training configurations to draw from",
            parameter="bootstrap",
            where=problem.data.source,
            came=n,
            allowed=f"{LEAST_CONFIGURATIONS} or more",
            cure="Measure more, or leave it out.",
        )
    joints = np.zeros(len(problem.robot.joints)) if solved.components is None else solved.components.weighing.joints
    values = zip(problem.free.parameters, solved.solution.vector.tolist(), strict=True)
    started = FreeParameters(tuple(replace(p, value=value) for p, value in values))
    rng = np.random.default_rng((seed, count))
    found = np.empty((count, len(started.names)))
    for number in range(count):
        progress(f"bootstrap {_bar(number, count)} {number + 1} of {count}")
        drawn = problem.data.of_configurations(rng.integers(n, size=n))
        again = replace(problem, data=drawn, free=started)
        found[number] = solve_with_joints(
            again, joints, loss, solved.limits, _SMALL, solved.curves.design_effect
        ).vector
    return found


def _bar(done: int, count: int, width: int = 20) -> str:
    """Return how much is done, drawn with characters."""
    full = width * done // count
    return f"[{'#' * full}{'.' * (width - full)}]"
