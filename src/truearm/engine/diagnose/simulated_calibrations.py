"""Intervals by Monte Carlo: the calibration repeated on simulated readings of the robot that it found.

The intervals of a fit are linear: covariances at its solution. Here the robot that was found is measured again and
again at the training configurations, with noise and errors of the joints as the fit found them, begins each time from a
nominal robot that is off from it as the priors say, and is calibrated by Gauss-Newton steps with derivatives of its
own. What the estimates miss the truth by needs no linearity (JCGM 101:2008). Where errors of the joints do not explain
how residuals hang together, the residuals of each visit themselves are drawn, all of them with one random sign (a
wild bootstrap by clusters, Cameron, Gelbach and Miller 2008). Many trials are a leading axis of the
parameter values, as in :mod:`truearm.fleets.series`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, listed
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.diagnose.position_errors import PositionErrors, moved_lengths
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.models import Model
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import PLACES, FreeParameters
from truearm.engine.robot.robot import Robot

_STEPS: Final = 15
_SMALL: Final = 1e-6  # priors
#: Numbers of derivatives that are formed together.
_TOGETHER: Final = 2_000_000
#: Standard deviations to both sides that hold 95 %.
_WIDE: Final = 1.959964
_INTERVAL_95: Final = (2.5, 97.5)
_INTERVAL_90: Final = (5.0, 95.0)
_CONFIGURATIONS: Final = 60
#: Share of the trials that may be lost without a word.
_MOST_LOST: Final = 0.02
#: Informed share from which a parameter's intervals are compared, and how many times wider than linear is too wide,
#: beyond what chance makes in so many trials (standard deviations).
_INFORMED: Final = 0.5
_WIDER: Final = 1.2
_CHANCE: Final = 4.0
#: Trials by which lengths of errors are averaged.
_MOST_LENGTHS: Final = 1000


@dataclass(frozen=True)
class PredictedError:
    """Mean position error that errors of the parameters make at some configurations [m]."""

    mean: float  #: mean, interval_90: by Monte Carlo.
    interval_90: tuple[float, float]
    linear_mean: float  #: linear_mean, linear_interval_90: by the covariance.
    linear_interval_90: tuple[float, float]


@dataclass(frozen=True, eq=False)
class SimulatedCalibrations:
    """Calibrations of the robot that a fit has found, from simulated readings."""

    names: tuple[str, ...]  #: Of the parameters, in the order of the fit.
    #: estimate, linear_deviation: values that the fit found, and their standard deviations in it [SI],
    #: ``(parameters,)``.
    estimate: Array
    linear_deviation: Array
    error: Array  #: Estimate minus truth in each trial that settled [SI], ``(trials, parameters)``.
    #: Standard deviations that each of these trials states [SI], likewise; those of the fit where its covariance
    #: follows from the scatter of the visits.
    stated: Array
    asked: int  #: How many trials were made.
    seed: int  #: Of the trials.
    #: Error of predictions at the held-out configurations (the training ones, if nothing was held out).
    held_out: PredictedError | None
    #: Likewise over the whole workspace; None where parameters were held as redundant.
    workspace: PredictedError | None

    @property
    def settled(self) -> int:
        """How many trials ended at a solution."""
        return len(self.error)

    @property
    def deviation(self) -> Array:
        """Standard deviation of each parameter by Monte Carlo [SI], ``(parameters,)``."""
        return np.asarray(np.sqrt(np.mean(self.error**2, axis=0)))

    @property
    def interval_95(self) -> Array:
        """Where each parameter lies with 95 % by Monte Carlo [SI], ``(parameters, 2)``."""
        low, high = np.percentile(self.error, _INTERVAL_95, axis=0)
        return np.stack([self.estimate - high, self.estimate - low], axis=1)

    @property
    def linear_interval_95(self) -> Array:
        """Where each lies by the covariance [SI], ``(parameters, 2)``."""
        wide = _WIDE * self.linear_deviation
        return np.stack([self.estimate - wide, self.estimate + wide], axis=1)

    @property
    def coverage(self) -> Array:
        """Share of the trials whose linear interval of 95 % holds the truth, ``(parameters,)``."""
        return np.asarray(np.mean(np.abs(self.error) <= _WIDE * self.stated, axis=0))


def simulated_calibrations(
    fit: Fit,
    training: Dataset,
    judged: Dataset,
    trials: int,
    *,
    priors: bool,
    seed: int = 0,
    progress: Callable[[int], None] = lambda _: None,
) -> SimulatedCalibrations:
    """Repeat a calibration on simulated readings.

    Args:
        training: What the fit was made from: where the robot is measured, and with which deviations.
        judged: Readings at whose configurations predictions are compared.
        trials: How many.
        priors: Whether the priors take part, as in the fit.
        seed: Of the trials.
        progress: Called with the number of trials that are done.
    """
    rng = np.random.default_rng((seed, 4))
    problem, whitening, scatter = _of_itself(fit, training, priors=priors)
    linear = np.sqrt(np.diag(fit.covariance))
    size = max(1, min(trials, min(_TOGETHER, limit("derivatives")) // max(problem.rows * len(problem.free.names), 1)))
    truth = problem.free.start
    at_truth = problem.at(truth).residual
    drawn = np.array([priors and p.group not in PLACES for p in problem.free.parameters])
    errors, stated, settled = [], [], []
    for first in range(0, trials, size):
        count = min(size, trials - first)
        centre = truth + problem.free.prior * drawn * rng.standard_normal((count, len(truth)))
        readings = at_truth + scatter(rng, count)
        estimate, deviation, has_settled = _calibrated(problem, whitening, readings, centre)
        errors.append(estimate - truth)
        stated.append(np.tile(linear, (count, 1)) if fit.scattered else deviation)
        settled.append(has_settled)
        progress(first + count)
    converged = np.concatenate(settled)
    error = np.concatenate(errors)[converged]
    names = problem.free.names
    return SimulatedCalibrations(
        names=names,
        estimate=truth,
        linear_deviation=linear,
        error=error,
        stated=np.concatenate(stated)[converged],
        asked=trials,
        seed=seed,
        held_out=_predicted(fit, judged.joints, names, error),
        workspace=None
        if fit.redundancies
        else _predicted(
            fit, fit.robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(seed)), names, error
        ),
    )


def _of_itself(
    fit: Fit, data: Dataset, *, priors: bool
) -> tuple[Problem, Whitening | None, Callable[[np.random.Generator, int], Array]]:
    """Return the problem at the robot found, what makes its equations independent, and what draws their scatter."""
    noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    free = FreeParameters(tuple(fit.robot.parameters[name] for name in fit.free.names))
    problem = Problem(fit.robot, data, free, noise, priors, fit.excess)
    visits = problem.visits
    if fit.scattered:
        residual = problem.at(free.start).residual
        taken = sum(p.informed or 0.0 for p in free.parameters)
        residual = residual * math.sqrt(problem.rows / max(problem.rows - taken, 1.0))

        def signed(rng: np.random.Generator, count: int) -> Array:
            sign = rng.choice([-1.0, 1.0], (count, int(visits.max()) + 1))
            return np.asarray(residual * sign[:, visits])

        return problem, None, signed
    if not fit.joint_error.any():
        return problem, None, lambda rng, count: rng.standard_normal((count, problem.rows))
    shared = problem.at(free.start).by_joints * fit.joint_error

    def scatter(rng: np.random.Generator, count: int) -> Array:
        joints = rng.standard_normal((count, int(visits.max()) + 1, shared.shape[1]))
        return np.asarray(
            rng.standard_normal((count, problem.rows)) + np.einsum("rj,trj->tr", shared, joints[:, visits])
        )

    return problem, Whitening(Visits(visits), shared), scatter


def _calibrated(
    problem: Problem, whitening: Whitening | None, readings: Array, centre: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return estimates, their deviations, and whether they settled, for trials.

    Args:
        readings: How far the simulated readings lie from the measured ones, in their deviations, ``(trials, rows)``.
        centre: Nominal values, from which each trial begins, ``(trials, parameters)``.
    """
    prior = problem.free.prior
    ridge = np.eye(len(prior)) if problem.priors else np.zeros((len(prior),) * 2)
    x = centre.copy()
    for _ in range(_STEPS):
        evaluation = problem.at(x)
        r, J = evaluation.residual - readings, evaluation.jacobian * prior
        if whitening is not None:
            rows = np.concatenate([r[:, :, None], J], axis=2)
            whole = whitening.applied(np.moveaxis(rows, 1, 0).reshape(rows.shape[1], -1))
            rows = np.moveaxis(whole.reshape(rows.shape[1], len(x), -1), 0, 1)
            r, J = rows[:, :, 0], rows[:, :, 1:]
        Jt = np.swapaxes(J, 1, 2)
        information = Jt @ J + ridge
        gradient = (Jt @ r[:, :, None])[:, :, 0] + ridge.diagonal() * (x - centre) / prior
        step = -np.linalg.solve(information, gradient[:, :, None])[:, :, 0]
        x = x + step * prior
        settled = np.asarray(np.abs(step).max(axis=1) < _SMALL)
        if settled.all():
            break
    variance = np.diagonal(np.linalg.inv(information), axis1=1, axis2=2)
    return x, prior * np.sqrt(np.maximum(variance, 0.0)), settled


def _predicted(fit: Fit, joints: Array, names: tuple[str, ...], error: Array) -> PredictedError | None:
    """Return what errors of the parameters do to positions, beside what their covariance says of it."""
    if not len(error):
        return None
    some = joints[np.unique(np.linspace(0, len(joints) - 1, min(len(joints), _CONFIGURATIONS)).round().astype(np.intp))]
    part = error[:_MOST_LENGTHS]
    by_trials = moved_lengths(fit, some, dict(zip(names, part.T, strict=True))).mean(axis=(1, 2))
    plain = replace(fit, joint_error=np.zeros_like(fit.joint_error))
    linear = PositionErrors(plain, 400).at(some).mean(axis=(1, 2))
    low, high, linear_low, linear_high = (
        float(end) for values in (by_trials, linear) for end in np.percentile(values, _INTERVAL_90)
    )
    return PredictedError(float(by_trials.mean()), (low, high), float(linear.mean()), (linear_low, linear_high))


def refuse_too_many(robot: Robot, training: Dataset, model: Model) -> None:
    """Refuse readings whose derivatives one trial would not have room for, before anything is fitted.

    Args:
        robot: In the frames of the readings.
    """
    start = model.prepared(robot)
    problem = Problem(start, training, model.free(start), {observation.name: 1.0 for observation in OBSERVATIONS})
    refuse_beyond("derivatives", problem.rows * len(problem.free.names), where=training.source)


TRIALS_LOST: Final = Rule(
    "trials-lost",
    "warning",
    "more than 2 % of the simulated calibrations did not converge",
    cure="Measure more configurations, or free fewer parameters.",
)
INTERVALS_TOO_NARROW: Final = Rule(
    "intervals-too-narrow",
    "warning",
    "by Monte Carlo the deviations are wider than the linear ones: [more](results.md#by-monte-carlo)",
    cure="Use the intervals by Monte Carlo.",
    gravity=2,
)


def check_linear(fit: Fit, simulated: SimulatedCalibrations) -> list[Notice]:
    """Say where the linear intervals of a fit are not those of Monte Carlo, and if trials were lost."""
    notices = []
    lost = simulated.asked - simulated.settled
    if lost > _MOST_LOST * simulated.asked:
        notices.append(
            TRIALS_LOST(
                f"{lost} of {simulated.asked} simulated calibrations did not converge, and the intervals by Monte "
                "Carlo are of the rest: the data hardly determine this model."
            )
        )
    if simulated.settled < 2:
        return notices
    known = [
        i
        for i, name in enumerate(simulated.names)
        if (fit.robot.parameters[name].informed or 0.0) > _INFORMED and simulated.linear_deviation[i] > 0.0
    ]
    ratio = {simulated.names[i]: float(simulated.deviation[i] / simulated.linear_deviation[i]) for i in known}
    chance = _CHANCE / math.sqrt(2.0 * simulated.settled)
    wider = sorted((name for name in ratio if ratio[name] > _WIDER + chance), key=lambda name: -ratio[name])
    if wider:
        notices.append(
            INTERVALS_TOO_NARROW(
                f"By Monte Carlo the deviations of {listed(wider)} are up to {ratio[wider[0]]:.2g} times the linear "
                "ones: the model bends too much for these."
            )
        )
    return notices
