"""The text of a URScript file: comments and strings set aside, brackets paired, routines, assignments and calls.

Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Numbers, Variables, and Types",
"Flow of Control", "Function", "Scoping rules", "Threads", "Program Label", "Secondary Programs".
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from truearm.compensation.programs.lines import Lines
from truearm.compensation.programs.numbers import NUMBER
from truearm.compensation.programs.program import Source
from truearm.errors import InputError

#: Beyond this [m, rad] a number is no part of a pose.
_MOST: Final = 1000.0
_MARK: Final = "\xef\xbb\xbf"

_NAME: Final = r"[A-Za-z_]\w*"
_QUIET: Final = re.compile(r"#[^\n]*|\"(?:[^\"\\\n]|\\[^\n])*\"|\"[^\"\n]*\"|'[^'\n]*'")
_BRACKET: Final = re.compile(r"[()\[\]{}]")
_PAIRS: Final = {")": "(", "]": "[", "}": "{"}
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
_NO_CALLS: Final = frozenset(("return", "not", "and", "or", "xor"))
_SIX: Final = re.compile(rf"(p?)\[\s*({NUMBER})" + rf"\s*,\s*({NUMBER})" * 5 + r"\s*\]", re.ASCII)
_WORD: Final = re.compile(rf"({_NAME})\s*", re.ASCII)
_SPACE: Final = re.compile(r"\s*", re.ASCII)
_KEYWORD: Final = re.compile(rf"\s*(?:({_NAME})\s*=(?!=)\s*)?", re.ASCII)
_ARGUMENT_END: Final = re.compile(r"[,()\[\]{}]")
_STATEMENT_END: Final = re.compile(r"[\n;(\[{]")
_ONE_NUMBER: Final = re.compile(rf"\s*{NUMBER}\s*", re.ASCII)


class Numbers(NamedTuple):
    """Six numbers: a pose ``p[...]`` or the joints ``[...]``, and where each stands."""

    kind: Literal["pose", "joints"]
    values: tuple[float, ...]
    places: tuple[tuple[int, int], ...]
    start: int
    stop: int


class Name(NamedTuple):
    """A variable."""

    name: str
    start: int
    stop: int


class Called(NamedTuple):
    """A call that is a value."""

    function: str
    opened: int
    start: int
    stop: int


class Other(NamedTuple):
    """A value that only the robot knows, and why."""

    reason: str
    start: int
    stop: int


Value = Numbers | Name | Called | Other


class Argument(NamedTuple):
    """An argument of a call: its keyword, empty for none, and where its value stands."""

    keyword: str
    start: int
    stop: int


class Assignment(NamedTuple):
    """An assignment to a variable, or to one element of it, with the place of its value and its routine."""

    name: str
    start: int
    value: int
    routine: int
    scope: str
    element: bool


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


class Text:
    """The text of a file with comments and strings blank, so that every other character keeps its place.

    Raises
    ------
    InputError
        If a string or a bracket is not closed.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.lines = Lines(source.text)
        code = source.text.replace("\r", "\n")
        if code.startswith(_MARK):
            code = " " * len(_MARK) + code[len(_MARK) :]
        self.code = _QUIET.sub(lambda found: " " * (found.end() - found.start()), code)
        quote = self.code.find('"')
        if quote >= 0:
            raise self.refusal("a string is not closed", quote, "The file may be truncated.")
        #: From every opening bracket to its closing one.
        self.partner: dict[int, int] = {}
        waiting: list[int] = []
        for found in _BRACKET.finditer(self.code):
            place = found.start()
            opening = _PAIRS.get(self.code[place])
            if opening is None:
                waiting.append(place)
            elif waiting and self.code[waiting[-1]] == opening:
                self.partner[waiting.pop()] = place
            else:
                raise self.refusal(f"this {self.code[place]} closes no bracket", place)
        if waiting:
            cure = "The file may be truncated."
            raise self.refusal(f"this {self.code[waiting[-1]]} is not closed", waiting[-1], cure)

    def refusal(self, what: str, place: int, cure: str | None = None, came: object = None) -> InputError:
        """Return the refusal of the file for what stands at a place."""
        return InputError(what, where=f"{self.source.path}, line {self.lines.number(place)}", came=came, cure=cure)

    def arguments(self, opened: int) -> list[Argument]:
        """Return the arguments between a bracket and its partner."""
        closed = self.partner[opened]
        found: list[Argument] = []
        start = place = opened + 1
        while True:
            place = self._next(_ARGUMENT_END, place)
            keyword = _KEYWORD.match(self.code, start, place)
            begin = start if keyword is None else keyword.end()
            stop = begin + len(self.code[begin:place].rstrip())
            if stop > begin or found or place < closed:
                found.append(Argument("" if keyword is None else keyword[1] or "", begin, stop))
            if place >= closed:
                return found
            place = start = place + 1

    def argument(self, arguments: list[Argument], index: int, keyword: str) -> Argument | None:
        """Return an argument by its keyword, or its place among those without one."""
        for one in arguments:
            if one.keyword == keyword:
                return one
        if index < len(arguments) and not arguments[index].keyword and arguments[index].stop > arguments[index].start:
            return arguments[index]
        return None

    def assigned(self, start: int) -> Value:
        """Return the value of an assignment that begins at a place."""
        stop = start + len(self.code[start : self._next(_STATEMENT_END, start)].rstrip())
        blank = _SPACE.match(self.code, start, stop)
        return self.value(start if blank is None else blank.end(), stop)

    def first(self, opened: int) -> Value | None:
        """Return the first argument of a call if it is six numbers or a variable, quickly."""
        code = self.code
        blank = _SPACE.match(code, opened + 1)
        start = opened + 1 if blank is None else blank.end()
        six = _SIX.match(code, start)
        if six is not None:
            return self._numbers(six) if code[six.end()] in ",)" else None
        word = _WORD.match(code, start)
        if word is not None and code[word.end()] in ",)":
            return Name(word[1], start, word.end(1))
        return None

    def value(self, start: int, stop: int) -> Value:
        """Return the value that stands between two places, without white space at either."""
        code = self.code
        six = _SIX.match(code, start, stop)
        if six is not None and six.end() == stop:
            return self._numbers(six)
        word = _WORD.match(code, start, stop)
        begin = start if word is None else word.end()
        if word is not None and begin == stop:
            return Name(word[1], start, stop)
        if self.partner.get(begin) == stop - 1:
            if word is not None and code[begin] == "(":
                return Called(word[1], begin, start, stop)
            if code[begin] == "[" and (word is None or word[1] == "p"):
                return Other(self._incomplete(begin), start, stop)
        if word is not None and code[begin : begin + 1] == "[":
            return Other("it is taken from a list", start, stop)
        return Other("it is computed", start, stop)

    def _incomplete(self, opened: int) -> str:
        items = self.arguments(opened)
        if any(_ONE_NUMBER.fullmatch(self.code, item.start, item.stop) is None for item in items):
            return "its numbers are computed"
        return f"it has {len(items)} numbers, not six"

    def _numbers(self, six: re.Match[str]) -> Numbers:
        kind, *words = six.groups()
        values = tuple(map(float, words))
        if not -_MOST <= min(values) <= max(values) <= _MOST:
            worst = max(values, key=abs)
            raise self.refusal("a number is out of all proportion for metres and radians", six.start(), came=worst)
        places = (six.span(2), six.span(3), six.span(4), six.span(5), six.span(6), six.span(7))
        return Numbers("pose" if kind else "joints", values, places, six.start(), six.end())

    def _next(self, pattern: re.Pattern[str], place: int) -> int:
        """Return where a pattern is found next outside of the brackets that open on the way."""
        while (found := pattern.search(self.code, place)) is not None:
            closed = self.partner.get(found.start())
            if closed is None:
                return found.start()
            place = closed + 1
        return len(self.code)


class Script(Text):
    """A file with its routines, assignments and calls in the order of the text.

    Of calls within calls only those are listed that are not within one of `whole`.

    Raises
    ------
    InputError
        If a string or a bracket is not closed, or a routine or block has no end.
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
            call, variable = found["call"], found["variable"]
            if call in ("if", "while") or found["block"]:
                blocks.append((found.start(), routine))
                stretch += 1
            elif call == "elif" or found["turn"]:
                stretch += 1
            elif call is not None:
                inside = max(inside, partner[place - 1])
                if call not in _NO_CALLS:
                    first = found["first"] is not None
                    self.calls.append(Call(call, found.start("call"), place - 1, routine, first, stretch))
                    if call in whole:
                        place = partner[place - 1]
            elif variable is not None:
                element = found["element"] is not None
                if element:
                    assigned = _ASSIGNED.match(code, partner[place - 1] + 1)
                    place = place if assigned is None else assigned.end()
                    element = assigned is not None
                    if assigned is None:
                        continue
                if found.start() >= inside:
                    start, scope = found.start("variable"), found["scope"] or ""
                    self.assignments.append(Assignment(variable, start, place, routine, scope, element))
            elif found["end"]:
                stretch += 1
                if blocks:
                    routine = blocks.pop()[1]
            else:
                blocks.append((found.start(), routine))
                names = (self._argument_name(one) for one in self.arguments(place - 1))
                self.routines.append(Routine(found["header"], found.start(), routine, frozenset(names)))
                routine = len(self.routines) - 1
                stretch += 1
                place = partner[place - 1]
        if blocks:
            word = _WORD.search(code, blocks[-1][0])
            what = "routine or block" if word is None else word[1]
            raise self.refusal(f"this {what} has no end", blocks[-1][0], "The file may be truncated.")

    def _argument_name(self, argument: Argument) -> str:
        return argument.keyword or self.code[argument.start : argument.stop]
