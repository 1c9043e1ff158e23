"""Which targets of programs are corrected, and why others stay: what the user says of them.

A target that was computed off-line is where the nominal robot has to be told to go elsewhere. One that was taught with
this robot is right already, whatever its numbers say: with the same tool, frame, load and joint zeros the robot comes
back to it. Joint positions mean the joints and no place, so they stay unless asked for.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import translate
from typing import Final, Literal

from truearm.compensation.programs.program import Program, ProgramTarget
from truearm.compensation.questions import Question
from truearm.errors import InputError, did_you_mean

#: What may have been taught with the robot itself.
Taught = Literal["points", "frames", "tools"]
TAUGHT: Final[tuple[Taught, ...]] = ("points", "frames", "tools")
#: What FANUC's programs write behind the number of a position: P[13:seam].
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
    #: Whether targets are corrected that would rather get worse, see :mod:`truearm.compensation.kept_targets`.
    every: bool = False

    def was_taught(self, what: Taught) -> bool:
        """Return whether something is said to be taught."""
        return self.taught is not None and what in self.taught


EVERY_POSE: Final = Choice()


def kept_by_choice(programs: Sequence[Program], choice: Choice) -> list[dict[int, Kept]]:
    """Return for each program which of its targets stay as they are, and why.

    Offsets from taught points are corrected: they have to be so far from where the real robot is at the point.

    Raises:
        InputError: If a name or pattern fits no target.
    """
    only, keep = (Patterns(programs, given, name) for given, name in ((choice.only, "only"), (choice.keep, "keep")))
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
    kept = kept_by_choice(programs, choice)
    nothing = all(len(rows) == len(one.targets) for one, rows in zip(programs, kept, strict=True))
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
        given: The names and patterns.
        parameter, where: What a refusal names.

    Raises:
        InputError: If one fits no target.
    """

    def __init__(
        self, programs: Sequence[Program], given: Iterable[str], parameter: str, where: str | None = None
    ) -> None:
        names = {target.name for program in programs for target in program.targets if target.name}
        self._names: set[str] = set()
        for text in given:
            # P[3] is a name of FANUC, and no pattern
            wanted = re.compile(translate(text.replace("[", "[[]")), re.IGNORECASE)
            found = {name for name in names if wanted.match(name) or wanted.match(_COMMENT.sub("", name))}
            if not found:
                raise InputError(
                    "no target of the programs has this name",
                    parameter=parameter,
                    where=where,
                    came=text,
                    allowed="a name as the program writes it, or a pattern such as pHole*",
                    cure=did_you_mean(text, sorted(names)),
                )
            self._names |= found

    def fit(self, name: str) -> bool:
        """Return whether a target of this name was meant."""
        return name in self._names
