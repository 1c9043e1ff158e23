"""Whole programs corrected: from the poses of a program to the numbers with which the real robot reaches them.

Every target is taken as the tip of its tool in its frame. What is correct depends on where tool and frame really are;
see :mod:`truearm.engine.programs.cell` for how to say it, and :mod:`truearm.engine.programs.gauge` for what is assumed
otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.programs.cell import EMPTY_CELL, Cell, TargetWrench
from truearm.engine.programs.chosen_targets import (
    ALONE,
    EVERY_POSE,
    Choice,
    arms_of_tools,
    kept_by_choice,
    loads_of_tools,
    wrenches_of_targets,
)
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.expected_errors import expected_errors
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.gauge import base_fixed, base_shift, best_agreement, flange_fixed
from truearm.engine.programs.program import Edit, Language, Move, Program, Split
from truearm.engine.programs.program_poses import Provenance, numbers_of, provenance
from truearm.engine.programs.resolved_program import Between, RealTips, ResolvedProgram
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import arm_is_known
from truearm.engine.robot.transform import homogeneous, rotation_from_vector, rotation_vector

#: A base that was not measured is found with this many targets, evenly along the programs.
_TARGETS_FOR_BASE: Final = 2000
_JOINTS: Final = 6
_MORE_THAN_ONE: Final = 2


@dataclass(frozen=True, eq=False)
class Frames:
    """What was taken for the real base and flange."""

    #: tools, frames: whether the places of tools and frames were given, or assumed, or follow from a flange or base
    #: that were held.
    tools: Provenance
    frames: Provenance
    #: ``T_base_nominalbase``, ``(4, 4)`` [m], as assumed, by the name of the frame for whose targets it is: one for
    #: all, but where frames were taught. Where frames are identified, it is that of the first of them.
    bases: Mapping[str, Array]
    flange: Array  #: ``T_flange_nominalflange``, ``(4, 4)`` [m], as assumed.

    @property
    def base(self) -> Array:
        """The base of the first frame; as it is where there is none."""
        return next(iter(self.bases.values()), np.eye(4))


@dataclass(frozen=True, eq=False)
class CorrectedPrograms:
    """Programs corrected together, with one base and one flange."""

    corrections: tuple[Correction, ...]  #: One a program.
    frames: Frames  #: What they refer to.
    guessed: tuple[str, ...]  #: Where the posture of a first pose was guessed, in words; empty if nowhere.
    between: tuple[Between, ...]  #: One a program: how poses between its targets are corrected.
    real_tips: tuple[RealTips, ...]  #: One a program: where tips shall be, and where the real robot takes them.
    choice: Choice  #: What was said of the targets.
    #: What the robot carries with each tool in use, by the name of the tool; None where the programs do not say it.
    loads: Mapping[str, Payload | None]
    #: How far the tip of each tool that was measured is from where the program has it [m], by the name of the tool.
    tools_apart: Mapping[str, float]
    #: The robot with what acts on its tool, and joint positions ``(n, joints)`` at which it does.
    pushed: tuple[tuple[Robot, Array], ...] = ()

    @property
    def relative(self) -> bool:
        """Whether errors of targets are of one to the other: where a frame is as a whole is not known."""
        return self.frames.frames == "assumed" and not self.choice.was_taught("points")


def corrected_programs(
    robot: Robot,
    programs: Sequence[Program],
    cell: Cell,
    progress: Callable[[str], None] = lambda _: None,
    *,
    choice: Choice = EVERY_POSE,
    weigh_tools: bool = True,
    wrenches: Sequence[TargetWrench] = (),
) -> CorrectedPrograms:
    """Correct programs.

    Args:
        robot: Calibrated, with the payload of the production tool.
        programs: They share what has to be assumed of base and flange, and so stay together.
        cell: Tools and frames, as far as they were given.
        progress: Called with what is being done.
        choice: Which targets are corrected.
        weigh_tools: Whether the robot carries what the programs say of each tool, where they do.
        wrenches: What acts on the tool at which targets. The base is found without it: no frame was located under a
            force.

    Raises:
        InputError: If the robot is not calibrated or has fewer than six joints, a tool or frame is not defined, only
            some of them have a real place, or a name in `choice` fits no target.
    """
    if len(robot.joints) < _JOINTS:
        raise InputError(
            "correcting programs needs an arm of six joints or more",
            where=robot.name,
            came=f"{len(robot.joints)} joints",
            cure="An arm of fewer cannot go where its errors have to be made good.",
        )
    loads = loads_of_tools(robot, programs) if weigh_tools else {}
    if len(set(loads.values())) == 1:
        robot = robot.with_payload(next(iter(loads.values())))
    nominal = nominal_robot(robot)
    unchanged = kept_by_choice(programs, choice)
    tools, frames = provenance(programs, cell, "tool", unchanged), provenance(programs, cell, "frame", unchanged)
    if frames == "assumed" and base_fixed(robot) and not (choice.was_taught("frames") or choice.was_taught("points")):
        frames = "held"
    if tools == "assumed" and flange_fixed(robot) and not choice.was_taught("tools"):
        tools = "held"
    start, agreed = best_agreement(robot)
    flange = agreed
    if "assumed" not in (tools, frames):
        start, flange = np.eye(4), np.eye(4)
    progress("resolving the configurations")
    arms = arms_of_tools(robot, loads)
    acting = wrenches_of_targets(programs, wrenches)
    resolved = [
        ResolvedProgram(robot, nominal, program, cell, arms, staying, at_targets, flange)
        for program, staying, at_targets in zip(programs, unchanged, acting, strict=True)
    ]
    refuse_beyond("wrenches", sum(program.forces for program in resolved), parameter="wrench")
    names = tuple(dict.fromkeys(name for program in resolved for name in program.frames))
    bases = _bases(resolved, names, frames, choice, start, flange, progress)
    progress("finding fake targets")
    corrections = [program.correction(bases, flange) for program in resolved]
    if robot.proof is not None and arm_is_known(robot):
        progress("judging the targets")
        shared = names if choice.was_taught("frames") else ()
        reached = [program.reached(moved, flange, shared) for program, moved in zip(resolved, corrections, strict=True)]
        expected = expected_errors(robot, robot.proof, reached, frames, taught_tools=choice.was_taught("tools"))
        corrections = [
            program.judged(moved, of_targets, every=choice.every)
            for program, moved, of_targets in zip(resolved, corrections, expected, strict=True)
        ]
    return CorrectedPrograms(
        tuple(corrections),
        Frames(tools, frames, bases, flange),
        tuple(program.guess for program in resolved if program.guess),
        tuple(partial(program.between, bases, flange) for program in resolved),
        tuple(partial(program.real_tips, bases, flange) for program in resolved),
        choice,
        loads,
        {name: apart for program in resolved for name, apart in program.tools_apart(agreed).items()},
        tuple(case for program, moved in zip(resolved, corrections, strict=True) for case in program.pushed(moved)),
    )


def commanded(robot: Robot, program: Program, cell: Cell = EMPTY_CELL) -> Array:
    """Return the joint positions of the model to which the controller sends the robot, ``(n, joints)`` [rad or m].

    The controller knows the nominal robot alone. NaN where it finds no joints; `cell` has tools and frames that the
    program does not define.
    """
    return ResolvedProgram(robot, nominal_robot(robot), program, cell).joints


def commanded_tips(nominal: Robot, program: Program) -> tuple[Array, Array]:
    """Return these joint positions for a nominal robot, and where its controller takes the tips to be with them.

    The tips ``(n, 4, 4)`` are in the base frame of that robot [m]; tools and frames are those of the program.
    """
    resolved = ResolvedProgram(nominal, nominal, program, EMPTY_CELL)
    return resolved.joints, resolved.tips


def _bases(
    programs: Sequence[ResolvedProgram],
    names: tuple[str, ...],
    frames: Provenance,
    choice: Choice,
    start: Array,
    flange: Array,
    progress: Callable[[str], None],
) -> dict[str, Array]:
    """Return the base by the name of the frame for whose targets it is."""
    if frames == "identified":
        # What is given by joints stays where it is to the first frame that was measured.
        return dict.fromkeys(
            names, next(program.measured_base for program in programs if program.measured_base is not None)
        )
    if frames == "held":
        return dict.fromkeys(names, np.eye(4))
    progress("finding where the base is")
    bases: dict[str, Array] = {}
    for group in [(name,) for name in names] if choice.was_taught("frames") else [names]:
        bases |= dict.fromkeys(group, _base_of(programs, group, start, flange))
        rows_of = [(program, program.some(_MORE_THAN_ONE, group)) for program in programs]
        if sum(len(rows) for _, rows in rows_of) == 1:
            # The frame takes up all that a correction could do to it.
            for resolved_program, rows in rows_of:
                resolved_program.keep(rows, ALONE)
    return bases


def _base_of(programs: Sequence[ResolvedProgram], frames: Sequence[str], start: Array, flange: Array) -> Array:
    """Return the base for which the corrections of targets in some frames have no common part.

    Targets that are found for the first base are followed from there to the next ones. What was out of reach there is
    looked for again where that ends.
    """
    everything = []
    for program in programs:
        rows = program.some(_TARGETS_FOR_BASE // len(programs) + 1, frames)
        everything.append((rows, program.joints_near(rows)))
    base = start
    for _ in range(2):
        parts = everything

        def corrected(shift: Array) -> tuple[Array, Array]:
            nonlocal parts
            tips_of_all = [
                program.tips_with(*part, shift, flange) for program, part in zip(programs, parts, strict=True)
            ]
            parts = [(tips.rows, tips.joints) for tips in tips_of_all]
            return np.concatenate([tips.before for tips in tips_of_all]), np.concatenate(
                [tips.after for tips in tips_of_all]
            )

        base = base_shift(corrected, base)
    return base


# Moves split where the correction between targets would deviate.
#
# The controller interpolates between corrected targets with the nominal robot's kinematics, and between targets the
# real robot's errors are others than at them. A straight or circular move gets more targets in between, each corrected,
# until what the controller interpolates is nowhere farther from the right correction than was asked for.
#
# Only a move is split whose start is sure: the move before it in the text, with nothing in between that could come from
# elsewhere, move the robot or jump.

#: Where a segment is checked, as shares of it.
_CHECKED: Final = np.array([0.25, 0.5, 0.75])
#: A move is split into so many segments at most.
MOST_SEGMENTS: Final = 64


@dataclass(frozen=True, eq=False)
class ProgramSplit:
    """How the moves of a program are split."""

    edits: tuple[Edit, ...]  #: What changes in the text.
    moves: int  #: How many moves are split.
    added: int  #: How many targets are added.
    #: Lines of straight and circular moves that stay whole: of those whose start is not sure, or one of their targets
    #: was not corrected or is no pose of its own; of those that need more segments than allowed; and of those with
    #: options that segments cannot have.
    unsplit: tuple[int, ...]


def split_program(language: Language, correction: Correction, between: Between, tolerance: float) -> ProgramSplit:
    """Split the moves of a program.

    Args:
        language: Of the program.
        correction: Of the program.
        between: What finds fake targets between those of the program.
        tolerance: How far the correction between targets may deviate [m].

    Raises:
        InputError: If moves in this language cannot be split, or the tolerance is out of range.
    """
    if language.split is None:
        raise InputError(
            f"moves in {language.name} cannot be split", parameter="split", cure="Leave it out, or add targets."
        )
    program = correction.program
    unsplit: list[int] = []
    open_moves: list[_SplitMove] = []
    for index, move in enumerate(program.moves):
        if move.kind != "joint":
            before = _start(program, index)
            if before is None or not _sound(correction, move, before):
                unsplit.append(move.line)
            else:
                open_moves.append(_SplitMove(correction, index, before))
    finished: list[_SplitMove] = []
    while open_moves:
        shares = [split_move.shares for split_move in open_moves]
        rows = np.repeat([split_move.end for split_move in open_moves], [len(s) for s in shares])
        wanted = np.concatenate([split_move.path.at(s) for split_move, s in zip(open_moves, shares, strict=True)])
        near = np.concatenate([split_move.near(s) for split_move, s in zip(open_moves, shares, strict=True)])
        fakes, solved = between(rows, wanted, near)
        again: list[_SplitMove] = []
        given_up: list[_SplitMove] = []
        at = 0
        for trial, asked in zip(open_moves, shares, strict=True):
            part = slice(at, at + len(asked))
            at += len(asked)
            if not solved[part].all():
                unsplit.append(program.moves[trial.index].line)
            elif trial.deviates(fakes[part], tolerance):
                (again if trial.split_further(tolerance) else given_up).append(trial)
            else:
                finished.append(trial)
        unsplit += [program.moves[split_move.index].line for split_move in given_up]
        open_moves = again
    several = sorted(
        (split_move for split_move in finished if split_move.segments > 1), key=lambda split_move: split_move.index
    )
    edits, whole = language.split(program, [split_move.split() for split_move in several])
    unsplit += [program.moves[index].line for index in whole]
    split = [split_move for split_move in several if split_move.index not in whole]
    return ProgramSplit(
        tuple(edits), len(split), sum(split_move.segments - 1 for split_move in split), tuple(sorted(unsplit))
    )


class _SplitMove:
    """A move that is split into more segments until they are straight or round enough.

    Args:
        correction: Of the program.
        index: Of the move.
        before: Index of the target that it starts from.
    """

    def __init__(self, correction: Correction, index: int, before: int) -> None:
        move = correction.program.moves[index]
        self.index, self.end, self.segments = index, move.target, 1
        self._target = correction.program.targets[move.target]
        self._circular = move.via is not None
        poses = correction.before
        self.path = _Path(poses[before], poses[move.target], None if move.via is None else poses[move.via])
        self._ends = correction.after[[before, move.target]]
        self._joints = correction.joints[[before, move.target]]
        self._fakes, self._deviation = correction.after[:0], 0.0

    @property
    def shares(self) -> Array:
        """Where fake targets are needed: four in each segment, the last at its end."""
        return np.arange(1, 4 * self.segments) / (4 * self.segments)

    def near(self, shares: Array) -> Array:
        """Return joints to be near to at shares of the path."""
        start, end = self._joints
        return np.asarray(start + shares[:, None] * (end - start))

    def deviates(self, fakes: Array, tolerance: float) -> bool:
        """Return whether what the controller interpolates is too far from the correction."""
        self._fakes = np.concatenate([self._ends[:1], fakes, self._ends[1:]])
        self._deviation = 0.0
        for segment in range(self.segments):
            frames = self._fakes[4 * segment : 4 * segment + 5]
            gone = _Path(frames[0], frames[4], frames[2] if self._circular else None).at(_CHECKED)
            away = float(np.linalg.norm(gone[:, :3, 3] - frames[1:4, :3, 3], axis=1).max())
            self._deviation = max(self._deviation, away)
        return self._deviation > tolerance

    def split_further(self, tolerance: float) -> bool:
        """Return whether there are more segments from now on; not where the posture changes on the way."""
        if self.segments == MOST_SEGMENTS:
            return False
        # The deviation falls with the square of a segment's length.
        needed = math.ceil(self.segments * math.sqrt(self._deviation / tolerance))
        self.segments = min(max(self.segments + 1, needed), MOST_SEGMENTS)
        return True

    def split(self) -> Split:
        """Return the segments as numbers."""
        near = np.tile(self._target.values, (len(self._fakes), 1))
        numbers = [tuple(row) for row in numbers_of(self._target.form, self._fakes, near).tolist()]
        vias = [numbers[4 * segment + 2] if self._circular else None for segment in range(self.segments)]
        ends = [numbers[4 * segment + 4] for segment in range(self.segments)]
        return Split(self.index, tuple(zip(ends[:-1], vias[:-1], strict=True)), vias[-1])


def _start(program: Program, index: int) -> int | None:
    """Return the target that a move starts from, None if it is not sure."""
    move, before = program.moves[index], program.moves[index - 1] if index else None
    if before is None or before.routine != move.routine or before.source != move.source:
        return None
    if (0, 0) in (move.target_text, move.statement):
        return None
    return before.target


def _sound(correction: Correction, move: Move, before: int) -> bool:
    """Return whether all targets of a move were corrected, are poses of their own, and have one tool and frame."""
    targets = correction.program.targets
    every = [before, move.target, *([] if move.via is None else [move.via])]
    end = targets[move.target]
    own = [targets[row] for row in every[1:]]
    if move.kind == "circular" and move.via is None:
        return False
    return (
        all(correction.corrected[row] for row in every)
        and all(t.form.kind == "pose" and t.form.orientation is not None and t.parent is None for t in own)
        and all((targets[row].tool, targets[row].frame) == (end.tool, end.frame) for row in every)
    )


class _Path:
    """The way of a move: positions on a line or a circle, turned evenly from its start to its end."""

    def __init__(self, start: Array, end: Array, via: Array | None) -> None:
        self._start, self._end = start, end
        self._turn = rotation_vector(end[:3, :3] @ start[:3, :3].T)
        self._circle = None if via is None else _circle(start[:3, 3], via[:3, 3], end[:3, 3])

    def at(self, shares: Array) -> Array:
        """Return poses ``(m, 4, 4)`` at shares of the way ``(m,)``."""
        along = shares[:, None]
        if self._circle is None:
            position = self._start[:3, 3] + along * (self._end[:3, 3] - self._start[:3, 3])
        else:
            centre, spin, radius = self._circle
            position = centre + rotation_from_vector(along * spin) @ radius
        return homogeneous(rotation_from_vector(along * self._turn) @ self._start[:3, :3], position)


def _circle(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array] | None:
    """Return centre, rotation vector from the first to the last point, and first radius; None for no circle."""
    u, v = b - a, c - a
    normal = np.cross(u, v)
    size = float(normal @ normal)
    if size <= 1e-12 * float(u @ u) * float(v @ v):
        return None
    centre = a + (np.cross(normal, u) * (v @ v) + np.cross(v, normal) * (u @ u)) / (2.0 * size)
    axis = normal / math.sqrt(size)
    first, last = a - centre, c - centre
    angle = math.atan2(float(axis @ np.cross(first, last)), float(first @ last)) % (2.0 * math.pi)
    return centre, angle * axis, first
