"""Whether places that were held agree with the readings: beside the same fit with all of them found.

Two things speak against them. The readings may not fit: with the places held much more is left than without, as the
comparison of two nested fits says (F test). Or they fit, but only by a robot that is none: with the height of the base
held, a wrong number goes whole into ``d_1``, and only the prior of ``d_1`` says that no robot is like that. So
the squares of readings and priors together are compared as well (likelihood ratio).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.diagnose.unmodelled import chi_squared_tail
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.parameters import PLACES, Parameter
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion, rotation_from_vector, rotation_vector

#: How many times more is left with the places held, from which they do not fit the readings, and the least F.
_MORE: Final = 1.5
_LEAST_F: Final = 10.0
_LEAST_FREEDOM: Final = 10
#: Below this no instrument sees the difference [m].
_NEGLIGIBLE: Final = 2e-6
#: Priors by which a parameter goes far, and those within which it is at ease.
_STRAINED, _AT_EASE = 2.5, 1.0
#: Chance below which a place found is not the one held, and how far apart they are then at least [m, rad].
_CHANCE: Final = 1e-6
_APART: Final = (1e-3, math.radians(0.1))


HOLD_CONTRADICTS: Final = Rule(
    "hold-contradicts",
    "error",
    "places that are held do not fit the readings, or only with a robot that is none: [known "
    "frames](models.md#known-frames)",
)


def check_fixed_places(
    robot: Robot,
    fit: Fit,
    data: Dataset,
    *,
    loss: Loss,
    redundancy: Redundant,
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
) -> list[Notice]:
    """Return a notice if the places that a fit holds contradict its readings.

    Args:
        robot: The nominal robot.
        data: The training readings.
        loss, redundancy, bounds, bounds_file: Of the fit.
    """
    if not fit.fixed:
        return []
    priors = redundancy == "prior"
    try:
        freed = identify(
            robot,
            data,
            fit.model,
            loss=loss,
            redundancy="prior" if priors else "drop" if bounds is None else "none",
            bounds=bounds,
            bounds_file=bounds_file,
        )
    except InputError:  # nothing but the places held makes a fit possible
        return []
    with_fixed, without = _left(errors_of(fit.robot, data)), _left(errors_of(freed.robot, data))
    added = max(len(freed.free.names) - len(fit.free.names), 1)
    apart = [words for words, size in _apart(fit, freed) if size >= 1.0] if data.anchored and priors else []
    unlikely = bool(apart) and chi_squared_tail(max(_rise(fit, freed, data), 0.0), added) < _CHANCE
    freedom = with_fixed[2] - len(freed.free.names)
    misfit = (
        freedom >= _LEAST_FREEDOM
        and with_fixed[0] > max(_MORE * without[0], _NEGLIGIBLE)
        and (with_fixed[0] ** 2 - without[0] ** 2) / added > _LEAST_F * without[0] ** 2 / freedom
    )
    if not misfit and not unlikely:
        return _strained(fit, freed) if priors else []
    message = "The places that are held contradict the readings"
    if misfit:
        message += (
            f": with them the fit leaves {with_fixed[0] * 1e3:.3g} mm of the training readings, with all of them found "
            f"{without[0] * 1e3:.3g} mm (root mean square)"
        )
    if apart and unlikely:
        message += f"{'. Found' if misfit else ': found'} from the readings, {listed(apart)} from where it is held"
    message += (
        ". Check the numbers, their units and what they refer to: the base is the frame of the robot's table, whose z "
        "axis is axis 1 in most conventions, and a tool is given in the flange's frame. Or do not hold them."
    )
    return [HOLD_CONTRADICTS(message)]


HOLD_STRAINED: Final = Rule(
    "hold-strained",
    "warning",
    "with the places held, a parameter is beyond 2.5 times its prior that is within it where they are found: it may "
    "have taken up an error of the held numbers",
    cure="Check them; what is expected of the robot takes them as exact.",
)


def _strained(fit: Fit, freed: Fit) -> list[Notice]:
    """Return a notice if parameters of the arm go far with the places held, and only then."""

    def far(fitted: Fit, p: Parameter) -> float:
        return (fitted.robot.values[p.name] - p.nominal) / p.prior

    strained = [
        f"{p.name} ({far(fit, p):+.1f} times its prior)"
        for p in fit.free.parameters
        if p.group not in PLACES and abs(far(fit, p)) > _STRAINED and abs(far(freed, p)) < _AT_EASE
    ]
    if not strained:
        return []
    return [
        HOLD_STRAINED(
            f"With the places held, {listed(strained)} went far from nominal, and with all of them found not. That is "
            "what an error of the held numbers does which the readings cannot show."
        )
    ]


def _left(errors: Errors) -> tuple[float, int, int]:
    """Return the root mean square of what is left [m], of how many readings, and how many numbers they are."""
    positions, lengths = (
        np.zeros(0) if e is None else e.ravel()[np.isfinite(e.ravel())]
        for e in (errors.position_norms, errors.length_errors)
    )
    every = np.concatenate([positions, lengths])
    rms = float(np.sqrt(np.mean(every**2))) if len(every) else 0.0
    return rms, len(every), 3 * len(positions) + len(lengths)


def _rise(fit: Fit, freed: Fit, data: Dataset) -> float:
    """Return by how much the squares of readings and priors rise with the places held, in units of what is left."""
    with_fixed, without = _squares(fit, freed.sigma, data), _squares(freed, freed.sigma, data)
    left = without[0] / max(without[1] - len(freed.free.names), 1)
    return (sum(with_fixed[::2]) - sum(without[::2])) / max(left, 1.0)


def _squares(fit: Fit, sigma: Mapping[str, float], data: Dataset) -> tuple[float, int, float]:
    """Return the squares of the whitened readings, their number, and those of the arm's own priors."""
    problem = Problem(fit.robot, data, fit.free, {o.name: sigma.get(o.name, 1.0) for o in OBSERVATIONS})
    residual = problem.residual(np.array([fit.robot.values[name] for name in fit.free.names]))
    moved = [(fit.robot.values[p.name] - p.nominal) / p.prior for p in fit.free.parameters if p.group not in PLACES]
    return float(residual @ residual), len(residual), float(np.sum(np.square(moved)))


def _apart(fit: Fit, freed: Fit) -> Iterator[tuple[str, float]]:
    """Yield what is held: how far it is found from there, in words and by what is far."""
    if fit.fixed.base is not None:
        place = _place(freed.robot, "base", freed.robot.base_quaternion)
        yield _difference("the base", place, fit.fixed.base, turned=True)
    for target in freed.robot.targets:
        if target.name in fit.fixed.targets:
            place = _place(freed.robot, target.parameter("x")[:-2], target.quaternion)
            fixed = fit.fixed.targets[target.name]
            yield _difference(f"target {target.name}", place, fixed, turned=target.quaternion is not None)


def _place(robot: Robot, prefix: str, quaternion: tuple[float, float, float, float] | None) -> Transform:
    """Return a place by its parameters; small turns come behind the reference orientation."""
    position = np.array([robot.values[f"{prefix}_{axis}"] for axis in "xyz"])
    if quaternion is None:
        return Transform.from_matrix(np.eye(3), position)
    small = np.array([robot.values[f"{prefix}_{axis}"] for axis in ("rx", "ry", "rz")])
    return Transform.from_matrix(rotation_from_quaternion(np.array(quaternion)) @ rotation_from_vector(small), position)


def _difference(name: str, place: Transform, fixed: Transform, *, turned: bool) -> tuple[str, float]:
    """Return how far a place is found from where it is held: in words, and in what counts as far."""
    shift = float(np.linalg.norm(np.array(place.translation) - np.array(fixed.translation)))
    words, size = f"{name} is {shift * 1e3:.3g} mm", shift / _APART[0]
    if turned:
        turn = float(np.linalg.norm(rotation_vector((fixed.rotation.T @ place.rotation)[None])[0]))
        words += f" and {math.degrees(turn):.2g} deg"
        size = max(size, turn / _APART[1])
    return words, size
