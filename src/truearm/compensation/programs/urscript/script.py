"""The routines, assignments and calls of a URScript file.

Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Flow of Control", "Function",
"Scoping rules", "Threads", "Program Label", "Secondary Programs".
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from truearm.compensation.programs.program import Source
from truearm.compensation.programs.urscript.text import Argument, Numbers, Text, Value

_NAME: Final = r"[A-Za-z_]\w*"
_EVENT: Final = re.compile(
    rf"""
      (?<![\w.]) (?: (?P<routine>def|thread|sec)[ \t]+(?P<header>{_NAME})[ \t]*\(
                   | (?P<block>(?:if|while)\b) | (?P<turn>(?:elif|else)\b) | (?P<end>end\b)(?![ \t]*[=(\[.]) )
    | (?:^|(?<=:))[ \t]*(?:(?P<scope>global|local)[ \t]+)?(?!(?:if|while|elif|else|return|end)\b)
      (?P<variable>{_NAME})[ \t]*(?:=(?!=)|(?P<element>\[))
    | (?P<first>(?:^|(?<=:))[ \t]*(?:run[ \t]+)?)?(?<![\w.])(?P<call>{_NAME})[ \t]*\(
    """,
    re.ASCII | re.MULTILINE | re.VERBOSE,
)
_ASSIGNED: Final = re.compile(r"[ \t]*=(?!=)")
_NO_CALLS: Final = frozenset(("if", "while", "elif", "return", "not", "and", "or", "xor"))
_WORD: Final = re.compile(_NAME, re.ASCII)


@dataclass(slots=True, eq=False)
class Assignment:
    """An assignment to a variable."""

    name: str
    start: int  #: start, routine: where it stands.
    value: Value | None  #: What is assigned; None where it is to one of the variable's elements.
    routine: int
    scope: str  #: ``global`` or ``local``, or empty if it does not say.
    aimed: bool = False  #: Whether a move goes there.
    series: Series = field(init=False)  #: All assignments to the same variable.

    @property
    def numbers(self) -> Numbers | None:
        """Its six numbers, if that is what is assigned."""
        return self.value if isinstance(self.value, Numbers) else None


@dataclass(slots=True, eq=False)
class Series:
    """All assignments to one variable in the order of the text."""

    assignments: list[Assignment] = field(default_factory=list)
    last_computed: int = -1  #: Where the last one stands that is not six numbers; -1 for none.
    several: bool = False  #: Whether they differ.
    reached: bool = False  #: Whether a move goes to one of them.

    def add(self, assignment: Assignment) -> None:
        """Add the next assignment."""
        numbers = assignment.numbers
        if numbers is None:
            self.last_computed = assignment.start
        if self.assignments:
            first = self.assignments[0].numbers
            self.several |= first is None or numbers is None or first.values != numbers.values
        self.assignments.append(assignment)
        assignment.series = self


class Call(NamedTuple):
    """A call: its first character, its opening bracket, its routine, and whether it is a statement.

    Calls of one `stretch` follow each other: no block begins or ends between them.
    """

    name: str
    start: int
    opened: int
    routine: int
    statement: bool
    stretch: int


@dataclass(frozen=True)
class Routine:
    """A function, thread or secondary program; the first one of a file is what stands outside of all others."""

    name: str
    start: int
    parent: int | None
    arguments: frozenset[str]


class Script(Text):
    """A file with its routines, assignments and calls in the order of the text.

    Of calls within calls only those are listed that are not within one of `whole`.

    Raises:
        InputError: If a string or a bracket is not closed, or a routine or block has no end.
    """

    def __init__(self, source: Source, whole: frozenset[str]) -> None:
        super().__init__(source)
        self.routines = [Routine("", 0, None, frozenset())]
        self.assignments: list[Assignment] = []
        self.calls: list[Call] = []
        blocks: list[tuple[int, int]] = []
        code, partner = self.code, self.partner
        routine = inside = place = stretch = 0
        while (found := _EVENT.search(code, place)) is not None:
            place = found.end()
            event = found.lastgroup
            if event == "call":
                call = found["call"]
                if call in ("if", "while"):
                    blocks.append((found.start("call"), routine))
                stretch += call in ("if", "while", "elif")
                inside = max(inside, partner[place - 1])
                if call not in _NO_CALLS:
                    first = found["first"] is not None
                    self.calls.append(Call(call, found.start("call"), place - 1, routine, first, stretch))
                    if call in whole:
                        place = partner[place - 1]
            elif event == "variable":
                if found.start() >= inside:
                    value = self.assigned(place)
                    start, scope = found.start("variable"), found["scope"] or ""
                    self.assignments.append(Assignment(found["variable"], start, value, routine, scope))
                    place = value.stop if isinstance(value, Numbers) else place
            elif event == "element":
                assigned = _ASSIGNED.match(code, partner[place - 1] + 1)
                if assigned is not None and found.start() >= inside:
                    place, start = assigned.end(), found.start("variable")
                    self.assignments.append(Assignment(found["variable"], start, None, routine, ""))
            elif event == "header":
                blocks.append((found.start(), routine))
                names = (self._argument_name(one) for one in self.arguments(place - 1))
                self.routines.append(Routine(found["header"], found.start(), routine, frozenset(names)))
                routine = len(self.routines) - 1
                stretch += 1
                place = partner[place - 1]
            else:
                stretch += 1
                if event == "block":
                    blocks.append((found.start(), routine))
                elif event == "end" and blocks:
                    routine = blocks.pop()[1]
        if blocks:
            word = _WORD.search(code, blocks[-1][0])
            what = "routine or block" if word is None else word[0]
            raise self.refusal(f"this {what} has no end", blocks[-1][0], "The file may be truncated.")

    def _argument_name(self, argument: Argument) -> str:
        return argument.keyword or self.code[argument.value.start : argument.value.stop]
