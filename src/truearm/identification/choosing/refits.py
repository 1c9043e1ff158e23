"""Cross-validation by real fits: in every fold the weights, penalties and periods are found from the rest alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.choosing.folds import FOLDS, Folds
from truearm.identification.choosing.search import mean_over
from truearm.identification.held import Held
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.models import Model
from truearm.identification.solving.rounds import Redundant, Solved, find_parameters
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

_TOLERANCE: Final = 1e-3  # priors; errors of folds are not compared more closely


@dataclass(frozen=True)
class How:
    """How parameters are identified, as :func:`truearm.identification.solving.rounds.find_parameters` takes it."""

    loss: Loss
    redundancy: Redundant
    bounds: Bounds | None
    bounds_file: str
    held: Held

    def find(self, robot: Robot, data: Dataset, model: Model, small: float, near: Solved | None) -> Solved:
        """Return the parameters, as they are found when the search begins near others."""
        return find_parameters(
            robot,
            data,
            model,
            loss=self.loss,
            redundancy=self.redundancy,
            bounds=self.bounds,
            bounds_file=self.bounds_file,
            held=self.held,
            small=small,
            near=near,
        )


@dataclass(frozen=True, eq=False)
class Refits:
    """Real fits of models in the folds, each made once."""

    robot: Robot  #: robot, data: the robot and its training data.
    data: Dataset
    draws: tuple[Folds, ...]  #: Which configurations are held out together, as often as that was drawn.
    how: How  #: How parameters are identified.
    model_of: Callable[[Sequence[str]], Model]  #: The model with some joint effects.
    #: The robot as a fold knows it, by the numbers of the draw and of the fold and the effects: with the periods found
    #: without the fold.
    robot_of: Callable[[int, int, Sequence[str]], Robot]
    _known: dict[tuple[str, ...], Array | None] = field(default_factory=dict)

    def errors(self, effects: Sequence[str]) -> Array | None:
        """Return the mean held-out error of each configuration over the draws [m], ``(n,)``, NaN where there is none.

        None if some fold is not enough for the model.
        """
        key = tuple(sorted(effects))
        if key not in self._known:
            self._known[key] = self._over_draws(key)
        return self._known[key]

    def _over_draws(self, effects: tuple[str, ...]) -> Array | None:
        found = []
        for draw in range(len(self.draws)):
            errors = self._found(draw, effects)
            if errors is None:
                return None
            found.append(errors)
        return mean_over(found)

    def _found(self, draw: int, effects: tuple[str, ...]) -> Array | None:
        found = np.full(self.data.configurations, np.nan)
        solved: Solved | None = None
        before: Robot | None = None
        for number in range(FOLDS):
            of = self.draws[draw].of
            inside, outside = np.flatnonzero(of != number), np.flatnonzero(of == number)
            training = self.data.of_configurations(inside)
            robot = self.robot_of(draw, number, effects)
            near = solved if robot == before and self.how.redundancy == "prior" else None
            try:
                solved, before = self.how.find(robot, training, self.model_of(effects), _TOLERANCE, near), robot
            except InputError:  # too few equations in a fold, or a bound that a redundant one cannot keep
                return None
            found[outside] = _errors(solved.robot, training, self.data.of_configurations(outside))
        return found


def _errors(robot: Robot, training: Dataset, held_out: Dataset) -> Array:
    """Return the mean error of each held-out configuration [m], of those positions whose target was trained on."""
    read = training.has_position if training.fixture is None else training.has_reading
    placed = np.isin(held_out.target, training.target[read]) & np.isin(held_out.against, training.against[read])
    judged = replace(held_out.of_readings(placed), quaternion=None)
    errors = errors_of(robot, judged)
    sizes = np.linalg.norm(errors.position_errors, axis=1)
    if not np.isfinite(sizes).any() and errors.length_errors is not None:
        sizes = np.abs(errors.length_errors)
    known = np.isfinite(sizes)
    of = judged.configuration[known]
    count = np.bincount(of, minlength=held_out.configurations)
    total = np.bincount(of, sizes[known], minlength=held_out.configurations)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
