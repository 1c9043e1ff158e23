"""How far the real robot is expected to miss the targets of programs, before their correction and after it.

A calibrated model is itself uncertain: by the covariance of its parameters, and by the error of the joints at each
arrival. With the predicted correction ``d`` of a target, and the error ``e`` of that prediction, the robot misses by
``d + e`` before and by ``e`` after. It gets worse if ``|e| > |d + e|``, that is if ``e`` reaches beyond half of ``-d``,
with the probability ``Phi(-|d| / (2 s))`` where ``s`` is the deviation of ``e`` along ``d``.

What all targets share and the program's frame takes up is left out of ``e`` as it is left out of ``d``, by the same
rules (:mod:`truearm.compensation.gauge`): an uncertain place of the base, or of the flange, makes no target worse.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.gauge import CommonMotion, common_motion, flange_rates
from truearm.compensation.program_places import Provenance
from truearm.modeling.chain import Array
from truearm.modeling.proof import Proof
from truearm.modeling.robot import Robot

#: Targets looked at together: their derivatives by every parameter take some ten MB.
_AT_ONCE: Final = 2000
#: Corrections below this are none [m]: programs are written with fewer digits.
_NOTHING: Final = 1e-6


@dataclass(frozen=True, eq=False)
class TargetsReached:
    """Targets of a program as the real robot shall reach them.

    Attributes
    ----------
    joints
        Joint positions of the model, ``(n, joints)`` [rad or m].
    tips
        Where the tip of the tool is on the identified flange, ``(n, 3)`` [m].
    shifts
        By how much targets are moved, in the axes of the robot's base, ``(n, 3)`` [m].
    groups
        Number of the group that each target belongs to, ``(n,)``; groups are corrected together or not at all.
    """

    joints: Array
    tips: Array
    shifts: Array
    groups: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ExpectedErrors:
    """What is expected of the targets of a program; NaN where a target is not corrected.

    Attributes
    ----------
    before, after
        Mean distance of the real robot from each target [m], ``(n,)``, without and with its correction.
    worse
        Probability that the correction makes the distance larger, ``(n,)``.
    group_worse
        Probability that it makes the sum of squares of the distances in the target's group larger, ``(n,)``.
    """

    before: Array
    after: Array
    worse: Array
    group_worse: Array

    def of_some(self, rows: NDArray[np.intp], count: int) -> ExpectedErrors:
        """Return it for `count` targets, of which these are the ones in `rows`; NaN for the others."""

        def spread(values: Array) -> Array:
            every = np.full(count, np.nan)
            every[rows] = values
            return every

        return ExpectedErrors(*map(spread, (self.before, self.after, self.worse, self.group_worse)))


def expected_errors(
    robot: Robot,
    proof: Proof,
    programs: Sequence[TargetsReached],
    tools: Provenance,
    frames: Provenance,
) -> tuple[ExpectedErrors, ...]:
    """Return what is expected of the targets of programs that are corrected together.

    Parameters
    ----------
    robot
        Calibrated.
    proof
        What is known of its parameters.
    programs
        Their targets.
    tools, frames
        Whether the places of tools and frames were given, or assumed. Places that were given are taken as exact: frames
        in the world of the calibration, tools on the target that is nearest to them.
    """
    model = _ModelErrors(robot, proof, tools == "assumed", frames == "assumed")
    if frames == "assumed":
        model = replace(model, shared=model.shared_by(programs))
    return tuple(_expected(model, one) for one in programs)


def _expected(model: _ModelErrors, targets: TargetsReached) -> ExpectedErrors:
    count, groups = len(targets.joints), int(targets.groups.max(initial=-1)) + 1
    shift = targets.shifts @ model.robot.base.rotation.T
    length2 = np.sum(shift**2, axis=1)
    along, mean2, spread2 = np.zeros(count), np.zeros(count), np.zeros(count)
    together, alone = np.zeros((groups, len(model.proof.names))), np.zeros(groups)
    for part, errors, by_joints in model.errors(targets):
        d = shift[part]
        by_model = np.einsum("nip,ni->np", errors, d)
        by_arrival = np.einsum("nij,ni->nj", by_joints, d)
        np.add.at(together, targets.groups[part], by_model)
        np.add.at(alone, targets.groups[part], np.sum(by_arrival**2, axis=1))
        along[part] = np.sum(by_model**2, axis=1) + np.sum(by_arrival**2, axis=1)
        covariance = errors @ errors.swapaxes(1, 2) + by_joints @ by_joints.swapaxes(1, 2)
        mean2[part] = np.trace(covariance, axis1=1, axis2=2)
        spread2[part] = np.sum(covariance**2, axis=(1, 2))
    of_group = np.zeros(groups)
    np.add.at(of_group, targets.groups, length2)
    return ExpectedErrors(
        before=_mean_length(length2 + mean2, 2.0 * spread2 + 4.0 * along),
        after=_mean_length(mean2, 2.0 * spread2),
        worse=_worse(length2, along),
        group_worse=_worse(of_group, np.sum(together**2, axis=1) + alone)[targets.groups],
    )


def _worse(length2: Array, along: Array) -> Array:
    """Return ``Phi(-|d| / (2 s))`` from ``|d|^2`` and ``s^2 |d|^2``; 0 where there is no correction."""
    ratio = length2 / np.sqrt(np.maximum(8.0 * along, 1e-300))
    chance = np.array([0.5 * math.erfc(v) for v in ratio.tolist()])
    return np.where(length2 < _NOTHING**2, 0.0, chance)


def _mean_length(square: Array, variance: Array) -> Array:
    """Return the mean of a length from mean and variance of its square, to second order: within 6 %."""
    safe = np.maximum(square, _NOTHING**4)
    return np.asarray(np.sqrt(square) * (1.0 - variance / (8.0 * safe**2)))


@dataclass(frozen=True, eq=False)
class _ModelErrors:
    """What the error of a calibrated model does to tips: derivatives by independent numbers of deviation 1.

    Attributes
    ----------
    assumed_tools, assumed_frames
        Whether the places of tools and frames are assumed, and so take part of the errors up.
    shared
        What the program's frame takes up; None if it takes up nothing.
    """

    robot: Robot
    proof: Proof
    assumed_tools: bool
    assumed_frames: bool
    shared: CommonMotion | None = None

    @cached_property
    def _flange(self) -> Array:
        return flange_rates(self.robot, self.proof.names) @ self.proof.root

    @cached_property
    def _root(self) -> Array:
        root = self.proof.root
        if self.assumed_frames:
            root[[self.robot.parameters[name].group == "base" for name in self.proof.names]] = 0.0
        return root

    def errors(self, targets: TargetsReached) -> Iterator[tuple[slice, Array, Array]]:
        """Yield for parts of the targets the errors by the parameters ``(m, 3, parameters)``, and by the joints.

        Those by the joints are ``(m, 3, joints)``; both in the axes of the world [m].
        """
        for first in range(0, len(targets.joints), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            moved, _, tips = self._motions(targets, part)
            if self.shared is not None:
                moved = moved - self.shared.of(tips)
            yield part, moved, self._by_joints(targets, part)

    def shared_by(self, programs: Sequence[TargetsReached]) -> CommonMotion | None:
        """Return what the frame of the programs takes up of all errors, as of all corrections."""
        if not any(len(targets.joints) for targets in programs):
            return None
        return common_motion(
            (tips, moved, turned)
            for targets in programs
            for first in range(0, len(targets.joints), _AT_ONCE)
            for moved, turned, tips in (self._motions(targets, slice(first, first + _AT_ONCE)),)
        )

    def _motions(self, targets: TargetsReached, part: slice) -> tuple[Array, Array, Array]:
        """Return motions and turns of tips ``(m, 3, parameters)``, and the tips ``(m, 3)``, in the world."""
        robot, names, q, tip = self.robot, self.proof.names, targets.joints[part], targets.tips[part]
        kinematics = robot.forward_kinematics(q)
        R = kinematics.matrix()
        moved, turned = (np.moveaxis(rate, 2, 0).swapaxes(1, 2) for rate in robot.jacobians(kinematics, q, names))
        arm = (R @ tip[:, :, None])[:, :, 0]
        moved, turned = moved @ self._root, turned @ self._root
        if self.assumed_tools:
            moved = moved - R @ self._flange[:3]
            turned = turned - R @ self._flange[3:]
        else:
            moved = moved + R @ self._tip_on_flange(tip)
        return moved + np.cross(turned, arm[:, :, None], axis=-2), turned, kinematics.position.T + arm

    def _tip_on_flange(self, tips: Array) -> Array:
        """Return by what the nearest target is uncertain on the flange, for each tip ``(m, 3, parameters)``."""
        robot, names, root = self.robot, list(self.proof.names), self._root
        rates = np.zeros((max(len(robot.targets), 1), 3, root.shape[1]))
        places = np.full((len(rates), 3), np.inf)
        for number, target in enumerate(robot.targets):
            own = [target.parameter(axis) for axis in "xyz"]
            places[number] = [robot.values[name] for name in own]
            for axis, name in enumerate(own):
                if name in names:
                    rates[number, axis] = root[names.index(name)]
        nearest = np.argmin(np.linalg.norm(tips[:, None] - places, axis=2), axis=1)
        return np.asarray(rates[nearest])

    def _by_joints(self, targets: TargetsReached, part: slice) -> Array:
        """Return the errors of tips by the errors of the joints at an arrival, ``(m, 3, joints)``."""
        deviations = np.asarray(self.proof.joint_error)
        q, tip = targets.joints[part], targets.tips[part]
        if not deviations.any():
            return np.zeros((len(q), 3, 1))
        kinematics = self.robot.forward_kinematics(q)
        arm = (kinematics.matrix() @ tip[:, :, None])[:, :, 0]
        rates = self.robot.joint_jacobian(q)
        return np.asarray((rates[:, :3] + np.cross(rates[:, 3:], arm[:, :, None], axis=-2)) * deviations)
