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
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.fit.problem import gauge_motions
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

#: Configurations at which positions are asked for, and draws of the parameters' errors: fewer for many targets.
_CONFIGURATIONS: Final = (60, 200)
_DRAWS: Final = (100, 600)
_POSITIONS: Final = 3_000
_LENGTHS: Final = 3_000_000
#: Deviation of an angle from which the derivatives are compared with the kinematics themselves [rad].
_LARGE_ANGLE: Final = 5e-3
#: Share of the error by which the derivatives may be wrong, and what it is tried on.
_CURVED: Final = 0.05
_TRIED_DRAWS: Final = 12
_TRIED_CONFIGURATIONS: Final = 40
#: Share of the squared error from which what the model leaves makes the figure a lower bound.
_LEAST_BY_JOINTS: Final = 0.1
#: Share of the equations that parameters leave to the residuals at least.
_LEAST_LEFT: Final = 0.1
#: Configurations of a map, however many targets there are.
_LEAST_MAPPED: Final = 20
#: Motions of everything that never count where no reading locates the robot.
_BASE: Final = ("base",)
#: So that the variance of what is drawn exists.
_LEAST_FREEDOM: Final = 3.0
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


@dataclass(frozen=True, eq=False)
class PositionErrors:
    """Errors of the targets' positions that the covariance of a fit lets expect, drawn at random."""

    fit: Fit  #: Whose.
    draws: int  #: How many.
    seed: int = 0  #: Of the draws.
    scale_counts: bool = True  #: Whether errors of the scale count where no length was measured.

    @cached_property
    def _errors(self) -> dict[str, Array]:
        """Errors of the parameters by name, ``(draws,)`` each [SI]."""
        fit, names = self.fit, uncertain_names(self.fit)
        rng = np.random.default_rng(self.seed)
        errors, last = np.zeros((len(names), self.draws)), len(fit.covariance_parts) - 1
        for number, (part, scale) in enumerate(zip(fit.covariance_parts, self._scales, strict=True)):
            root = covariance_root(fit, part.covariance, with_fixed=number == last)
            normal = rng.standard_normal((self.draws, root.shape[1]))
            if self.draws > 2 * root.shape[1]:
                # So few draws have a covariance of their own: they are turned and stretched to the one they are of.
                normal -= normal.mean(axis=0)
                normal = np.linalg.qr(normal)[0] * math.sqrt(self.draws)
            errors += root @ normal.T * scale
        return dict(zip(names, errors, strict=True))

    @cached_property
    def _scales(self) -> list[Array]:
        """How many times larger the errors of each draw are, ``(draws,)``, by the part of the covariance.

        Variances that were estimated are uncertain themselves: errors have Student's distribution (Gelman et al. 2013,
        section 3.2).
        """
        return [
            _student(part.freedom, chance)
            for part, chance in zip(self.fit.covariance_parts, self._chances, strict=True)
        ]

    @cached_property
    def _joint_scale(self) -> Array:
        """Likewise of the errors of the joints, ``(draws, joints)``."""
        fit = self.fit
        chance = np.tile(self._chances[0], (len(fit.joint_error), 1))
        for part, part_chance in zip(fit.covariance_parts, self._chances, strict=True):
            chance[list(part.joints)] = part_chance
        return np.stack(
            [_student(known, of_joint) for known, of_joint in zip(fit.joint_freedom.tolist(), chance, strict=True)]
        ).T

    @cached_property
    def _chances(self) -> Array:
        """Probabilities of lower variances than those of each draw, evenly spread, ``(parts, draws)``."""
        rng = np.random.default_rng((self.seed, 3))
        evenly = np.tile((np.arange(self.draws) + 0.5) / self.draws, (len(self.fit.covariance_parts), 1))
        return rng.permuted(evenly, axis=1)

    @cached_property
    def _is_curved(self) -> bool:
        """Whether the errors of angles are so large that derivatives would mislead."""
        fit = self.fit
        turned = [float(np.std(e)) for n, e in self._errors.items() if fit.robot.parameters[n].unit == "rad"]
        if max(turned, default=0.0) < _LARGE_ANGLE:
            return False
        rng = np.random.default_rng(self.seed)
        at = fit.robot.loaded(fit.robot.random_configurations(_TRIED_CONFIGURATIONS, rng))
        some = {name: error[:_TRIED_DRAWS] for name, error in self._errors.items()}
        straight, curved = (np.stack([*_moves(fit, at, some, exact=exact)]) for exact in (False, True))
        return bool(
            np.linalg.norm(curved - straight, axis=2).mean() > _CURVED * np.linalg.norm(straight, axis=2).mean()
        )

    def at(self, joints: Array) -> Array:
        """Return the lengths of the errors at joint positions ``(n, joints)``: ``(draws, targets, n)`` [m]."""
        fit, at = self.fit, self.fit.robot.loaded(joints)
        shape = (self.draws, len(joints), len(fit.joint_error))
        normal = np.random.default_rng((self.seed, 1)).standard_normal(shape) if fit.joint_error.any() else None
        shared = None if normal is None else normal * fit.joint_error * self._joint_scale[:, None]
        moves: Iterable[Array] = _moves(fit, at, self._errors, shared, exact=self._is_curved)
        if fit.gauge_freedoms:
            moves = _without(_BASE if self.scale_counts else fit.gauge_freedoms, fit, at, np.stack([*moves]))
        return np.stack([np.sqrt(np.einsum("dxn,dxn->dn", move, move)) for move in moves], axis=1)


def moved_lengths(fit: Fit, joints: Array, errors: Mapping[str, Array]) -> Array:
    """Return how far errors of parameters ``(draws,)`` move the targets, by the kinematics themselves.

    Args:
        joints: Where, ``(n, joints)``.

    Returns:
        Lengths [m], ``(draws, targets, n)``.
    """
    at = fit.robot.loaded(joints)
    moves: Iterable[Array] = _moves(fit, at, errors, exact=True)
    if fit.gauge_freedoms:
        moves = _without(_BASE, fit, at, np.stack([*moves]))
    return np.stack([np.sqrt(np.einsum("dxn,dxn->dn", move, move)) for move in moves], axis=1)


def expected_error(
    fit: Fit, seed: int = 0, *, by_order: Array | None = None, plausible: bool = True, doubted: bool = False
) -> ExpectedError:
    """Return the error of the targets' positions to expect over the workspace.

    Joint positions are drawn evenly within the limits (or a turn, or 1 m), with payload and gravity of the fit. Base
    and targets are as fitted, with their own uncertainty. What depends on the order of measurement or the temperature
    is in its middle.

    Args:
        seed: Of joint positions and draws.
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
    by_joints = _error_by_joints(fit, joints)
    if by_order is not None:
        fit = replace(fit, joint_error=np.hypot(fit.joint_error, by_order))
    lengths = PositionErrors(fit, draws, seed).at(joints)
    overall = without_scale = _expectation(lengths.reshape(draws, -1))
    if "size" in fit.gauge_freedoms:
        without_scale = _expectation(PositionErrors(fit, draws, seed, scale_counts=False).at(joints).reshape(draws, -1))
    return ExpectedError(
        overall=overall,
        without_scale=without_scale,
        targets={t.name: _expectation(lengths[:, k]) for k, t in enumerate(robot.targets)},
        joint_error=fit.joint_error,
        by_joint_error=_error_by_joints(fit, joints),
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


def as_residuals_allow(fit: Fit, data: Dataset) -> Fit:
    """Return a fit whose joint errors move the targets no further than the readings have been found to lie off.

    Residuals that hang together in another way than errors of the joints make them are not explained by any: what was
    found for the joints is then too large in some directions.

    Args:
        data: The training readings.
    """
    off = errors_of(fit.robot, data).position_norms
    if not fit.joint_error.any() or fit.gauge_freedoms or not len(off):
        return fit
    some = np.linspace(0, data.configurations - 1, min(data.configurations, _CONFIGURATIONS[1])).round()
    moved = _error_by_joints(fit, data.postures.at(some.astype(np.intp)))
    spent = sum(fit.robot.parameters[name].informed or 0.0 for name in fit.free.names)
    left = float(np.mean(off**2)) / max(1.0 - spent / (3 * len(off)), _LEAST_LEFT) - 3.0 * fit.sigma["position"] ** 2
    return replace(fit, joint_error=fit.joint_error * math.sqrt(min(max(left / moved**2, 0.0), 1.0)))


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


def _expectation(lengths: Array) -> Expectation:
    """Summarise lengths ``(draws, positions)``."""
    means = lengths.mean(axis=1)
    low, high = np.percentile(means, _INTERVAL)
    return Expectation(
        mean=float(means.mean()),
        p95=float(np.percentile(lengths, 95, axis=1).mean()),
        interval_90=(float(low), float(high)),
    )


def _error_by_joints(fit: Fit, joints: Array | Postures) -> float:
    """Return the root mean square error of the targets that the joints' error of a visit makes [m]."""
    if not fit.joint_error.any():
        return 0.0
    at = fit.robot.loaded(joints)
    moved = [_by_joints(fit, kinematics) * fit.joint_error[:, None, None] for kinematics in _to_targets(fit, at)]
    return math.sqrt(float(np.mean([np.sum(J**2, axis=(0, 1)) for J in moved])))


def _omissions(fit: Fit, by_joints: float, overall: Expectation, *, plausible: bool, doubted: bool) -> Iterator[str]:
    """Say what the covariance cannot know."""
    if fit.status is Status.NOT_CONVERGED:
        yield "the fit did not converge"
    if not plausible:
        yield "what was fitted cannot be this robot"
    if "geometry" not in fit.model.groups:
        yield "the robot's own geometry counts as exact"
    if fit.at_bound:
        yield "values at a bound count as exact"
    if doubted and (fit.excess > 1.0 or by_joints**2 > _LEAST_BY_JOINTS * overall.mean**2):
        yield "readings are doubted, and what they do to the fit is in it only as far as they leave it unexplained"
    elif fit.excess > 1.0:
        yield "the residuals are larger than the declared deviations, and what makes them so may do more elsewhere"
    elif by_joints**2 > _LEAST_BY_JOINTS * overall.mean**2:
        yield "what the model cannot express is in it only as far as it was seen where the robot was measured"


def _student(freedom: float, chance: Array) -> Array:
    """Return how many times larger than estimated deviations are, ``(draws,)``, with such probabilities."""
    if math.isinf(freedom):
        return np.ones(len(chance))
    from scipy.special import gammaincinv

    known = max(freedom, _LEAST_FREEDOM)
    return np.asarray(np.sqrt(known / (2.0 * gammaincinv(known / 2.0, chance))))


def uncertain_names(fit: Fit) -> tuple[str, ...]:
    """Return the names of the parameters that have errors: those that were free, and those held although uncertain."""
    return (*fit.free.names, *fit.unfitted, *(r.dropped for r in fit.redundancies))


def covariance_root(fit: Fit, covariance: Array, *, with_fixed: bool = True) -> Array:
    """Return a root ``(parameters, rank)`` of a covariance, for the parameters of :func:`uncertain_names`.

    Where there were no priors, parameters that the data do not tell apart from others were held. They are off by what
    the priors of all that take part allow, along combinations that no reading sees: nothing at the configurations that
    were measured, but perhaps elsewhere.

    Args:
        covariance: Of the free parameters and the unfitted ones, ``(free, free)``.
        with_fixed: Whether that of the held ones is added.
    """
    names = uncertain_names(fit)
    size = np.array([fit.start.parameters[name].prior for name in names])
    count = len(fit.free.names) + len(fit.unfitted)
    whole = np.zeros((len(names), len(names)))
    whole[:count, :count] = covariance / np.outer(size[:count], size[:count])
    if fit.redundancies and with_fixed:
        whole += _fixed_covariance(fit, names, size)
    value, direction = np.linalg.eigh(whole)
    return np.asarray(size[:, None] * direction * np.sqrt(np.maximum(value, 0.0)))


def _fixed_covariance(fit: Fit, names: tuple[str, ...], size: Array) -> Array:
    """Return the covariance along the combinations that were held, per prior, ``(parameters, parameters)``."""
    index = {name: place for place, name in enumerate(names)}
    along = np.zeros((len(fit.redundancies), len(names)))
    for row, redundancy in zip(along, fit.redundancies, strict=True):
        for name, coefficient in redundancy.members.items():
            if name in index:
                row[index[name]] = coefficient / size[index[name]]
    return np.asarray(along.T @ np.linalg.pinv(along @ along.T) @ along)


def _moves(
    fit: Fit, at: Postures, errors: Mapping[str, Array], shared: Array | None = None, *, exact: bool
) -> Iterator[Array]:
    """Go through the targets: how each moves with errors of the parameters and joints, ``(draws, 3, n)`` [m].

    Args:
        errors: Of the parameters by name, ``(draws,)`` each.
        shared: Of the joints, ``(draws, n, joints)``.
        exact: By the kinematics themselves with other parameters; otherwise by their derivatives.
    """
    robot = fit.robot
    draws = len(next(iter(errors.values())))
    others: dict[str, float | Array] = {**robot.values}
    others.update({name: robot.values[name] + error[:, None] for name, error in errors.items()})
    exactly = _to_targets(fit, at, others) if exact else None
    for target, kinematics in zip(robot.targets, _to_targets(fit, at), strict=True):
        if exactly is not None:
            move = np.moveaxis(next(exactly).position, 1, 0) - kinematics.position
        else:
            own_names = set(target.chain.parameters)
            own = [n for n in errors if n in own_names or robot.parameters[n].group not in ("target", "fixture")]
            J = robot.position_jacobian(kinematics, at, own).reshape(len(own), -1)
            move = (np.stack([errors[name] for name in own]).T @ J).reshape(draws, 3, len(at))
        if shared is not None:
            move += np.einsum("jxn,dnj->dxn", _by_joints(fit, kinematics), shared, optimize=True)
        yield np.asarray(move)


def _to_targets(
    fit: Fit, at: Postures, values: Mapping[str, float | Array] | None = None
) -> Iterator[ForwardKinematics]:
    """Go through the forward kinematics to the targets; all go on from one to the flange."""
    robot = fit.robot
    values = robot.values if values is None else values
    variables = robot.variables(at, values)
    trunk = robot.trunk.forward_kinematics(variables, values)
    for target in robot.targets:
        yield target.chain.forward_kinematics(variables, values, trunk)


def _by_joints(fit: Fit, kinematics: ForwardKinematics) -> Array:
    """Return the velocity of a target by the joints, ``(joints, 3, n)``."""
    return kinematics.position_jacobian(fit.robot.moving[: len(fit.robot.joints)])


def _without(motions: tuple[str, ...], fit: Fit, at: Postures, moves: Array) -> Array:
    """Remove from moves ``(targets, draws, 3, n)`` what motions of everything explain, one for all targets."""
    columns = [gauge_motions(motions, fit.robot, kinematics)[0] for kinematics in _to_targets(fit, at)]
    Q = np.linalg.qr(np.concatenate(columns))[0]
    targets, draws = moves.shape[:2]
    flat = np.swapaxes(moves, 0, 1).reshape(draws, -1)
    left = flat - (flat @ Q) @ Q.T
    return np.swapaxes(left.reshape(draws, targets, *moves.shape[2:]), 0, 1)
