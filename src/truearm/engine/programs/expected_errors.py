"""How far the real robot is expected to miss the targets of programs, before their correction and after it.

A calibrated model is itself uncertain: by the covariance of its parameters, and by the error of the joints at each
visit. With the predicted correction ``d`` of a target, and the error ``e`` of that prediction, the robot misses by
``d + e`` before and by ``e`` after. It gets worse if ``|e| > |d + e|``, that is if ``e`` reaches beyond half of ``-d``,
with the probability ``Phi(-|d| / (2 s))`` where ``s`` is the deviation of ``e`` along ``d``.

Where the program's frame is free, what all targets share is left out of ``e`` as it is left out of ``d``, by the same
rules (:mod:`truearm.engine.programs.gauge`): an uncertain place of the base makes no target worse then. An uncertain
place of the real flange, on which a tool sits that was not measured, moves targets differently that differ in
orientation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.programs.gauge import CommonMotion, common_motion, flange_draws, flange_rates, flange_spread
from truearm.engine.programs.program_poses import Provenance
from truearm.engine.robot.chain import Array
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot

#: Nothing better is promised of a target [m]: to this makers of small precise arms state the pose repeatability (RP of
#: ISO 9283; ABB for the IRB 120), and what a calibration knows of its robot's is rarely more than that of the joints.
REPEATABILITY: Final = 1e-5
#: Targets looked at together: their derivatives by every parameter take some ten MB.
_AT_ONCE: Final = 2000
#: Targets and draws from which the interval of the mean error follows.
_DRAWN_TARGETS: Final = 500
_DRAWS: Final = 400
#: Share of the joints' error at a visit that all targets of a program have in common: what the model leaves changes
#: slowly from place to place, repeatability does not.
_IN_COMMON: Final = 0.5
#: Degrees of freedom of Student's distribution that the errors have at one place: how well variances are known, and how
#: far what the model leaves there differs from its mean over what was measured. With it the intervals of simulated
#: programs hold as often as they say (docs/simulations.md).
_FREEDOM: Final = 12
_INTERVAL: Final = (5.0, 95.0)
#: A tip so near to a target of the calibration is that target [m]: files have a thousandth of a millimetre.
_AT_TARGET: Final = 1e-5
#: Corrections below this are none [m]: programs are written with fewer digits.
_NOTHING: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Start:
    """Points that stay, and that some targets are offsets from."""

    joints: Array  #: Where the controller sends the joints there, as the model counts them, ``(n, joints)`` [rad or m].
    turned: NDArray[np.bool_]  #: Whether the offset is in the axes of the tool, ``(n,)``.
    #: Which targets are such offsets, ``(n,)``; the others have joints that mean nothing here.
    anchored: NDArray[np.bool_]

    def some(self, rows: NDArray[np.intp]) -> Start:
        """Return it for some targets."""
        return Start(self.joints[rows], self.turned[rows], self.anchored[rows])


@dataclass(frozen=True, eq=False)
class TargetsReached:
    """Targets of a program as the real robot shall reach them."""

    joints: Array  #: Joint positions of the model, ``(n, joints)`` [rad or m].
    tips: Array  #: Where the tip of the tool is on the identified flange, ``(n, 3)`` [m].
    shifts: Array  #: By how much targets are moved, in the axes of the robot's base, ``(n, 3)`` [m].
    #: Number of the group that each target belongs to, ``(n,)``; groups are corrected together or not at all.
    groups: NDArray[np.intp]
    #: Number of the frame, or of several together, that takes up what its targets share, ``(n,)``.
    frames: NDArray[np.intp]
    arms: tuple[Robot, ...]  #: arms, arm: the robot with each load, and which of them it is at each target, ``(n,)``.
    arm: NDArray[np.intp]
    start: Start | None = None  #: Points that stay and that some of them are offsets from; None if there are none.

    @property
    def alone(self) -> NDArray[np.bool_]:
        """Which are no offsets from points that stay, ``(n,)``."""
        return np.ones(len(self.joints), dtype=bool) if self.start is None else ~self.start.anchored

    def some(self, rows: NDArray[np.intp]) -> TargetsReached:
        """Return some of them."""
        start = None if self.start is None else self.start.some(rows)
        joints, tips, shifts = (values[rows] for values in (self.joints, self.tips, self.shifts))
        groups, frames, arm = (numbers[rows] for numbers in (self.groups, self.frames, self.arm))
        return TargetsReached(joints, tips, shifts, groups, frames, self.arms, arm, start)


@dataclass(frozen=True, eq=False)
class DrawnErrors:
    """Distances of the real robot from some targets, drawn from what is not known of it."""

    rows: NDArray[np.intp]  #: Which targets, ``(m,)``.
    before: Array  #: before, after: distances without and with the correction [m], ``(m, draws)``.
    after: Array

    def interval(self, corrected: NDArray[np.bool_], among: NDArray[np.bool_]) -> tuple[float, float] | None:
        """Return from where to where the mean distance lies with a probability of 90 % [m]; None of no targets.

        Args:
            corrected: Which of all targets are, ``(n,)``.
            among: Which of all targets count, ``(n,)``.
        """
        selected = among[self.rows]
        if not selected.any():
            return None
        lengths = np.where(corrected[self.rows][selected, None], self.after[selected], self.before[selected])
        low, high = np.percentile(lengths.mean(axis=0), _INTERVAL)
        return float(low), max(float(high), REPEATABILITY)


@dataclass(frozen=True, eq=False)
class ExpectedErrors:
    """What is expected of the targets of a program; NaN where a target is not corrected."""

    #: before, after: mean distance of the real robot from each target [m], ``(n,)``, without and with its correction.
    before: Array
    after: Array
    worse: Array  #: Probability that the correction makes the distance larger, ``(n,)``.
    #: Probability that it makes the sum of squares of the distances in the target's group larger, ``(n,)``.
    group_worse: Array
    drawn: DrawnErrors  #: Distances that the real robot may have from some of them.

    def at_least(self, least: float) -> ExpectedErrors:
        """Return it with no mean distance below one [m]."""
        return replace(self, before=np.maximum(self.before, least), after=np.maximum(self.after, least))

    def of_some(self, rows: NDArray[np.intp], count: int) -> ExpectedErrors:
        """Return it for `count` targets, of which these are the ones in `rows`; NaN for the others."""

        def spread(values: Array) -> Array:
            every = np.full(count, np.nan)
            every[rows] = values
            return every

        before, after, worse, group_worse = map(spread, (self.before, self.after, self.worse, self.group_worse))
        return ExpectedErrors(before, after, worse, group_worse, replace(self.drawn, rows=rows[self.drawn.rows]))


def expected_errors(
    robot: Robot, proof: Proof, programs: Sequence[TargetsReached], frames: Provenance, *, taught_tools: bool = False
) -> tuple[ExpectedErrors, ...]:
    """Return what is expected of the targets of programs that are corrected together.

    Args:
        robot: Calibrated.
        proof: What is known of its parameters.
        programs: Their targets.
        frames: Whether the places of frames were given, or assumed. Those that were given are taken as exact in the
            world of the calibration. A tool whose tip is a target of the calibration is known as well as that; any
            other only as well as the real flange on the identified one
            (:func:`truearm.engine.programs.gauge.flange_spread`).
        taught_tools: Whether the tools were found with this robot before its calibration.

    Note:
        No distance is below :data:`REPEATABILITY`.
    """
    model = _ModelErrors(robot, proof, frames == "assumed", taught_tools)
    if frames == "assumed":
        model = replace(model, shared=model.shared_by(programs))
    return tuple(_expected(model, program).at_least(REPEATABILITY) for program in programs)


def _expected(model: _ModelErrors, targets: TargetsReached) -> ExpectedErrors:
    count, groups = len(targets.joints), int(targets.groups.max(initial=-1)) + 1
    shift = targets.shifts @ model.robot.base.rotation.T
    length2 = np.sum(shift**2, axis=1)
    along, mean2, spread2 = np.zeros(count), np.zeros(count), np.zeros(count)
    together, alone = np.zeros((groups, model.numbers)), np.zeros(groups)
    for part, errors, by_joints in model.errors(targets):
        d = shift[part]
        by_model = np.einsum("nip,ni->np", errors, d)
        by_visit = np.einsum("nij,ni->nj", by_joints, d)
        np.add.at(together, targets.groups[part], by_model)
        np.add.at(alone, targets.groups[part], np.sum(by_visit**2, axis=1))
        along[part] = np.sum(by_model**2, axis=1) + np.sum(by_visit**2, axis=1)
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
        drawn=_drawn(model, targets),
    )


def _drawn(model: _ModelErrors, targets: TargetsReached) -> DrawnErrors:
    """Draw robots of which the calibrated one may be any, and where each is at some of the targets."""
    count = len(targets.joints)
    some = np.unique(np.linspace(0, count - 1, min(count, _DRAWN_TARGETS)).astype(np.intp))
    shift = targets.shifts[some] @ model.robot.base.rotation.T
    before, after = np.zeros((2, len(some), _DRAWS))
    rng = np.random.default_rng(0)
    drawn = np.concatenate([rng.standard_normal((len(model.proof.names), _DRAWS)), flange_draws(_DRAWS)])
    scale = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, _DRAWS))
    common: Array | None = None
    in_common = 0.0 if model.assumed_frames else _IN_COMMON  # a frame takes it up
    for part, errors, by_joints in model.errors(targets.some(some)):
        if common is None:
            common = math.sqrt(in_common) * rng.standard_normal((by_joints.shape[2], _DRAWS))
        own = math.sqrt(1.0 - in_common) * rng.standard_normal((len(part), by_joints.shape[2], _DRAWS))
        missed = (errors @ drawn + by_joints @ (common + own)) * scale
        after[part] = np.linalg.norm(missed, axis=1)
        before[part] = np.linalg.norm(missed + shift[part][:, :, None], axis=1)
    return DrawnErrors(some, before, after)


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
    """What the error of a calibrated model does to tips: derivatives by independent numbers of deviation 1."""

    robot: Robot
    proof: Proof
    assumed_frames: bool  #: Whether the places of frames are assumed, and so take part of the errors up.
    taught_tools: bool  #: Whether tools were found with this robot.
    #: What each frame takes up, by its number; nothing where there is none.
    shared: Mapping[int, CommonMotion] = field(default_factory=dict)

    @cached_property
    def _flange(self) -> Array:
        """How the real flange moves on the identified one, ``(6, numbers)``."""
        of_arm = flange_rates(self.robot, self.proof.names) @ self.proof.root
        return np.concatenate([-of_arm, flange_spread(self.robot, taught=self.taught_tools)], axis=1)

    @property
    def numbers(self) -> int:
        """How many independent numbers there are: one a parameter, and behind them six of the flange."""
        return len(self.proof.names) + len(self._flange)

    @cached_property
    def _root(self) -> Array:
        root = np.pad(self.proof.root, ((0, 0), (0, len(self._flange))))
        if self.assumed_frames:
            root[[self.robot.parameters[name].group == "base" for name in self.proof.names]] = 0.0
        return root

    def errors(self, targets: TargetsReached) -> Iterator[tuple[NDArray[np.intp], Array, Array]]:
        """Yield for parts of the targets the errors by the model ``(m, 3, numbers)``, and by the joints.

        Those by the joints are ``(m, 3, joints)``; both in the axes of the world [m].
        """
        for rows in _parts(targets):
            robot, tip = targets.arms[targets.arm[rows[0]]], targets.tips[rows]
            moved, _, tips = self._motions(robot, targets.joints[rows], tip)
            by_joints = self._by_joints(robot, targets.joints[rows], tip)
            for number, common in self.shared.items():
                in_frame = (targets.frames[rows] == number) & targets.alone[rows]
                moved[in_frame] -= common.of(tips[in_frame])
            if targets.start is not None:
                start = targets.start.some(rows)
                on, turned = start.anchored[:, None, None], start.turned[:, None, None]
                before, turn, start_tips = self._motions(robot, start.joints, tip)
                moved -= on * (before + turned * np.cross(turn, (tips - start_tips)[:, :, None], axis=-2))
                by_joints = np.concatenate([by_joints, on * self._by_joints(robot, start.joints, tip)], axis=2)
            yield rows, moved, by_joints

    def shared_by(self, programs: Sequence[TargetsReached]) -> dict[int, CommonMotion]:
        """Return what each frame takes up of all errors of its targets, as of their corrections."""
        numbers = {number for targets in programs for number in targets.frames[targets.alone].tolist()}
        return {number: common_motion(self._motions_in(programs, number)) for number in sorted(numbers)}

    def _motions_in(self, programs: Sequence[TargetsReached], number: int) -> Iterator[tuple[Array, Array, Array]]:
        sharing = [(targets.frames == number) & targets.alone for targets in programs]
        every = -(-sum(map(np.count_nonzero, sharing)) // _AT_ONCE)  # as the base is found by some of them
        for targets, shares in zip(programs, sharing, strict=True):
            some = targets.some(np.flatnonzero(shares)[::every])
            for rows in _parts(some):
                # A frame takes up what is wrong with the arm at rest; what acts on the tool moves no frame.
                robot = some.arms[some.arm[rows[0]]].with_wrench(None)
                moved, turned, tips = self._motions(robot, some.joints[rows], some.tips[rows])
                yield tips, moved, turned

    def _motions(self, robot: Robot, q: Array, tip: Array) -> tuple[Array, Array, Array]:
        """Return motions and turns of tips ``(m, 3, numbers)``, and the tips ``(m, 3)``, in the world."""
        names = self.proof.names
        kinematics = robot.forward_kinematics(q)
        R = kinematics.matrix()
        moved, turned = (np.moveaxis(rate, 2, 0).swapaxes(1, 2) for rate in robot.jacobians(kinematics, q, names))
        arm = (R @ tip[:, :, None])[:, :, 0]
        moved, turned = moved @ self._root, turned @ self._root
        on_flange, is_target = self._tips_on_flange(tip)
        moved = moved + R @ np.where(is_target, on_flange, self._flange[:3])
        turned = turned + R @ np.where(is_target, 0.0, self._flange[3:])
        return moved + np.cross(arm[:, None, :], np.eye(3)) @ turned, turned, kinematics.position.T + arm

    def _tips_on_flange(self, tips: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return by what targets of the calibration at tips are uncertain on the identified flange, and which are such.

        Those are ``(m, 3, numbers)`` and ``(m, 1, 1)``.
        """
        robot, names, root = self.robot, list(self.proof.names), self._root
        rates = np.zeros((len(robot.targets) + 1, 3, root.shape[1]))
        places = np.full((len(rates), 3), np.inf)
        for number, target in enumerate(robot.targets):
            own = [target.parameter(axis) for axis in "xyz"]
            places[number] = [robot.values[name] for name in own]
            for axis, name in enumerate(own):
                if name in names:
                    rates[number, axis] = root[names.index(name)]
        away = np.linalg.norm(tips[:, None] - places, axis=2)
        away[:, -1] = _AT_TARGET
        nearest = np.argmin(away, axis=1)
        return np.asarray(rates[nearest]), np.asarray(nearest < len(robot.targets))[:, None, None]

    def _by_joints(self, robot: Robot, q: Array, tip: Array) -> Array:
        """Return the errors of tips by the errors of the joints at a visit, ``(m, 3, joints)``."""
        deviations = np.asarray(self.proof.joint_error)
        if not deviations.any():
            return np.zeros((len(q), 3, 1))
        kinematics = robot.forward_kinematics(q)
        arm = (kinematics.matrix() @ tip[:, :, None])[:, :, 0]
        rates = robot.joint_jacobian(q)
        return np.asarray((rates[:, :3] + np.cross(rates[:, 3:], arm[:, :, None], axis=-2)) * deviations)


def _parts(targets: TargetsReached) -> Iterator[NDArray[np.intp]]:
    """Go through the targets in parts, each of them with one load."""
    for number in range(len(targets.arms)):
        rows = np.flatnonzero(targets.arm == number)
        for first in range(0, len(rows), _AT_ONCE):
            yield rows[first : first + _AT_ONCE]
