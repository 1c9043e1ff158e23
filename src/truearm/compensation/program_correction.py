"""Whole programs corrected: from the poses of a program to the numbers with which the real robot reaches them.

Every target is taken as the tip of its tool in its frame. What is correct depends on where tool and frame really are;
see :mod:`truearm.compensation.cell` for how to say it, and :mod:`truearm.compensation.gauge` for what is assumed
otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from truearm.compensation.cell import EMPTY_CELL, Cell, TargetWrench
from truearm.compensation.chosen_targets import ALONE, EVERY_POSE, Choice, kept_by_choice
from truearm.compensation.correction import Correction
from truearm.compensation.expected_errors import expected_errors
from truearm.compensation.fake_targets import nominal_robot
from truearm.compensation.gauge import base_is_held, base_shift, best_agreement, flange_is_held
from truearm.compensation.program_places import Provenance, provenance
from truearm.compensation.programs.program import Program
from truearm.compensation.resolved_program import Between, RealTips, ResolvedProgram
from truearm.compensation.target_wrenches import wrenches_of_targets
from truearm.compensation.tool_loads import arms_of_tools, loads_of_tools
from truearm.errors import InputError
from truearm.limits import refuse_beyond
from truearm.modeling.chain import Array
from truearm.modeling.formats.robot_file import arm_is_known
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot

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
    kept = kept_by_choice(programs, choice)
    tools, frames = provenance(programs, cell, "tool", kept), provenance(programs, cell, "frame", kept)
    if frames == "assumed" and base_is_held(robot) and not (choice.was_taught("frames") or choice.was_taught("points")):
        frames = "held"
    if tools == "assumed" and flange_is_held(robot) and not choice.was_taught("tools"):
        tools = "held"
    flange = np.eye(4)
    start, agreed = best_agreement(robot)
    if "assumed" in (tools, frames):
        flange = agreed
    else:
        start = np.eye(4)
    progress("resolving the configurations")
    arms = arms_of_tools(robot, loads)
    acting = wrenches_of_targets(programs, wrenches)
    resolved = [
        ResolvedProgram(robot, nominal, program, cell, arms, staying, at_targets, flange)
        for program, staying, at_targets in zip(programs, kept, acting, strict=True)
    ]
    refuse_beyond("wrenches", sum(one.forces for one in resolved), parameter="wrench")
    names = tuple(dict.fromkeys(name for one in resolved for name in one.frames))
    if frames == "identified":
        # What is given by joints stays where it is to the first frame that was measured.
        measured = next(one.measured_base for one in resolved if one.measured_base is not None)
        bases = dict.fromkeys(names, measured)
    elif frames == "held":
        bases = dict.fromkeys(names, np.eye(4))
    else:
        progress("finding where the base is")
        together = [(name,) for name in names] if choice.was_taught("frames") else [names]
        bases = {}
        for group in together:
            bases |= dict.fromkeys(group, _base_of(resolved, group, start, flange))
            found = [(one, one.some(_MORE_THAN_ONE, group)) for one in resolved]
            if sum(len(rows) for _, rows in found) == 1:
                # The frame takes up all that a correction could do to it.
                for one, rows in found:
                    one.keep(rows, ALONE)
    progress("finding fake targets")
    corrections = [one.correction(bases, flange) for one in resolved]
    if robot.proof is not None and arm_is_known(robot):
        progress("judging the targets")
        shared = names if choice.was_taught("frames") else ()
        reached = [one.reached(made, flange, shared) for one, made in zip(resolved, corrections, strict=True)]
        taught = choice.was_taught("tools")
        expected = expected_errors(robot, robot.proof, reached, frames, taught_tools=taught)
        corrections = [
            one.judged(made, of_targets, every=choice.every)
            for one, made, of_targets in zip(resolved, corrections, expected, strict=True)
        ]
    return CorrectedPrograms(
        tuple(corrections),
        Frames(tools, frames, bases, flange),
        tuple(one.guess for one in resolved if one.guess),
        tuple(partial(one.between, bases, flange) for one in resolved),
        tuple(partial(one.real_tips, bases, flange) for one in resolved),
        choice,
        loads,
        {name: apart for one in resolved for name, apart in one.tools_apart(agreed).items()},
        tuple(case for one, made in zip(resolved, corrections, strict=True) for case in one.pushed(made)),
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


def _base_of(programs: Sequence[ResolvedProgram], frames: Sequence[str], start: Array, flange: Array) -> Array:
    """Return the base for which the corrections of targets in some frames have no common part.

    Targets that are found for the first base are followed from there to the next ones. What was out of reach there is
    looked for again where that ends.
    """
    everything = []
    for one in programs:
        rows = one.some(_TARGETS_FOR_BASE // len(programs) + 1, frames)
        everything.append((rows, one.joints_near(rows)))
    base = start
    for _ in range(2):
        parts = everything

        def corrected(shift: Array) -> tuple[Array, Array]:
            nonlocal parts
            found = [one.tips_with(*part, shift, flange) for one, part in zip(programs, parts, strict=True)]
            parts = [(tips.rows, tips.joints) for tips in found]
            return np.concatenate([tips.before for tips in found]), np.concatenate([tips.after for tips in found])

        base = base_shift(corrected, base)
    return base
