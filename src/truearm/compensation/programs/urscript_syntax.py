"""The text of a URScript file: comments and strings set aside, brackets paired, routines, assignments and calls.

Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Numbers, Variables, and Types",
"Flow of Control", "Function", "Scoping rules", "Threads", "Program Label", "Secondary Programs".
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, cast

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
_NO_CALLS: Final = frozenset(("if", "while", "elif", "return", "not", "and", "or", "xor"))
_LITERAL: Final = rf"((p?)\[\s*({NUMBER})" + rf"\s*,\s*({NUMBER})" * 5 + r"\s*\])"
_SIX: Final = re.compile(_LITERAL, re.ASCII)
#: An argument: its keyword, where its value begins, and that if it is six numbers or begins with a name.
_ITEM: Final = re.compile(rf"\s*(?:({_NAME})\s*=(?!=)\s*)?()(?:{_LITERAL}|({_NAME}))?\s*", re.ASCII)
_WORD: Final = re.compile(rf"({_NAME})\s*", re.ASCII)
_BLANK: Final = re.compile(r"[ \t]*")
_SPACE: Final = re.compile(r"\s*", re.ASCII)
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
    """An argument of a call, and its keyword, empty for none."""

    keyword: str
    value: Value


@dataclass(slots=True, eq=False)
class Assignment:
    """An assignment to a variable.

    Attributes
    ----------
    start, routine
        Where it stands.
    value
        What is assigned; None where it is to one of the variable's elements.
    scope
        ``global`` or ``local``, or empty if it does not say.
    aimed
        Whether a move goes there.
    series
        All assignments to the same variable.
    """

    name: str
    start: int
    value: Value | None
    routine: int
    scope: str
    aimed: bool = False
    series: Series = field(init=False)

    @property
    def numbers(self) -> Numbers | None:
        """Its six numbers, if that is what is assigned."""
        return self.value if isinstance(self.value, Numbers) else None


@dataclass(slots=True, eq=False)
class Series:
    """All assignments to one variable in the order of the text.

    Attributes
    ----------
    last_computed
        Where the last one stands that is not six numbers; -1 for none.
    several
        Whether they differ.
    reached
        Whether a move goes to one of them.
    """

    assignments: list[Assignment] = field(default_factory=list)
    last_computed: int = -1
    several: bool = False
    reached: bool = False

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
        self._arguments: dict[int, list[Argument]] = {}
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
        found = self._arguments.get(opened)
        if found is None:
            found = self._arguments[opened] = []
            closed, place = self.partner[opened], opened
            while place < closed:
                argument, place = self._item(place + 1)
                if found or place < closed or argument.value.start < argument.value.stop:
                    found.append(argument)
        return found

    def argument(self, opened: int, index: int, keyword: str) -> Value | None:
        """Return an argument by its keyword, or its place among those without one; None if it is not there."""
        arguments = self.arguments(opened)
        for one in arguments:
            if one.keyword == keyword:
                return one.value
        if index < len(arguments) and not arguments[index].keyword:
            value = arguments[index].value
            return value if value.start < value.stop else None
        return None

    def first(self, opened: int, keyword: str) -> Value | None:
        """Return the first argument of a call, as :meth:`argument` but without reading the others if need not be."""
        argument, _ = self._item(opened + 1)
        if not argument.keyword and argument.value.start < argument.value.stop:
            return argument.value
        return self.argument(opened, 0, keyword)

    def assigned(self, start: int) -> Value:
        """Return the value of an assignment that begins at a place."""
        blank = _BLANK.match(self.code, start)
        start = start if blank is None else blank.end()
        six = _SIX.match(self.code, start)
        if six is not None and self.code[six.end() : six.end() + 1] in ("\n", ""):
            return _numbers(six, 1)
        return self.value(start, self._next(_STATEMENT_END, start))

    def value(self, start: int, stop: int) -> Value:
        """Return the value that stands between two places, with white space at the end or not."""
        code = self.code
        stop = start + len(code[start:stop].rstrip())
        six = _SIX.match(code, start, stop)
        if six is not None and six.end() == stop:
            return _numbers(six, 1)
        word = _WORD.match(code, start, stop)
        begin = start if word is None else word.end()
        if word is not None and begin == stop:
            return Name(word[1], start, stop)
        if self.partner.get(begin) == stop - 1:
            if word is not None and code[begin] == "(":
                return Called(word[1], begin, start, stop)
            if code[begin] == "[":
                literal = word is None or word[1] == "p"
                return Other(self._incomplete(begin) if literal else "it is taken from a list", start, stop)
        return Other("it is computed", start, stop)

    def sized(self, numbers: Numbers) -> Numbers:
        """Return numbers, or refuse them where one is too large for metres and radians."""
        values = numbers.values
        if not -_MOST <= min(values) <= max(values) <= _MOST:
            worst = max(values, key=abs)
            raise self.refusal("a number is out of all proportion for metres and radians", numbers.start, came=worst)
        return numbers

    def _item(self, place: int) -> tuple[Argument, int]:
        """Return the argument that begins at a place, and where it ends: at a comma or at the closing bracket."""
        code = self.code
        found = cast("re.Match[str]", _ITEM.match(code, place))  # it matches nothing, too
        keyword, end = found[1] or "", found.end()
        if code[end] in ",)]":
            if found[3] is not None:
                return Argument(keyword, _numbers(found, 3)), end
            if found[11] is not None:
                return Argument(keyword, Name(found[11], *found.span(11))), end
        elif found[11] is not None and code[end] == "(":
            closed = self.partner[end]
            blank = _SPACE.match(code, closed + 1)
            after = closed + 1 if blank is None else blank.end()
            if code[after] in ",)]":
                return Argument(keyword, Called(found[11], end, found.start(11), closed + 1)), after
        start = found.start(2)
        stop = self._next(_ARGUMENT_END, start)
        return Argument(keyword, self.value(start, stop)), stop

    def _incomplete(self, opened: int) -> str:
        values = [argument.value for argument in self.arguments(opened)]
        if any(_ONE_NUMBER.fullmatch(self.code, value.start, value.stop) is None for value in values):
            return "its numbers are computed"
        return f"it has {len(values)} numbers, not six"

    def _next(self, pattern: re.Pattern[str], place: int) -> int:
        """Return where a pattern is found next outside of the brackets that open on the way."""
        while (found := pattern.search(self.code, place)) is not None:
            closed = self.partner.get(found.start())
            if closed is None:
                return found.start()
            place = closed + 1
        return len(self.code)


def _numbers(found: re.Match[str], group: int) -> Numbers:
    """Return the six numbers of a match, of which the group is the whole, the next ones its ``p`` and the numbers."""
    spans: tuple[tuple[int, int], ...] = found.regs  # of all groups at once
    kind, *words = found.groups()[group : group + 7]
    return Numbers("pose" if kind else "joints", tuple(map(float, words)), spans[group + 2 : group + 8], *spans[group])


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
            what = "routine or block" if word is None else word[1]
            raise self.refusal(f"this {what} has no end", blocks[-1][0], "The file may be truncated.")

    def _argument_name(self, argument: Argument) -> str:
        return argument.keyword or self.code[argument.value.start : argument.value.stop]
