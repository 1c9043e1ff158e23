"""Targets of programs: which are corrected, what only the user can say of them, and what acts on the tool there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import translate
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.programs.cell import TargetWrench
from truearm.engine.programs.program import Program, ProgramTarget
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench


@dataclass(frozen=True)
class Question:
    """A question whose answer decides whether a correction helps or harms."""

    parameter: str  #: Of the job, which answers it.
    text: str  #: The question, and why it is asked.
    answers: str  #: How the parameter answers it.
    stored: str  #: Where an answer can be kept, in a sentence.


def refuse_unanswered(questions: Iterable[Question | None]) -> None:
    """Ask all that was not answered, in one message.

    Raises:
        InputError: If there is a question.
    """
    asked = [question for question in questions if question is not None]
    if not asked:
        return
    texts = [f"{question.text} Answer with {question.answers}. {question.stored}" for question in asked]
    raise InputError(
        "nothing is corrected before this is answered",
        parameter=", ".join(question.parameter for question in asked),
        cure=" ".join(f"({number}) {text}" for number, text in enumerate(texts, 1)) if texts[1:] else texts[0],
    )


# Which targets of programs are corrected, and why others stay: what the user says of them.
#
# A target that was computed off-line is where the nominal robot has to be told to go elsewhere. One that was taught
# with this robot is right already, whatever its numbers say: with the same tool, frame, load and joint zeros the robot
# comes back to it. Joint positions mean the joints and no place, so they stay unless asked for.

#: What may have been taught with the robot itself.
Taught = Literal["points", "frames", "tools"]
TAUGHT: Final[tuple[Taught, ...]] = ("points", "frames", "tools")
#: What FANUC's programs write behind the number of a position, some of the time: P[13:seam], P[13:"seam"].
_COMMENT: Final = re.compile(r":[^\]]*(?=\]$)")
#: Why a target stays, in words for a count: ``3 <words>``.
Kept = Literal[
    "given by joints", "taught", "not in `only`", "in `keep`", "not better corrected", "alone, with `frames` not given"
]
#: The only target from which the place of a frame would follow.
ALONE: Final[Kept] = "alone, with `frames` not given"


@dataclass(frozen=True)
class Choice:
    """What the user says of the targets of programs."""

    #: Whether targets given by joints are corrected too. Those given in pulses always are: there every target is.
    joint_targets: bool = False
    only: tuple[str, ...] = ()  #: Names or patterns of the targets that are corrected; all if empty.
    keep: tuple[str, ...] = ()  #: Names or patterns of targets that stay.
    taught: frozenset[Taught] | None = None  #: What was taught with this robot; None if that was not said.
    #: Whether targets are corrected that would rather get worse, see :mod:`truearm.engine.programs.correction`.
    every: bool = False

    def was_taught(self, kind: Taught) -> bool:
        """Return whether something is said to be taught."""
        return self.taught is not None and kind in self.taught


EVERY_POSE: Final = Choice()


def kept_by_choice(programs: Sequence[Program], choice: Choice) -> list[dict[int, Kept]]:
    """Return for each program which of its targets stay as they are, and why.

    Offsets from taught points are corrected: they have to be so far from where the real robot is at the point.

    Raises:
        InputError: If a name or pattern fits no target.
    """
    only, keep = (Patterns(programs, texts, name) for texts, name in ((choice.only, "only"), (choice.keep, "keep")))
    return [
        {
            row: why
            for row, target in enumerate(program.targets)
            if (why := _why_kept(target, choice, only, keep)) is not None
        }
        for program in programs
    ]


def taught_question(programs: Sequence[Program], choice: Choice) -> Question | None:
    """Return what to ask where nobody has said what was taught, and there is something to correct."""
    kept_rows = kept_by_choice(programs, choice)
    nothing = all(len(rows) == len(program.targets) for program, rows in zip(programs, kept_rows, strict=True))
    if choice.taught is not None or nothing:
        return None
    return Question(
        "taught",
        "Were the points of these programs computed off-line, or taught with this robot? Points that were taught are "
        "right already, and a correction moves them away.",
        "`taught=none` (all was computed), or with what was taught: `taught=points`, `taught=frames`, `taught=tools`; "
        "where only some points were taught, with `taught=none` and their names as `keep`",
        "A cell file keeps the answer (taught: [none]).",
    )


def _why_kept(target: ProgramTarget, choice: Choice, only: Patterns, keep: Patterns) -> Kept | None:
    if keep.fit(target.name):
        return "in `keep`"
    if choice.only and not only.fit(target.name):
        return "not in `only`"
    if choice.was_taught("points") and target.parent is None:
        return "taught"
    if target.form.kind == "joints" and not choice.joint_targets:
        return "given by joints"
    return None


class Patterns:
    """Names and patterns of targets; ``*`` stands for any text, ``?`` for a character, capitals count as small.

    Args:
        programs: Whose targets they are.
        texts: The names and patterns.
        parameter, where: What a refusal names.

    Raises:
        InputError: If one fits no target.
    """

    def __init__(
        self, programs: Sequence[Program], texts: Iterable[str], parameter: str, where: str | None = None
    ) -> None:
        names = {target.name for program in programs for target in program.targets if target.name}
        self._names: set[str] = set()
        for text in texts:
            # P[3] is a name of FANUC, and no pattern
            whole, bare = (
                re.compile(translate(wanted.replace("[", "[[]")), re.IGNORECASE)
                for wanted in (text.replace('"', ""), _COMMENT.sub("", text))
            )
            matched = {
                name for name in names if whole.match(name) or whole.match(_COMMENT.sub("", name)) or bare.match(name)
            }
            if not matched:
                raise InputError(
                    "no target of the programs has this name",
                    parameter=parameter,
                    where=where,
                    came=text,
                    allowed="a name as the program writes it, or a pattern such as pHole*",
                    cure=did_you_mean(text, sorted(names)),
                )
            self._names |= matched

    def fit(self, name: str) -> bool:
        """Return whether a target of this name was meant."""
        return name in self._names


#: What the flange is called where a target has no tool.
_FLANGE: Final = "flange"


def wrenches_of_targets(
    programs: Sequence[Program], target_wrenches: Sequence[TargetWrench]
) -> list[tuple[Wrench | None, ...]]:
    """Return what acts at each target of each program; None where nothing does.

    What names a target holds before what names its tool alone, and that before what names neither.

    Raises:
        InputError: If a name fits no target or no tool of the programs, or two entries of one kind fit one target.
    """
    fits = [Patterns(programs, entry.targets, "wrench", entry.where or None) for entry in target_wrenches]
    used = {target.tool.lower() for program in programs for target in program.targets}
    for target_wrench in target_wrenches:
        for tool in target_wrench.tools:
            if _key(tool) not in used:
                names = sorted(name or _FLANGE for name in used)
                raise InputError(
                    "no target of the programs has this tool",
                    parameter="wrench",
                    where=target_wrench.where or None,
                    came=tool,
                    allowed=", ".join(names),
                    cure=did_you_mean(tool, names),
                )
    wrenches = []
    for program in programs:
        of_program: list[Wrench | None] = []
        for target in program.targets:
            best: dict[int, TargetWrench] = {}
            for target_wrench, patterns in zip(target_wrenches, fits, strict=True):
                if target_wrench.targets and not patterns.fit(target.name):
                    continue
                if target_wrench.tools and target.tool.lower() not in map(_key, target_wrench.tools):
                    continue
                rank = 0 if target_wrench.targets else 1 if target_wrench.tools else 2
                if rank in best:
                    raise InputError(
                        "two forces are given for one target",
                        parameter="wrench",
                        where=target_wrench.where or None,
                        came=target.name or target.tool or _FLANGE,
                        cure=f"It is in {best[rank].where}, too: take it out of one of them.",
                    )
                best[rank] = target_wrench
            of_program.append(best[min(best)].wrench if best else None)
        wrenches.append(tuple(of_program))
    return wrenches


def _key(tool: str) -> str:
    return "" if tool.lower() == _FLANGE else tool.lower()


#: Programs write a gram where a mass has to be and is not known [kg].
_LEAST_MASS: Final = 0.01


def loads_of_tools(robot: Robot, programs: Sequence[Program]) -> dict[str, Payload | None]:
    """Return what the programs say of the load of each tool in use, in the robot's own flange frame.

    By the name of the tool as targets write it; None for a tool without a mass, and for one to which two programs give
    different ones.
    """
    loads: dict[str, Payload | None] = {}
    for tool, load in _stated_loads(programs):
        in_flange = None if load is None or load.mass < _LEAST_MASS else _in_flange(robot, load)
        loads[tool] = in_flange if loads.get(tool, in_flange) == in_flange else None
    return loads


def arms_of_tools(robot: Robot, loads: Mapping[str, Payload | None]) -> dict[str, Robot]:
    """Return the robot as it carries each tool; as it is where the load is not known."""
    if not any(effect.loaded for effect in robot.effects):
        return dict.fromkeys(loads, robot)
    arms = {load: robot.with_payload(load) for load in dict.fromkeys(loads.values())}
    return {tool: arms[load] for tool, load in loads.items()}


def _stated_loads(programs: Sequence[Program]) -> Iterator[tuple[str, Payload | None]]:
    for program in programs:
        loads = {name.lower(): load for name, load in program.loads.items()}
        for tool in dict.fromkeys(target.tool for target in program.targets):
            yield tool, loads.get(tool.lower())


def _in_flange(robot: Robot, load: Payload) -> Payload:
    """Return a load whose centre is given in the controller's flange frame."""
    flange = robot.controller.flange.matrix
    x, y, z = (flange[:3, :3] @ np.array(load.cog) + flange[:3, 3]).tolist()
    return Payload(load.mass, (x, y, z))
