"""How good would a calibration be: many simulated ones at once, as one array computation.

Each trial draws true parameter values from the priors, measures them with noise of its own, and is calibrated by
Gauss-Newton from the nominal values. The trials are a leading axis of the parameter values, which the chain and the
problem carry through, so a step is a few array operations on a block of trials that fits the processor's cache.
The normal equations are good enough here, scaled by the priors and with noise in the data: what rounding leaves of
one step, the next one removes, because the gradient is formed anew from the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.models import Model
from truearm.identification.solving.problem import Problem
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

_BLOCK: Final = 9_000  # readings swept together, so that their Jacobian stays in the cache
_STEPS: Final = 12
_SMALL: Final = 1e-9  # priors


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Simulated calibrations of one robot at one set of configurations."""

    problem: Problem  #: The calibration of the nominal robot from readings of itself.
    #: How far the readings of each trial lie from those, in their standard deviations, ``(trials, rows)``.
    readings: Array
    #: truth, estimate, deviation: true values of the problem's free parameters, identified values, and the standard
    #: deviations that the calibration states for these [SI], each ``(trials, parameters)``. Base and targets are true
    #: at the robot's own values.
    truth: Array
    estimate: Array
    deviation: Array
    converged: NDArray[np.bool_]  #: Whether the steps of a trial settled, ``(trials,)``.
    #: Distance from the true to the predicted position at configurations that no calibration saw [m], ``(trials,
    #: targets, configurations)``.
    position_error: Array

    @property
    def informed(self) -> Array:
        """Share of the prior variance that the data removed, ``(trials, parameters)``."""
        return 1.0 - (self.deviation / self.problem.free.prior) ** 2

    def dataset(self, trial: int) -> Dataset:
        """Return the readings of a trial as a calibration of its own would get them."""
        nominal = self.problem.data
        if nominal.sigma is None:
            raise ValueError("the readings have no standard deviation")
        moved = self.readings[trial].reshape(-1, 3) * nominal.sigma[:, None]
        return replace(nominal, source=f"trial {trial + 1}", position=nominal.position + moved)


def monte_carlo(
    robot: Robot,
    q: Array,
    model: Model,
    sigma: float,
    trials: int,
    rng: np.random.Generator,
    held_out: Array,
) -> MonteCarlo:
    """Simulate calibrations from position readings of all targets of a robot.

    Args:
        robot: The nominal robot, with its targets; its priors say what true robots are like.
        q: Joint positions of the calibration, ``(configurations, joints)``.
        model: Which parameters are free. Those of joints and links are drawn, base and targets are only identified.
        sigma: Standard deviation of each measured coordinate [m].
        trials: Number of calibrations.
        held_out: Joint positions at which the calibrated robots are judged, ``(configurations, joints)``.
    """
    problem = of_itself(model.prepared(robot), q, model, sigma)
    free = problem.free
    drawn = np.array([p.group not in ("base", "target") for p in free.parameters])
    truth = free.nominal + free.prior * drawn * rng.standard_normal((trials, len(free.names)))
    readings = rng.standard_normal((trials, problem.rows))
    estimate, deviation = np.empty_like(truth), np.empty_like(truth)
    converged = np.empty(trials, dtype=bool)
    size = max(1, _BLOCK // len(problem.components))
    for block in (slice(first, first + size) for first in range(0, trials, size)):
        readings[block] += problem.at(truth[block]).residual
        estimate[block], deviation[block], converged[block] = calibrated(problem, readings[block])
    errors = [_position_errors(problem, truth, estimate, held_out, target.name) for target in robot.targets]
    return MonteCarlo(problem, readings, truth, estimate, deviation, converged, np.stack(errors, axis=1))


def of_itself(robot: Robot, q: Array, model: Model, sigma: float) -> Problem:
    """Return the calibration of a robot from what an instrument without noise reads of it."""
    positions = [robot.world_poses(q, target.name)[0] for target in robot.targets]
    data = Dataset(
        source="simulation",
        labels=tuple(str(i + 1) for i in range(len(q))),
        joints=np.asarray(q, float),
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=tuple(target.name for target in robot.targets),
        configuration=np.tile(np.arange(len(q)), len(positions)),
        target=np.repeat(np.arange(len(positions)), len(q)),
        position=np.concatenate(positions),
        sigma=np.full(len(q) * len(positions), sigma),
    )
    return Problem(robot, data, model.free(robot), {})


def calibrated(problem: Problem, readings: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Calibrate many robots at once, each as if it were alone: whatever stands beside it, to the last digit.

    Args:
        readings: As in :class:`MonteCarlo`.

    Returns:
        Estimates and deviations [SI], ``(trials, parameters)``, and whether they settled, ``(trials,)``.
    """
    nominal, prior = problem.free.nominal, problem.free.prior
    x = np.tile(nominal, (len(readings), 1))
    information = np.empty((*x.shape, x.shape[1]))
    before = np.empty(len(x))
    going = np.arange(len(x))
    for number in range(_STEPS):
        # All begin at the nominal values: one Jacobian serves the first step of them all.
        here = problem.at(x[going] if number else nominal[None])
        r, J = here.residual - readings[going], here.jacobian
        Jt = np.swapaxes(J, 1, 2)
        information[going] = (Jt @ J) * np.outer(prior, prior) + np.eye(len(prior))
        gradient = (Jt @ r[:, :, None])[:, :, 0] * prior + (x[going] - nominal) / prior
        step = -np.linalg.solve(information[going], gradient[:, :, None])[:, :, 0]
        x[going] += step * prior
        size = np.abs(step).max(axis=1)
        settled = size < _SMALL
        if number:  # what the next step would be, at most
            settled |= size * size < _SMALL * before[going]
        before[going] = size
        going = going[~settled]
        if not len(going):
            break
    left = np.zeros(len(x), dtype=bool)
    left[going] = True
    variance = np.diagonal(np.linalg.inv(information), axis1=1, axis2=2)
    return x, prior * np.sqrt(variance), ~left


def _position_errors(problem: Problem, truth: Array, estimate: Array, q: Array, target: str) -> Array:
    robot, free = problem.robot, problem.free
    apart = np.empty((len(truth), len(q)))
    size = max(1, _BLOCK // len(q))
    for block in (slice(first, first + size) for first in range(0, len(truth), size)):
        true, found = (
            robot.forward_kinematics(q, target, {**robot.values, **free.values(vectors[block])}).position
            for vectors in (truth, estimate)
        )
        apart[block] = np.linalg.norm(found - true, axis=0)
    return apart
