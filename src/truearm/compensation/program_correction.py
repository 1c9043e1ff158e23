"""Whole programs corrected: from the poses of a program to the numbers with which the real robot reaches them.

Every target is taken as the tip of its tool in its frame. What is correct depends on where tool and frame really are;
see :mod:`truearm.compensation.cell` for how to say it, and :mod:`truearm.compensation.gauge` for what is assumed
otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.cell import EMPTY_CELL, Cell
from truearm.compensation.expected_errors import ExpectedErrors, TargetsReached, expected_errors
from truearm.compensation.fake_targets import FakeTargets, fake_targets, matrices, nominal_robot
from truearm.compensation.gauge import base_shift, best_agreement, turns_between
from truearm.compensation.kept_targets import LIKELY, kept_targets, paths_of
from truearm.compensation.program_places import Places, Provenance, provenance
from truearm.compensation.program_poses import edits_of, joint_numbers, joints_of, place, pose_numbers, poses_of
from truearm.compensation.programs.program import Configuration, Edit, Program, Skipped
from truearm.compensation.resolved_configurations import (
    ON_EDGE,
    ResolvedConfigurations,
    agrees,
    resolved_configurations,
)
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.formats.robot_file import arm_is_known
from truearm.modeling.inverse.solutions import PoseStatus
from truearm.modeling.robot import Robot

#: A base that was not measured is found with this many targets, evenly along the programs.
_TARGETS_FOR_BASE: Final = 2000
_JOINTS: Final = 6
#: A joint within this of a bound [rad] is on it: the numbers of programs are rounded.
_ROUNDING: Final = float(np.radians(0.01))

#: For targets ``(m,)``, poses ``(m, 4, 4)`` of their tools in their frames and joints ``(m, joints)`` near the answer:
#: fake targets ``(m, 4, 4)``, and whether each was found ``(m,)``.
Between = Callable[[NDArray[np.intp], Array, Array], tuple[Array, NDArray[np.bool_]]]


@dataclass(frozen=True, eq=False)
class Correction:
    """One program corrected.

    Attributes
    ----------
    program
        As it was.
    edits
        What changes in its text.
    corrected
        Which targets, ``(n,)``.
    skipped
        What stays as it is, and why: what the reader could not use, and targets that cannot be computed.
    before, after
        Tips of the targets in their frames, ``(n, 4, 4)`` [m], before and after the correction.
    tips
        Tips of the targets in the controller's base frame, ``(n, 4, 4)`` [m].
    joints
        Joint positions of the model with which the real robot reaches the targets [rad or m], ``(n, joints)``.
    on_edge
        Corrected targets with a joint that leaves the ranges of its configuration, by less than controllers
        refuse.
    expected
        How far the real robot is expected to miss the targets before and after; None if nothing is known of that.
    not_better
        Targets whose correction would rather do harm: they stay as they are, unless the path that they belong to is
        better corrected as a whole, or all were asked for.
    """

    program: Program
    edits: tuple[Edit, ...]
    corrected: NDArray[np.bool_]
    skipped: tuple[Skipped, ...]
    before: Array
    after: Array
    tips: Array
    joints: Array
    on_edge: tuple[int, ...]
    expected: ExpectedErrors | None = None
    not_better: tuple[int, ...] = ()

    @cached_property
    def moved(self) -> Array:
        """By how much each target was moved [m], ``(n,)``; zero where it was not corrected."""
        return np.asarray(np.linalg.norm(self.after[:, :3, 3] - self.before[:, :3, 3], axis=1))

    @cached_property
    def turned(self) -> Array:
        """By how much each target was turned [rad], ``(n,)``."""
        return np.asarray(np.linalg.norm(turns_between(self.before, self.after), axis=1))


@dataclass(frozen=True, eq=False)
class Frames:
    """What was taken for the real base and flange.

    Attributes
    ----------
    tools, frames
        Whether the places of tools and frames were given, or assumed.
    base, flange
        ``T_base_nominalbase`` and ``T_flange_nominalflange``, ``(4, 4)`` each [m], as assumed; where frames are
        identified, `base` is that of the first of them.
    """

    tools: Provenance
    frames: Provenance
    base: Array
    flange: Array


@dataclass(frozen=True, eq=False)
class CorrectedPrograms:
    """Programs corrected together, with one base and one flange.

    Attributes
    ----------
    corrections
        One a program.
    frames
        What they refer to.
    guessed
        Where the posture of a first pose was guessed, in words; empty if nowhere.
    between
        One a program: how poses between its targets are corrected.
    """

    corrections: tuple[Correction, ...]
    frames: Frames
    guessed: tuple[str, ...]
    between: tuple[Between, ...]


def corrected_programs(
    robot: Robot,
    programs: Sequence[Program],
    cell: Cell,
    progress: Callable[[str], None] = lambda _: None,
    *,
    every: bool = False,
) -> CorrectedPrograms:
    """Correct programs.

    Parameters
    ----------
    robot
        Calibrated, with the payload of the production tool.
    programs
        They share what has to be assumed of base and flange, and so stay together.
    cell
        Tools and frames, as far as they were given.
    progress
        Called with what is being done.
    every
        Correct also the targets that would rather get worse, see :mod:`truearm.compensation.kept_targets`.

    Raises
    ------
    InputError
        If the robot is not calibrated or has fewer than six joints, a tool or frame is not defined, or only some of
        them have a real place.
    """
    if len(robot.joints) < _JOINTS:
        raise InputError(
            "correcting programs needs an arm of six joints or more",
            where=robot.name,
            came=f"{len(robot.joints)} joints",
            cure="An arm of fewer cannot go where its errors have to be made good.",
        )
    nominal = nominal_robot(robot)
    tools, frames = provenance(programs, cell, "tool"), provenance(programs, cell, "frame")
    base, flange = np.eye(4), np.eye(4)
    if "assumed" in (tools, frames):
        base, flange = best_agreement(robot)
    progress("resolving the configurations")
    resolved = [_ResolvedProgram(robot, nominal, program, cell) for program in programs]
    if frames == "identified":
        # What is given by joints stays where it is to the first frame that was measured.
        base = next(one.measured_base for one in resolved if one.measured_base is not None)
    else:
        progress("finding where the base is")
        parts = [(one, one.some(_TARGETS_FOR_BASE // len(resolved) + 1)) for one in resolved]

        def corrected(shift: Array) -> tuple[Array, Array]:
            tips = [one.tips_with(rows, shift, flange) for one, rows in parts]
            return np.concatenate([a for a, _ in tips]), np.concatenate([b for _, b in tips])

        base = base_shift(corrected, base)
    progress("finding fake targets")
    corrections = [one.correction(base, flange) for one in resolved]
    if robot.proof is not None and arm_is_known(robot):
        progress("judging the targets")
        reached = [one.reached(made, flange) for one, made in zip(resolved, corrections, strict=True)]
        expected = expected_errors(robot, robot.proof, reached, tools, frames)
        corrections = [
            one.judged(made, of_targets, every=every)
            for one, made, of_targets in zip(resolved, corrections, expected, strict=True)
        ]
    return CorrectedPrograms(
        tuple(corrections),
        Frames(tools, frames, base, flange),
        tuple(one.guess for one in resolved if one.guess),
        tuple(partial(one.between, base, flange) for one in resolved),
    )


def commanded(robot: Robot, program: Program, cell: Cell = EMPTY_CELL) -> Array:
    """Return the joint positions of the model to which the controller sends the robot, ``(n, joints)`` [rad or m].

    The controller knows the nominal robot alone. NaN where it finds no joints; `cell` has tools and frames that the
    program does not define.
    """
    return _ResolvedProgram(robot, nominal_robot(robot), program, cell).joints


def _straight(program: Program) -> frozenset[int]:
    """Return the targets to which the first move that goes there is straight or circular."""
    first: dict[int, str] = {}
    for move in program.moves:
        for index in (move.via, move.target):
            if index is not None:
                first.setdefault(index, move.kind)
    return frozenset(index for index, kind in first.items() if kind != "joint")


class _ResolvedProgram:
    """A program whose targets are poses and joints of the nominal robot."""

    def __init__(self, robot: Robot, nominal: Robot, program: Program, cell: Cell) -> None:
        self._robot, self._nominal, self._program = robot, nominal, program
        controller = robot.controller
        targets = program.targets
        self._base = Places(program, cell.frames, "frame", controller.base.matrix)
        self._tool = Places(program, cell.tools, "tool", controller.flange.matrix)
        known = joints_of(nominal, program)
        self._joints_given: NDArray[np.bool_] = np.asarray(~np.isnan(known).any(axis=1))
        poses = poses_of(program)
        flange = np.zeros((len(targets), 4, 4))
        by_pose, by_joints = ~self._joints_given, self._joints_given
        back = np.linalg.inv(self._tool.nominal)
        flange[by_pose] = self._base.nominal[by_pose] @ poses[by_pose] @ back[by_pose]
        flange[by_joints] = matrices(nominal, known[by_joints])
        #: Tips of the targets in their frames.
        self._poses = np.where(
            by_pose[:, None, None], poses, np.linalg.inv(self._base.nominal) @ flange @ self._tool.nominal
        )
        configurations = [target.configuration for target in targets]
        order = [index for move in program.moves for index in (move.via, move.target) if index is not None]
        self._resolved: ResolvedConfigurations = resolved_configurations(
            nominal, flange, configurations, known, order, [target.parent for target in targets], _straight(program)
        )
        found = self._resolved
        self.guess = "" if found.guessed is None else place(program, targets[found.guessed])
        self.joints = found.joints
        self._usable: NDArray[np.bool_] = np.asarray(~np.isnan(found.joints).any(axis=1))

    @property
    def measured_base(self) -> Array | None:
        """``T_base_nominalbase`` by the first frame that was measured; None if none was."""
        return self._base.measured

    def some(self, count: int) -> NDArray[np.intp]:
        """Return up to `count` usable targets, evenly along the program."""
        usable = np.flatnonzero(self._usable)
        evenly = np.linspace(0, len(usable) - 1, min(count, len(usable))).astype(int)
        return np.asarray(usable[np.unique(evenly)])

    def tips_with(self, rows: NDArray[np.intp], base: Array, flange: Array) -> tuple[Array, Array]:
        """Return tips of targets in the controller's base frame, before and after correction, where found."""
        if not len(rows):
            return np.zeros((0, 4, 4)), np.zeros((0, 4, 4))
        found = self._found(rows, base, flange)
        good = found.solutions.usable
        tips = self._base.nominal[rows] @ self._poses[rows]
        return tips[good], (found.flange @ self._tool.nominal[rows])[good]

    def correction(self, base: Array, flange: Array) -> Correction:
        """Return the corrected program, with what was taken for the real base and flange."""
        program, count = self._program, len(self._program.targets)
        rows = np.flatnonzero(self._usable)
        after, joints = self._poses.copy(), self._resolved.joints.copy()
        reasons: dict[int, str] = {}
        on_edge: tuple[int, ...] = ()
        for row in np.flatnonzero(~self._usable).tolist():
            reasons[row] = (
                "the nominal robot reaches it in no posture of the configuration that the program states, or only in a "
                "singular one: check its configuration data, tool and frame"
                if self._resolved.reachable[row]
                else "out of reach of the nominal robot: check its tool and frame"
            )
        if len(rows):
            found = self._found(rows, base, flange)
            joints[rows] = found.joints
            for at, row in enumerate(rows.tolist()):
                if not found.solutions.status[at].usable:
                    reasons[row] = _reason(found, at)
            reasons |= self._changed_turns(rows, joints, reasons)
            on_edge = self._on_edge(rows, joints, reasons)
            after[rows] = np.linalg.inv(self._base.nominal[rows]) @ found.flange @ self._tool.nominal[rows]
        corrected = np.ones(count, dtype=bool)
        corrected[list(reasons)] = False
        after[~corrected], joints[~corrected] = self._poses[~corrected], self._resolved.joints[~corrected]
        targets = program.targets
        left = [Skipped(targets[row].source, targets[row].line, reason) for row, reason in reasons.items()]
        return Correction(
            program=program,
            edits=self._edits(after, joints, corrected),
            corrected=corrected,
            skipped=tuple(sorted((*program.skipped, *left), key=lambda s: (s.source, s.line))),
            before=self._poses,
            after=after,
            tips=self._base.nominal @ self._poses,
            joints=joints,
            on_edge=on_edge,
        )

    def _edits(self, after: Array, joints: Array, corrected: NDArray[np.bool_]) -> tuple[Edit, ...]:
        program, given = self._program, self._joints_given
        numbers = pose_numbers(program, self._poses, after, np.flatnonzero(corrected & ~given))
        numbers |= joint_numbers(self._nominal, program, joints, np.flatnonzero(corrected & given))
        return tuple(edits_of(program, numbers))

    def reached(self, correction: Correction, flange: Array) -> TargetsReached:
        """Return the corrected targets as the real robot shall reach them."""
        rows = np.flatnonzero(correction.corrected)
        shift = (correction.after - correction.before)[rows, :3, 3:]
        return TargetsReached(
            joints=correction.joints[rows],
            tips=self._tool.real(rows, flange)[:, :3, 3],
            shifts=(self._base.nominal[rows, :3, :3] @ shift)[:, :, 0],
            groups=paths_of(self._program)[rows],
        )

    def judged(self, correction: Correction, expected: ExpectedErrors, *, every: bool) -> Correction:
        """Return a correction with what is expected of it, without the targets that would rather get worse."""
        rows = np.flatnonzero(correction.corrected)
        known = expected.of_some(rows, len(correction.corrected))
        worse = np.nan_to_num(known.worse) > LIKELY
        kept = np.zeros_like(worse) if every else kept_targets(self._program, correction.moved, known)
        corrected = correction.corrected & ~kept
        after = np.where(kept[:, None, None], correction.before, correction.after)
        joints = np.where(kept[:, None], self._resolved.joints, correction.joints)
        return replace(
            correction,
            edits=self._edits(after, joints, corrected) if kept.any() else correction.edits,
            corrected=corrected,
            after=after,
            joints=joints,
            on_edge=tuple(row for row in correction.on_edge if corrected[row]),
            expected=known,
            not_better=tuple(np.flatnonzero(worse | kept).tolist()),
        )

    def between(
        self, base: Array, flange: Array, rows: NDArray[np.intp], poses: Array, near: Array
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return fake targets for poses in the frames, and with the tools, of targets; see :data:`Between`."""
        wanted = self._base.real(rows, base) @ poses @ np.linalg.inv(self._tool.real(rows, flange))
        found = fake_targets(self._robot, wanted, near)
        fakes = np.linalg.inv(self._base.nominal[rows]) @ found.flange @ self._tool.nominal[rows]
        return fakes, found.solutions.usable

    def _found(self, rows: NDArray[np.intp], base: Array, flange: Array) -> FakeTargets:
        wanted = self._base.real(rows, base) @ self._poses[rows] @ np.linalg.inv(self._tool.real(rows, flange))
        return fake_targets(self._robot, wanted, self._resolved.joints[rows])

    def _changed_turns(self, rows: NDArray[np.intp], joints: Array, reasons: Mapping[int, str]) -> dict[int, str]:
        """Return the targets that would leave the ranges of their configuration, with the reason."""
        changed: dict[int, str] = {}
        for configuration, members in self._configured(rows, reasons):
            slack = _ROUNDING if configuration.literal else ON_EDGE
            for row in members[~agrees(self._robot, joints[members], configuration, slack)].tolist():
                shown = self._robot.controller.from_model(joints[row][None])[0]
                words = ", ".join(
                    f"{math.degrees(value):.2f} deg" if joint.kind == "revolute" else f"{value * 1e3:.2f} mm"
                    for value, joint in zip(shown.tolist(), self._robot.joints, strict=True)
                )
                changed[row] = f"it would leave the configuration in the program: the joints would have to read {words}"
        return changed

    def _on_edge(self, rows: NDArray[np.intp], joints: Array, reasons: Mapping[int, str]) -> tuple[int, ...]:
        """Return the targets that leave the ranges of their configuration and did not before."""
        found: list[int] = []
        for configuration, members in self._configured(rows, reasons):
            before = agrees(self._robot, self._resolved.joints[members], configuration, _ROUNDING)
            after = agrees(self._robot, joints[members], configuration, _ROUNDING)
            found += members[before & ~after].tolist()
        return tuple(sorted(found))

    def _configured(
        self, rows: NDArray[np.intp], reasons: Mapping[int, str]
    ) -> Iterator[tuple[Configuration, NDArray[np.intp]]]:
        """Return the targets without a reason against them by their configuration, where it gives ranges."""
        groups: dict[Configuration, list[int]] = {}
        for row in rows.tolist():
            configuration = self._program.targets[row].configuration
            if row not in reasons and (configuration.ranges or configuration.outside):
                groups.setdefault(configuration, []).append(row)
        for configuration, members in groups.items():
            yield configuration, np.array(members)


def _reason(found: FakeTargets, at: int) -> str:
    status, solutions = found.solutions.status[at], found.solutions
    if status is PoseStatus.BRANCH_LOST:
        return f"the posture would change: it is reached as {solutions.branch[at]} only"
    return solutions.advice(at).rstrip(".")
