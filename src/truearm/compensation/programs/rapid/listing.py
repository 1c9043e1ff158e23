"""What the files of a RAPID program hold: data, instructions, and which name means what at an instruction.

Source: ABB, Technical reference manual, RAPID Kernel (3HAC050946-001): sections on lexical elements and scope rules.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import islice
from typing import Final, NamedTuple

from truearm.compensation.programs.lines import Lines, without_mark
from truearm.compensation.programs.program import Source
from truearm.errors import InputError

_OUTSIDE_CODE: Final = re.compile(r'![^\r\n]*+|"(?:[^"\r\n]|"")*+("?+)')
_HEADER: Final = re.compile(r"\s*+%%%.*?%%%", re.S)
_NOT_BRACKETS: Final = bytes(set(range(256)) - set(b"[](){};"))
_PAIRS: Final = {"]": "[", ")": "(", "}": "{"}


def code_of(text: str) -> tuple[str, int | None]:
    """Blank comments, the header and the insides of strings.

    Returns:
        code: As long as the text.
        unclosed: Where the first string begins that is not closed, None if all are.
    """
    unclosed: list[int] = []

    def blank(found: re.Match[str]) -> str:
        length = len(found[0])
        if found[0][0] == "!":
            return " " * length
        if not found[1]:
            unclosed.append(found.start())
            return " " * length
        return f'"{" " * (length - 2)}"'

    code = without_mark(_OUTSIDE_CODE.sub(blank, text))
    header = _HEADER.match(code)
    if header:
        code = " " * header.end() + code[header.end() :]
    return code, unclosed[0] if unclosed else None


@dataclass(slots=True, eq=False)
class Datum:
    """Something with a name that is declared: data or a parameter."""

    type: str  #: type, name: type in lower case, and the name as declared.
    name: str
    source: int  #: source, place: file, from 0, and where its name stands.
    place: int
    start: int = 0  #: start, stop: where its initial value stands; equal if it has none.
    stop: int = 0
    size: str | None = None  #: What stands in the braces of an array, None for no array.
    parameter: bool = False  #: Whether it is a parameter of a routine.
    twice: bool = False  #: Whether its name is declared again in the same scope.
    written: int = 0  #: The line of the program on which it gets a value, 0 for none.


Scope = dict[str, Datum]


class Instruction(NamedTuple):
    """An instruction: its first word, where it stands, and what names mean there."""

    word: str  #: As written.
    #: source, start, arguments, stop: file, from 0; where it begins, where its arguments begin, and where its semicolon
    #: is.
    source: int
    start: int
    arguments: int
    stop: int
    routine: Scope  #: routine, module: the scopes it is in.
    module: Scope
    stretch: int  #: Instructions of the same stretch follow each other, with nothing between them that moves the robot.
    guarded: bool  #: Whether it is the one instruction of an IF without THEN.


class Writing(NamedTuple):
    """An assignment: the name, what of it is written, and what names mean there."""

    name: str
    member: str
    source: int
    place: int
    routine: Scope
    module: Scope


@dataclass(eq=False)
class Listing:
    """What the files of a program hold."""

    sources: tuple[Source, ...]  #: sources, codes: the files, and their texts as :func:`code_of` has them.
    codes: list[str] = field(default_factory=list)
    data: list[Datum] = field(default_factory=list)  #: Everything declared but parameters, in the order of the text.
    #: In the order of the text: those that move the robot and those that are not known.
    instructions: list[Instruction] = field(default_factory=list)
    routines: set[str] = field(default_factory=set)  #: Names of the routines, in lower case.
    shared: Scope = field(default_factory=dict)  #: What is declared for all modules.
    writings: list[Writing] = field(default_factory=list)  #: The assignments.
    _lines: list[Lines] = field(default_factory=list)

    def line(self, source: int, place: int) -> int:
        """Return the number of the line that a place is on, from 1."""
        return self._lines[source].number(place)

    def find(self, name: str, at: Instruction | Writing) -> Datum | None:
        """Return what a name means at an instruction, None if it is declared nowhere in the program."""
        folded = name.lower()
        return at.routine.get(folded) or at.module.get(folded) or self.shared.get(folded)

    def refusal(
        self, source: int, place: int, what: str, came: object = None, allowed: str | None = None
    ) -> InputError:
        """Return the refusal of what stands at a place."""
        where = self.sources[source].where(self.line(source, place))
        cure = None if allowed else "Is the file complete?"
        return InputError(what, where=where, came=came, allowed=allowed, cure=cure)

    def take(self, source: int) -> None:
        """Take a file's text, and refuse it if strings or brackets are not closed."""
        text = self.sources[source].text
        self._lines.append(Lines(text))
        code, unclosed = code_of(text)
        if unclosed is not None:
            raise self.refusal(source, unclosed, "a string is not closed")
        self.codes.append(code)
        self._refuse_open_brackets(source, code)

    def notewritings(self) -> None:
        """Note at the data which of them the program writes, when all files are taken."""
        for w in self.writings:
            datum = self.find(w.name, w)
            if datum is not None and not w.member.lower().replace(" ", "").startswith(".tload"):
                datum.written = datum.written or self.line(w.source, w.place)

    def _refuse_open_brackets(self, source: int, code: str) -> None:
        parts = code.encode("latin-1").translate(None, _NOT_BRACKETS).decode("latin-1").split(";")
        wrong = {part: place for part in set(parts) if (place := _wrong_bracket(part)) is not None}
        if not wrong:
            return
        number = next(i for i, part in enumerate(parts) if part in wrong)
        marks = re.finditer(r"[\[\](){};]", code)
        passed = sum(len(part) + 1 for part in parts[:number]) + wrong[parts[number]]
        place = next(islice(marks, passed, None)).start()
        raise self.refusal(source, place, "a bracket is not closed or not opened")


def _wrong_bracket(brackets: str) -> int | None:
    """Return the place of a bracket that closes none or is not closed, None if all close in turn."""
    open_ones: list[int] = []
    for place, bracket in enumerate(brackets):
        if bracket in "[({":
            open_ones.append(place)
        elif not open_ones or brackets[open_ones.pop()] != _PAIRS[bracket]:
            return place
    return open_ones[-1] if open_ones else None
