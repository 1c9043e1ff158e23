"""The text of a URScript file: comments and strings set aside, brackets paired, and what the values in it are.

Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Numbers, Variables, and Types".
"""

from __future__ import annotations

import re
from typing import Final, Literal, NamedTuple, cast

from truearm.compensation.programs.lines import Lines, without_mark
from truearm.compensation.programs.numbers import NUMBER
from truearm.compensation.programs.program import Source
from truearm.errors import InputError

#: Beyond this [m, rad] a number is no part of a pose.
_MOST: Final = 1000.0

_NAME: Final = r"[A-Za-z_]\w*"
_QUIET: Final = re.compile(r"#[^\n]*|\"(?:[^\"\\\n]|\\[^\n])*\"|\"[^\"\n]*\"|'[^'\n]*'")
_BRACKET: Final = re.compile(r"[()\[\]{}]")
_PAIRS: Final = {")": "(", "]": "[", "}": "{"}
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


class Text:
    """The text of a file with comments and strings blank, so that every other character keeps its place.

    Raises:
        InputError: If a string or a bracket is not closed.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.lines = Lines(source.text)
        code = without_mark(source.text).replace("\r", "\n")
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
        return InputError(what, where=self.source.where(self.lines.number(place)), came=came, cure=cure)

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
        blank = cast("re.Match[str]", _SPACE.match(self.code, opened + 1))
        six = _SIX.match(self.code, blank.end())
        if six is not None and self.code[six.end()] in ",)":
            return _numbers(six, 1)
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
            after = cast("re.Match[str]", _SPACE.match(code, closed + 1)).end()
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
