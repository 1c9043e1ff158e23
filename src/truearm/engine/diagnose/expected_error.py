"""The error of the targets' positions that a fit lets expect over the whole workspace.

The held-out error is one of configurations like those that were measured. Elsewhere the positions depend on directions
of the parameters that the data may have left to the priors. The covariance of the parameters says how far: errors of
the parameters are drawn from it, and each draw moves the targets at configurations drawn evenly within the joint
limits. A real robot is one such draw. A few directions dominate where the data are narrow, so the mean error over the
workspace is itself uncertain: the interval is that of the draws' means (a predictive interval, Gelman et al. 2013,
section 1.3), not one of an average over robots.

Where no reading locates the robot, its base pose does not count: whoever uses the robot locates it. Its scale does
count. Nobody sets it right afterwards, so where no length was measured it is as uncertain as the nominal lengths.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.position_errors import PositionErrors, error_by_joints
from truearm.engine.diagnose.unseen import Unseen
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot

#: Configurations at which positions are asked for, and draws of the parameters' errors: fewer for many targets.
_CONFIGURATIONS: Final = (60, 200)
_DRAWS: Final = (100, 600)
_POSITIONS: Final = 3_000
_LENGTHS: Final = 3_000_000
#: Share of the squared error from which what the model leaves makes the figure a lower bound.
_LEAST_BY_JOINTS: Final = 0.1
#: Configurations of a map, however many targets there are.
_LEAST_MAPPED: Final = 20
_INTERVAL: Final = (5.0, 95.0)


@dataclass(frozen=True)
class Expectation:
    """What to expect of an error over the workspace [m]."""

    mean: float  #: Expected mean error.
    p95: float  #: Expected 95th percentile over the configurations.
    #: From where to where the mean error of this robot lies with a probability of 90 %.
    interval_90: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ExpectedError:
    """The error of the targets' positions to expect over the workspace, without the noise of a reading [m]."""

    overall: Expectation  #: Of all targets together.
    #: The same without errors of the scale, where no length was measured: what more configurations can lower.
    without_scale: Expectation
    targets: dict[str, Expectation]  #: Of each, by its name.
    #: Error of each joint in every visit that is in it, a standard deviation [rad or m]: repeatability, what the model
    #: leaves, and what follows the direction of approach.
    joint_error: Array
    by_joint_error: float  #: Root mean square of what that does to the targets.
    payload: Payload  #: What the robot carries there.
    located: bool  #: Whether a reading locates the robot; otherwise its base pose does not count.
    omissions: tuple[str, ...]  #: What the figures cannot contain, in words; they are lower bounds if there is any.

    @property
    def lower_bound(self) -> bool:
        """Whether the error may be larger than the figures say, for a reason that is known."""
        return bool(self.omissions)

    @property
    def frame(self) -> str:
        """What the positions are in, in words."""
        return "the instrument's frame" if self.located else "the robot's base frame, up to its pose"


def expected_error(
    fit: Fit,
    seed: int = 0,
    *,
    unseen: Unseen | None = None,
    by_order: Array | None = None,
    plausible: bool = True,
    doubted: bool = False,
) -> ExpectedError:
    """Return the error of the targets' positions to expect over the workspace.

    Joint positions are drawn evenly within the limits (or a turn, or 1 m), with payload and gravity of the fit. Base
    and targets are as fitted, with their own uncertainty. What depends on the order of measurement or the temperature
    is in its middle.

    Args:
        seed: Of joint positions and draws.
        unseen: Readings that the fit was not trained on: draws count as far as they agree with its errors there.
        by_order: What predictions do not know of each joint, as :func:`moved_by_order` returns it.
        plausible: Whether what was fitted can be this robot.
        doubted: Whether readings are doubted: then nothing is said of the robot for what they leave.
    """
    robot = fit.robot
    few, many = _CONFIGURATIONS
    count = min(many, max(few, _POSITIONS // max(len(robot.targets), 1)))
    few, many = _DRAWS
    draws = min(many, max(few, _LENGTHS // (count * max(len(robot.targets), 1))))
    joints = _all_over(robot, count, np.random.default_rng(seed))
    by_joints = error_by_joints(fit, joints)
    counts = np.arange(draws) if unseen is None else unseen.agreeing(PositionErrors(fit, draws, seed))
    if by_order is not None:
        fit = replace(fit, joint_error=np.hypot(fit.joint_error, by_order))
    lengths = PositionErrors(fit, draws, seed).at(joints)[counts]
    overall = without_scale = _expectation(lengths.reshape(draws, -1))
    if "size" in fit.gauge_freedoms:
        without_scale = _expectation(PositionErrors(fit, draws, seed, scale_counts=False).at(joints).reshape(draws, -1))
    return ExpectedError(
        overall=overall,
        without_scale=without_scale,
        targets={t.name: _expectation(lengths[:, k]) for k, t in enumerate(robot.targets)},
        joint_error=fit.joint_error,
        by_joint_error=error_by_joints(fit, joints),
        payload=robot.payload,
        located=not fit.gauge_freedoms,
        omissions=tuple(_omissions(fit, by_joints, overall, plausible=plausible, doubted=doubted)),
    )


def moved_by_order(robot: Robot, data: Dataset) -> Array:
    """Return by how much the direction of approach moves each joint, a root mean square ``(joints,)`` [rad or m].

    Predictions do not know it, and count it as an error of the joint.

    Args:
        data: Of the campaign.
    """
    at = robot.loaded(data.postures)
    known, unknown = (robot.variables(q, robot.values) for q in (at, replace(at, approach=None)))
    return np.asarray(np.sqrt(np.mean((known - unknown)[: len(robot.joints)] ** 2, axis=1)))


def error_by_order(robot: Robot, data: Dataset) -> float:
    """Return how far predictions without an order lie from those of a campaign, a root mean square [m]."""
    at = robot.loaded(data.postures)
    unknown = replace(at, approach=None, number=None)
    apart = [robot.world_poses(at, t.name)[0] - robot.world_poses(unknown, t.name)[0] for t in robot.targets]
    return math.sqrt(float(np.mean(np.sum(np.square(apart), axis=-1))))


def expected_map(fit: Fit, positions: int, seed: int = 0) -> tuple[Array, Array]:
    """Return where the targets are at random configurations and the mean error to expect there.

    Args:
        positions: About how many, over all targets.

    Returns:
        places, error: In the robot's base frame [m], ``(positions, 3)``, and [m], ``(positions,)``.
    """
    robot = fit.robot
    count = max(_LEAST_MAPPED, positions // max(len(robot.targets), 1))
    joints = robot.random_configurations(count, np.random.default_rng((seed, 2)))
    error = PositionErrors(fit, _DRAWS[0], seed).at(joints).mean(axis=0)
    return np.concatenate([robot.forward(joints, target=target.name)[0] for target in robot.targets]), error.reshape(-1)


def _all_over(robot: Robot, count: int, rng: np.random.Generator) -> Array:
    """Return joint positions ``(count, joints)``, evenly spread within the limits of every joint.

    A Latin hypercube (McKay, Beckman and Conover 1979): means over it vary less than over independent ones.
    """
    low, high = np.array([joint.range for joint in robot.joints]).T
    slices = rng.permuted(np.tile(np.arange(count), (len(low), 1)), axis=1).T
    return np.asarray(low + (high - low) * (slices + rng.random(slices.shape)) / count)


_ELSEWHERE: Final = 0.1


def _expectation(lengths: Array) -> Expectation:
    """Summarise lengths ``(draws, positions)``."""
    means = lengths.mean(axis=1)
    low, high = np.percentile(means, _INTERVAL)
    return Expectation(
        mean=float(means.mean()),
        p95=float(np.percentile(lengths, 95, axis=1).mean()),
        interval_90=(float(low), float(high)),
    )


def _omissions(fit: Fit, by_joints: float, overall: Expectation, *, plausible: bool, doubted: bool) -> Iterator[str]:
    """Say what the covariance cannot know."""
    if fit.status is Status.NOT_CONVERGED:
        yield "the fit did not converge"
    if not plausible:
        yield "what was fitted cannot be this robot"
    if not fit.knows_geometry:
        yield "the robot's own geometry counts as exact"
    if fit.before is not None and fit.before.lower_bound:
        yield "the calibration before left out what may do more"
    if fit.at_bound:
        yield "values at a bound count as exact"
    if doubted and (fit.excess > 1.0 or by_joints**2 > _LEAST_BY_JOINTS * overall.mean**2):
        yield "readings are doubted, and what they do to the fit is in it only as far as they leave it unexplained"
    elif fit.excess > 1.0:
        yield "the residuals are larger than the declared deviations, and what makes them so may do more elsewhere"
    elif by_joints**2 > _LEAST_BY_JOINTS * overall.mean**2:
        yield "what the model cannot express is in it only as far as it was seen where the robot was measured"
