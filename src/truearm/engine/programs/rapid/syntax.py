"""The structure of RAPID: modules, routines, declarations and instructions.

Source: ABB, Technical reference manual, RAPID Kernel (3HAC050946-001): sections on lexical elements, data declarations,
statements, routine declarations and task modules (scope rules).

No line ends a statement, only ``;`` does, and the words that open and close blocks stand without any. So the text is
taken apart at the semicolons, and what stands before an instruction in its part are such words.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Final, NamedTuple

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import Lines, Source, without_mark

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

    def blank(match: re.Match[str]) -> str:
        length = len(match[0])
        if match[0][0] == "!":
            return " " * length
        if not match[1]:
            unclosed.append(match.start())
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


# Source: ABB, Technical reference manual, RAPID Kernel (3HAC050946-001), argument lists: optional arguments begin with
# a backslash and may follow the one before without a comma.

#: Brackets, commas and backslashes; innermost brackets together with what is in them.
_MARK: Final = re.compile(r"\[[^\[\](){}]*+\]|[\[\](){},\\]")
#: What nearly all arguments are: a target, three names, perhaps a time and a work object. Found at once: programs are
#: long.
_USUAL: Final = re.compile(
    r"\s*+(\w++|\[(?:[^\[\]]++|\[[^\[\]]*+\])*+\])\s*+,\s*+(\w++)\s*+(?:\\\s*+T\s*+:=\s*+([\w.]++)\s*+)?+,"
    r"\s*+(\w++)\s*+,\s*+(\w++)\s*+(?:\\\s*+WObj\s*+:=\s*+(\w++)\s*+)?+",
    re.I,
)
_OPTION: Final = re.compile(r"\\\s*+([^\W\d]\w*+)\s*+(?::=)?+")


@dataclass(slots=True)
class Arguments:
    """The arguments of an instruction or a function."""

    #: Where those stand that are not optional, each ``(start, stop)``.
    needed: list[tuple[int, int]] = field(default_factory=list)
    #: Where the values of the optional ones stand, by name in lower case; a switch has an empty one.
    options: dict[str, tuple[int, int]] = field(default_factory=dict)


def trimmed(code: str, start: int, stop: int) -> tuple[int, int]:
    """Return what remains of a span without white space at its ends."""
    if start < stop and not code[start].isspace() and not code[stop - 1].isspace():
        return start, stop
    text = code[start:stop]
    inner = text.lstrip()
    start += len(text) - len(inner)
    return start, start + len(inner.rstrip())


def arguments_of(code: str, start: int, stop: int) -> Arguments:
    """Return the arguments that stand in a span of code, whose brackets must be closed."""
    usual = _USUAL.fullmatch(code, start, stop)
    if usual is not None:
        _, target, speed, time, zone, tool, frame = usual.regs
        options = {"t": time, "wobj": frame}
        return Arguments([target, speed, zone, tool], {name: span for name, span in options.items() if span[0] >= 0})
    arguments = Arguments()
    depth, begin, optional = 0, start, False
    for mark in _MARK.finditer(code, start, stop):
        character = mark[0]
        if len(character) > 1:
            continue
        if character in "[({":
            depth += 1
        elif character in "])}":
            depth -= 1
        elif depth == 0:
            _put(arguments, code, begin, mark.start(), optional, after_option=character == "\\")
            optional = character == "\\"
            begin = mark.start() + (not optional)
    _put(arguments, code, begin, stop, optional, after_option=False)
    return arguments


def _put(arguments: Arguments, code: str, start: int, stop: int, optional: bool, after_option: bool) -> None:
    if not optional:
        span = trimmed(code, start, stop)
        # What is empty before an optional argument is none that is missing.
        if span[0] < span[1] or not after_option:
            arguments.needed.append(span)
    elif (name := _OPTION.match(code, start, stop)) is not None:
        arguments.options[name[1].lower()] = trimmed(code, name.end(), stop)


_NAME: Final = r"[^\W\d]\w*+"
_WORD: Final = re.compile(rf"\s*+({_NAME})\s*+")
_DECLARED: Final = re.compile(
    rf"(?:(?:LOCAL|TASK)\s++)?+({_NAME})\s++({_NAME})\s*+(?:\{{([^{{}}]*+)\}}\s*+)?+(:=)?+", re.I
)
_HEAD: Final = {
    "module": re.compile(rf"({_NAME})\s*+(?:\([^()]*+\))?+"),
    "proc": re.compile(rf"({_NAME})\s*+\(([^()]*+)\)"),
    "func": re.compile(rf"{_NAME}\s++({_NAME})\s*+\(([^()]*+)\)"),
    "trap": re.compile(rf"({_NAME})\s*+(?:\(([^()]*+)\))?+"),
}
_PARAMETER: Final = re.compile(rf"\b({_NAME})\s++({_NAME})\s*+(?:\{{[^{{}}]*+\}}\s*+)?+(?=[,|)\\]|\Z)")
_THEN: Final = re.compile(r"\bTHEN\b", re.I)
_DO: Final = re.compile(r"\bDO\b", re.I)
_CASE: Final = re.compile(r"(?=\b(?:CASE|DEFAULT|ENDTEST)\b)", re.I)
_COLON: Final = re.compile(r":(?!=)")
_ENDRECORD: Final = re.compile(r"\bENDRECORD\b", re.I)
_LIST: Final = re.compile(r"(?:\([^()]*+\))?+")
#: The block words after which the same part goes on, with what of theirs is passed over.
_PASSED: Final = {
    "for": _DO,
    "while": _DO,
    "elseif": _THEN,
    "test": _CASE,
    "case": _COLON,
    "default": _COLON,
    "error": _LIST,
    "backward": _LIST,
    **dict.fromkeys(("else", "endif", "endfor", "endwhile", "endtest", "undo"), _LIST),
}
_LEAVING: Final = frozenset(("goto", "return", "raise", "retry", "trynext", "exit", "exitcycle", "connect", "alias"))
_MEMBER: Final = rf"(?:\s*+\.\s*+(?:{_NAME})|\s*+\{{[^{{}}]*+\}})*+"
_ASSIGNED: Final = re.compile(rf"({_MEMBER})\s*+:=")
_ASSIGNED_AFTER_IF: Final = re.compile(rf"(?<!\\)\b({_NAME})({_MEMBER})\s*+:=")
_CHANGING: Final = frozenset(("add", "incr", "decr", "clear"))
_CHANGED: Final = re.compile(rf"({_NAME})({_MEMBER})")


class _Walk:
    """One walk through a file, statement after statement."""

    def __init__(self, listing: Listing, source: int, motions: frozenset[str], quiet: frozenset[str]) -> None:
        self.listing, self.source, self.code = listing, source, listing.codes[source]
        self.motions, self.quiet = motions, quiet
        self.module: Scope | None = None
        self.outside: Scope = {}
        self.routine: Scope | None = None
        self.closing, self.opened = "", 0  # what closes the routine, and where it was opened
        self.modules, self.module_place = 0, 0
        self.in_record = False
        self.stretch = 1 + (listing.instructions[-1].stretch if listing.instructions else 0)
        words = "|".join(sorted(motions))
        self.motion_after_if = re.compile(rf"(?<![\\.\w])(?:{words})\b(?=\s*+[^\s:(=<>,)])", re.I)

    def run(self) -> None:
        code, start = self.code, 0
        while start < len(code):
            stop = code.find(";", start)
            stop = len(code) if stop < 0 else stop
            self._part(start, stop)
            start = stop + 1
        if self.module is not None:
            raise self._refusal(self.module_place, "a MODULE has no ENDMODULE")
        if not self.modules:
            raise self._refusal(0, "there is no MODULE")

    def _refusal(self, place: int, what: str) -> InputError:
        return self.listing.refusal(self.source, place, what)

    def _part(self, place: int, stop: int) -> None:
        code, local = self.code, False
        if self.in_record:
            match = _ENDRECORD.search(code, place, stop)
            if match is None:
                return None
            self.in_record, place = False, match.end()
        while match := _WORD.match(code, place, stop):
            word, place = match[1].lower(), match.end()
            if word in self.motions:
                return self._instruction(match, stop)
            if word in ("const", "var", "pers"):
                return self._declaration(place, stop, local)
            if word in ("local", "task"):
                local = word == "local"
                continue
            if word in self.quiet and code[match.end() : match.end() + 1] != ":":
                return None
            if word in _CHANGING and (changed := _CHANGED.match(code, place, stop)):
                return self._written(changed[1], changed[2], changed.start())
            if word not in _PASSED and (assigned := _ASSIGNED.match(code, match.end(1), stop)):
                return self._written(match[1], assigned[1], match.start(1))
            # From here on the robot may be elsewhere than the instruction before has sent it.
            self.stretch += 1
            if word in _HEAD:
                place = self._open(word, match.start(1), place, stop)
            elif word in ("endproc", "endfunc", "endtrap", "endmodule"):
                self._close(word, match.start(1))
            elif word == "record":
                closed = _ENDRECORD.search(code, place, stop)
                if closed is None:
                    self.in_record = True
                    return None
                place = closed.end()
            elif word == "if":
                then = _THEN.search(code, place, stop)
                if then is None:
                    return self._after_if(place, stop)
                place = then.end()
            elif word in _PASSED:
                passed = _PASSED[word].search(code, place, stop)
                if passed is None:
                    return None
                place = passed.end()
            elif word in _LEAVING:
                return None
            elif colon := _COLON.match(code, place, stop):
                place = colon.end()
            else:
                return self._instruction(match, stop)
        if code[place:stop].strip():
            self.stretch += 1
        return None

    def _instruction(self, word: re.Match[str], stop: int, guarded: bool = False) -> None:
        if self.routine is None or stop == len(self.code):
            return
        group = word.lastindex or 0
        self.listing.instructions.append(
            Instruction(
                word[group], self.source, word.start(group), word.end(group), stop,
                *self._scopes(), self.stretch, guarded,
            )
        )  # fmt: skip

    def _scopes(self) -> tuple[Scope, Scope]:
        outside = self.outside
        return outside if self.routine is None else self.routine, outside if self.module is None else self.module

    def _after_if(self, place: int, stop: int) -> None:
        motion = self.motion_after_if.search(self.code, place, stop)
        if motion is not None:
            self._instruction(motion, stop, guarded=True)
        elif assigned := _ASSIGNED_AFTER_IF.search(self.code, place, stop):
            self._written(assigned[1], assigned[2], assigned.start())
        self.stretch += 1

    def _written(self, name: str, member: str, place: int) -> None:
        self.listing.writings.append(Writing(name, member, self.source, place, *self._scopes()))

    def _declaration(self, place: int, stop: int, local: bool) -> None:
        match = _DECLARED.match(self.code, place, stop)
        if match is None:
            return
        local = local or self.code[place : place + 5].lower() == "local"
        datum = Datum(match[1].lower(), match[2], self.source, match.start(2), size=match[3])
        if match[4]:
            datum.start, datum.stop = match.end(), stop
        self.listing.data.append(datum)
        if self.routine is not None:
            self._declare(self.routine, datum)
        elif local and self.module is not None:
            self._declare(self.module, datum)
        else:
            self._declare(self.listing.shared, datum)

    @staticmethod
    def _declare(scope: Scope, datum: Datum) -> None:
        other = scope.setdefault(datum.name.lower(), datum)
        if other is not datum:
            other.twice = datum.twice = True

    def _open(self, word: str, start: int, place: int, stop: int) -> int:
        match = _HEAD[word].match(self.code, place, stop)
        if match is None:
            raise self._refusal(start, f"the head of a {word.upper()} is incomplete")
        if self.routine is not None:
            raise self._refusal(self.opened, f"a routine has no {self.closing.upper()}")
        if word == "module":
            if self.module is not None:
                raise self._refusal(self.module_place, "a MODULE has no ENDMODULE")
            self.module, self.module_place = {}, start
            self.modules += 1
            return match.end()
        self.routine, self.closing, self.opened = {}, f"end{word}", start
        self.listing.routines.add(match[1].lower())
        for parameter in _PARAMETER.finditer(match[2] or ""):
            name = parameter[2].lower()
            self.routine[name] = Datum(parameter[1].lower(), parameter[2], self.source, start, parameter=True)
        return match.end()

    def _close(self, word: str, place: int) -> None:
        if word == "endmodule":
            if self.routine is not None:
                raise self._refusal(self.opened, f"a routine has no {self.closing.upper()}")
            if self.module is None:
                raise self._refusal(place, "an ENDMODULE closes no MODULE")
            self.module = None
        elif self.routine is None or self.closing != word:
            raise self._refusal(place, f"an {word.upper()} closes nothing that is open")
        else:
            self.routine = None


def listing_of(sources: Sequence[Source], motions: frozenset[str], quiet: frozenset[str]) -> Listing:
    """Take the files of a program apart.

    Args:
        motions: First words, in lower case, of instructions that move the robot.
        quiet: First words, in lower case, of instructions that do not.

    Raises:
        InputError: If a string, a bracket, a routine or a module is not closed.
    """
    listing = Listing(tuple(sources))
    for source in range(len(sources)):
        listing.take(source)
        _Walk(listing, source, motions, quiet).run()
    listing.notewritings()
    return listing
