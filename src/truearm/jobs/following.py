"""What is told of a fit while it is made: its cost, and the error on configurations that it does not see."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Self

import numpy as np

from truearm.errors import InputError
from truearm.identification.solving.arrivals import WhitenedProblem
from truearm.identification.solving.problem import Problem
from truearm.identification.solving.watching import watching
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array

#: That much time may go into the errors that are told of a fit [s], and that share of the fit's own.
_TIME: Final = 0.5
_SHARE: Final = 0.05


class FitStep(str):
    """A step of a fit in words."""

    number: int  #: Of the step, from 1, over all rounds.
    cost: float  #: The sum of squares that is made small; each round weighs the readings anew.
    error: float  #: Mean error on the configurations that judge [m].

    @classmethod
    def of(cls, number: int, cost: float, error: float, judges: str) -> Self:
        """Return the words of a step."""
        made = cls(f"step {number}: cost {cost:.4g}, {judges} error {error * 1e3:.3f} mm")
        made.number, made.cost, made.error = number, cost, error
        return made


@contextmanager
def followed(progress: Callable[[str], None], judging: Dataset, *, held_out: bool) -> Iterator[None]:
    """Tell of the steps of the fits in this block, as far as that costs next to nothing.

    Args:
        judging: What the fit is judged on.
        held_out: Whether the fit does not see it.
    """
    number, spent, start = 0, 0.0, time.process_time()

    def told(problem: object, vector: Array, cost: float) -> None:
        nonlocal number, spent
        number += 1
        began = time.process_time()
        if spent > _TIME + _SHARE * (began - start):
            return
        inner = problem.plain if isinstance(problem, WhitenedProblem) else problem
        if not isinstance(inner, Problem):
            return
        values = dict(zip(inner.free.names, vector.tolist(), strict=True))
        try:
            with np.errstate(all="ignore"):
                errors = errors_of(inner.robot.with_values(values), judging)
        except InputError:  # a step on the way may be no robot
            return
        found = errors.position or errors.length
        if found is not None:
            progress(FitStep.of(number, cost, found.mean, "held-out" if held_out else "training"))
        spent += time.process_time() - began

    with watching(told):
        yield
