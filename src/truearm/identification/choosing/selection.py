"""Which joint effects the data can carry: added one by one while cross-validation says that they help.

It begins with the elastic model. Each round adds, one at a time, every effect that is not there yet, and judges by
5-fold cross-validation on the training part. An effect is tried if it is selectable, if the robot has what it moves,
and if the data tell what it depends on: the order of the configurations, the temperature, loads. The best of those
whose gain is larger than its own standard error, over the paired differences of the folds, stays; the search ends where
there is none (the rule of one standard error: Breiman and others 1984, "Classification and Regression Trees", section
3.4.3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.choosing.candidates import SELECTABLE, open_effects
from truearm.identification.held import NOTHING_HELD, Held
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.models import MODELS, Model
from truearm.identification.solving.rounds import Redundant, find_parameters
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.effects import EFFECTS
from truearm.modeling.loads import has_weight
from truearm.modeling.robot import Robot

AUTO: Final = "auto"
FOLDS: Final = 5
_FOLD_TOLERANCE: Final = 1e-3  # priors; errors of folds are not compared more closely
_START: Final = next(model for model in MODELS if model.name == "elastic")

@dataclass(frozen=True)
class Attempt:
    """An effect that was tried.

    Attributes
    ----------
    round
        From 1.
    effect
        Its name.
    error
        Mean position error with it [m], over the folds of the cross-validation.
    gain, standard_error
        Mean of the folds' gains over the model of the round before, and its standard error [m].
    taken
        Whether it stayed.
    """

    round: int
    effect: str
    error: float
    gain: float
    standard_error: float
    taken: bool = False


@dataclass(frozen=True)
class Selection:
    """The way to a model.

    Attributes
    ----------
    model
        Where it ended.
    start
        Mean position error of the elastic model in cross-validation [m].
    attempts
        All that was tried, in order.
    """

    model: Model
    start: float
    attempts: tuple[Attempt, ...]


def select(
    robot: Robot,
    data: Dataset,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
    held: Held = NOTHING_HELD,
    seed: int = 0,
    candidates: Sequence[str] = SELECTABLE,
    progress: Callable[[str], None] = lambda _: None,
) -> Selection:
    """Choose the joint effects for a robot and its training data.

    Parameters
    ----------
    robot, data, loss, redundancy, bounds, bounds_file, held
        As :func:`truearm.identification.solving.fit.identify` takes them.
    seed
        Of the folds.
    candidates
        Joint effects that may be tried.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If there are too few configurations for the folds.
    """
    if data.configurations < 2 * FOLDS:
        raise InputError(
            "there are too few training configurations to choose a model by cross-validation",
            where=data.source,
            came=data.configurations,
            allowed=f"at least {2 * FOLDS}",
            cure="Measure more, or name a model.",
        )
    order = np.random.default_rng(seed).permutation(data.configurations)
    folds = [
        _fold(data.of_configurations(np.setdiff1d(order, part)), data.of_configurations(part))
        for part in np.array_split(order, FOLDS)
    ]

    def judged(effects: tuple[str, ...]) -> Array:
        model = _model(effects, candidates)
        errors = []
        for training, held_out in folds:
            found = find_parameters(
                robot,
                training,
                model,
                loss=loss,
                redundancy=redundancy,
                bounds=bounds,
                bounds_file=bounds_file,
                held=held,
                small=_FOLD_TOLERANCE,
            )
            judged = errors_of(found.robot, held_out)
            spread = judged.position or judged.length
            errors.append(np.nan if spread is None else spread.mean)
        return np.array(errors)

    effects = _START.effects
    progress("choosing a model: elastic")
    now = judged(effects)
    start = float(np.nanmean(now))
    attempts: list[Attempt] = []
    for number in range(1, len(candidates) + 1):
        tried: list[tuple[Attempt, Array]] = []
        for name in open_effects(robot, effects, data, candidates):
            progress(f"choosing a model: {', '.join(effects)} and {name}?")
            try:
                errors = judged((*effects, name))
            except InputError:  # too few equations in a fold, or a bound that a redundant one cannot keep
                continue
            gains = (now - errors)[np.isfinite(errors)]
            standard_error = float(gains.std(ddof=1) / np.sqrt(len(gains)))
            tried.append(
                (Attempt(number, name, float(np.nanmean(errors)), float(gains.mean()), standard_error), errors)
            )
        better = [pair for pair in tried if pair[0].gain > pair[0].standard_error]
        best = min(better, key=lambda pair: pair[0].error, default=None)
        attempts += [replace(attempt, taken=best is not None and attempt is best[0]) for attempt, _ in tried]
        if best is None:
            break
        effects, now = (*effects, best[0].effect), best[1]
    return Selection(_model(effects, candidates), start, tuple(attempts))


def _fold(training: Dataset, held_out: Dataset) -> tuple[Dataset, Dataset]:
    """Return both parts, without those held-out positions whose target the training part does not place."""
    read = training.has_position if training.fixture is None else training.has_reading
    placed = np.isin(held_out.target, training.target[read]) & np.isin(held_out.against, training.against[read])
    return training, replace(held_out.of_readings(placed), quaternion=None)


def _model(effects: tuple[str, ...], candidates: Sequence[str]) -> Model:
    names = [effect.name for effect in EFFECTS if effect.name in effects]
    added = [name for name in names if name not in _START.effects]
    tried = tuple(name for name in candidates if name not in effects)
    summary = f"elastic, and what cross-validation added: {', '.join(added) or 'nothing'}"
    return Model(AUTO, summary, _START.groups, tuple(names), tried)
