"""Errors of the targets' positions, drawn as the covariance of a fit and the errors of its joints let expect."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.problem import gauge_motions
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.postures import Postures

#: Deviation of an angle from which the derivatives are compared with the kinematics themselves [rad].
_LARGE_ANGLE: Final = 5e-3
#: Share of the error by which the derivatives may be wrong, and what it is tried on.
_CURVED: Final = 0.05
_TRIED_DRAWS: Final = 12
_TRIED_CONFIGURATIONS: Final = 40
#: Motions of everything that never count where no reading locates the robot.
_BASE: Final = ("base",)
#: So that the variance of what is drawn exists.
_LEAST_FREEDOM: Final = 3.0
#: Share of the equations that parameters leave to the residuals at least, and configurations that are looked at.
_LEAST_LEFT: Final = 0.1
_MOST_CONFIGURATIONS: Final = 200


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

    def at(self, joints: Array, without: Collection[str] = ()) -> Array:
        """Return the lengths of the errors at joint positions ``(n, joints)``: ``(draws, targets, n)`` [m].

        Args:
            without: Names of parameters that are right there.
        """
        fit, at = self.fit, self.fit.robot.loaded(joints)
        shape = (self.draws, len(joints), len(fit.joint_error))
        normal = np.random.default_rng((self.seed, 1)).standard_normal(shape) if fit.joint_error.any() else None
        shared = None if normal is None else normal * fit.joint_error * self._joint_scale[:, None]
        errors = {name: error for name, error in self._errors.items() if name not in without}
        moves: Iterable[Array] = _moves(fit, at, errors, shared, exact=self._is_curved)
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
    exactly = to_targets(fit, at, others) if exact else None
    for target, kinematics in zip(robot.targets, to_targets(fit, at), strict=True):
        if exactly is not None:
            move = np.moveaxis(next(exactly).position, 1, 0) - kinematics.position
        else:
            own_names = set(target.chain.parameters)
            own = [n for n in errors if n in own_names or robot.parameters[n].group not in ("target", "fixture")]
            J = robot.position_jacobian(kinematics, at, own).reshape(len(own), -1)
            move = (np.stack([errors[name] for name in own]).T @ J).reshape(draws, 3, len(at))
        if shared is not None:
            move += np.einsum("jxn,dnj->dxn", by_joints(fit, kinematics), shared, optimize=True)
        yield np.asarray(move)


def to_targets(
    fit: Fit, at: Postures, values: Mapping[str, float | Array] | None = None
) -> Iterator[ForwardKinematics]:
    """Go through the forward kinematics to the targets; all go on from one to the flange."""
    robot = fit.robot
    values = robot.values if values is None else values
    variables = robot.variables(at, values)
    trunk = robot.trunk.forward_kinematics(variables, values)
    for target in robot.targets:
        yield target.chain.forward_kinematics(variables, values, trunk)


def by_joints(fit: Fit, kinematics: ForwardKinematics) -> Array:
    """Return the velocity of a target by the joints, ``(joints, 3, n)``."""
    return kinematics.position_jacobian(fit.robot.moving[: len(fit.robot.joints)])


def _without(motions: tuple[str, ...], fit: Fit, at: Postures, moves: Array) -> Array:
    """Remove from moves ``(targets, draws, 3, n)`` what motions of everything explain, one for all targets."""
    columns = [gauge_motions(motions, fit.robot, kinematics)[0] for kinematics in to_targets(fit, at)]
    Q = np.linalg.qr(np.concatenate(columns))[0]
    targets, draws = moves.shape[:2]
    flat = np.swapaxes(moves, 0, 1).reshape(draws, -1)
    left = flat - (flat @ Q) @ Q.T
    return np.swapaxes(left.reshape(draws, targets, *moves.shape[2:]), 0, 1)


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
    some = np.linspace(0, data.configurations - 1, min(data.configurations, _MOST_CONFIGURATIONS)).round()
    moved = error_by_joints(fit, data.postures.at(some.astype(np.intp)))
    spent = sum(fit.robot.parameters[name].informed or 0.0 for name in fit.free.names)
    left = float(np.mean(off**2)) / max(1.0 - spent / (3 * len(off)), _LEAST_LEFT) - 3.0 * fit.sigma["position"] ** 2
    return replace(fit, joint_error=fit.joint_error * math.sqrt(min(max(left / moved**2, 0.0), 1.0)))


def error_by_joints(fit: Fit, joints: Array | Postures) -> float:
    """Return the root mean square error of the targets that the joints' error of a visit makes [m]."""
    if not fit.joint_error.any():
        return 0.0
    at = fit.robot.loaded(joints)
    moved = [by_joints(fit, kinematics) * fit.joint_error[:, None, None] for kinematics in to_targets(fit, at)]
    return math.sqrt(float(np.mean([np.sum(J**2, axis=(0, 1)) for J in moved])))
