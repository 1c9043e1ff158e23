"""The text of a URScript file: values, routines, calls and names; and split moves."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from operator import attrgetter
from typing import Final, Literal, NamedTuple, cast

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import (
    NUMBER,
    Edit,
    Lines,
    Move,
    Program,
    ProgramTarget,
    Source,
    Split,
    SplitEdits,
    indentation,
    line_end,
    replaced,
    without_mark,
    written,
)

# The text of a URScript file: comments and strings set aside, brackets paired, and what the values in it are.
#
# Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Numbers, Variables, and
# Types".

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
        self.code = _QUIET.sub(lambda quiet: " " * (quiet.end() - quiet.start()), code)
        quote = self.code.find('"')
        if quote >= 0:
            raise self.refusal("a string is not closed", quote, "The file may be truncated.")
        #: From every opening bracket to its closing one.
        self.partner: dict[int, int] = {}
        self._arguments: dict[int, list[Argument]] = {}
        waiting: list[int] = []
        for match in _BRACKET.finditer(self.code):
            place = match.start()
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
        arguments = self._arguments.get(opened)
        if arguments is None:
            arguments = self._arguments[opened] = []
            closed, place = self.partner[opened], opened
            while place < closed:
                argument, place = self._item(place + 1)
                if arguments or place < closed or argument.value.start < argument.value.stop:
                    arguments.append(argument)
        return arguments

    def argument(self, opened: int, index: int, keyword: str) -> Value | None:
        """Return an argument by its keyword, or its place among those without one; None if it is not there."""
        arguments = self.arguments(opened)
        for argument in arguments:
            if argument.keyword == keyword:
                return argument.value
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
        match = cast("re.Match[str]", _ITEM.match(code, place))  # it matches nothing, too
        keyword, end = match[1] or "", match.end()
        if code[end] in ",)]":
            if match[3] is not None:
                return Argument(keyword, _numbers(match, 3)), end
            if match[11] is not None:
                return Argument(keyword, Name(match[11], *match.span(11))), end
        elif match[11] is not None and code[end] == "(":
            closed = self.partner[end]
            after = cast("re.Match[str]", _SPACE.match(code, closed + 1)).end()
            if code[after] in ",)]":
                return Argument(keyword, Called(match[11], end, match.start(11), closed + 1)), after
        start = match.start(2)
        stop = self._next(_ARGUMENT_END, start)
        return Argument(keyword, self.value(start, stop)), stop

    def _incomplete(self, opened: int) -> str:
        values = [argument.value for argument in self.arguments(opened)]
        if any(_ONE_NUMBER.fullmatch(self.code, value.start, value.stop) is None for value in values):
            return "its numbers are computed"
        return f"it has {len(values)} numbers, not six"

    def _next(self, pattern: re.Pattern[str], place: int) -> int:
        """Return where a pattern is found next outside of the brackets that open on the way."""
        while (match := pattern.search(self.code, place)) is not None:
            closed = self.partner.get(match.start())
            if closed is None:
                return match.start()
            place = closed + 1
        return len(self.code)


def _numbers(match: re.Match[str], group: int) -> Numbers:
    """Return the six numbers of a match, of which the group is the whole, the next ones its ``p`` and the numbers."""
    spans: tuple[tuple[int, int], ...] = match.regs  # of all groups at once
    kind, *words = match.groups()[group : group + 7]
    return Numbers("pose" if kind else "joints", tuple(map(float, words)), spans[group + 2 : group + 8], *spans[group])


# Source: Universal Robots, The URScript Programming Language (script manual, e-Series), "Flow of Control", "Function",
# "Scoping rules", "Threads", "Program Label", "Secondary Programs".
_NAME_SCRIPT: Final = r"[A-Za-z_]\w*"
_EVENT: Final = re.compile(
    rf"""
      (?<![\w.]) (?: (?P<routine>def|thread|sec)[ \t]+(?P<header>{_NAME_SCRIPT})[ \t]*\(
                   | (?P<block>(?:if|while)\b) | (?P<turn>(?:elif|else)\b) | (?P<end>end\b)(?![ \t]*[=(\[.]) )
    | (?:^|(?<=:))[ \t]*(?:(?P<scope>global|local)[ \t]+)?(?!(?:if|while|elif|else|return|end)\b)
      (?P<variable>{_NAME_SCRIPT})[ \t]*(?:=(?!=)|(?P<element>\[))
    | (?P<first>(?:^|(?<=:))[ \t]*(?:run[ \t]+)?)?(?<![\w.])(?P<call>{_NAME_SCRIPT})[ \t]*\(
    """,
    re.ASCII | re.MULTILINE | re.VERBOSE,
)
_ASSIGNED: Final = re.compile(r"[ \t]*=(?!=)")
_NO_CALLS: Final = frozenset(("if", "while", "elif", "return", "not", "and", "or", "xor"))
_WORD_SCRIPT: Final = re.compile(_NAME_SCRIPT, re.ASCII)


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
        while (match := _EVENT.search(code, place)) is not None:
            place = match.end()
            event = match.lastgroup
            if event == "call":
                call = match["call"]
                if call in ("if", "while"):
                    blocks.append((match.start("call"), routine))
                stretch += call in ("if", "while", "elif")
                inside = max(inside, partner[place - 1])
                if call not in _NO_CALLS:
                    first = match["first"] is not None
                    self.calls.append(Call(call, match.start("call"), place - 1, routine, first, stretch))
                    if call in whole:
                        place = partner[place - 1]
            elif event == "variable":
                if match.start() >= inside:
                    value = self.assigned(place)
                    start, scope = match.start("variable"), match["scope"] or ""
                    self.assignments.append(Assignment(match["variable"], start, value, routine, scope))
                    place = value.stop if isinstance(value, Numbers) else place
            elif event == "element":
                assigned = _ASSIGNED.match(code, partner[place - 1] + 1)
                if assigned is not None and match.start() >= inside:
                    place, start = assigned.end(), match.start("variable")
                    self.assignments.append(Assignment(match["variable"], start, None, routine, ""))
            elif event == "header":
                blocks.append((match.start(), routine))
                arguments = self.arguments(place - 1)
                names = (argument.keyword or code[argument.value.start : argument.value.stop] for argument in arguments)
                self.routines.append(Routine(match["header"], match.start(), routine, frozenset(names)))
                routine = len(self.routines) - 1
                stretch += 1
                place = partner[place - 1]
            else:
                stretch += 1
                if event == "block":
                    blocks.append((match.start(), routine))
                elif event == "end" and blocks:
                    routine = blocks.pop()[1]
        if blocks:
            word = _WORD_SCRIPT.search(code, blocks[-1][0])
            kind = "routine or block" if word is None else word[0]
            raise self.refusal(f"this {kind} has no end", blocks[-1][0], "The file may be truncated.")


# What a variable of a URScript file holds where it is used.
#
# A name is looked for in the routine, then among the global variables, then in the routines around it (script manual,
# "Scoping rules"). Of several assignments the last one before the place of use holds, in the order of the text, or else
# the first one.
_GLOBAL: Final = -1
_START: Final = attrgetter("start")


class Names:
    """The variables of a file."""

    def __init__(self, script: Script) -> None:
        self._routines = script.routines
        self._series: dict[tuple[str, int], Series] = {}
        assignments = script.assignments
        shared = {
            assignment.name
            for assignment in assignments
            if assignment.scope == "global" or (not assignment.routine and not assignment.scope)
        }
        for assignment in assignments:
            own = assignment.scope == "local" or (assignment.scope == "" and assignment.name not in shared)
            key = (assignment.name, assignment.routine if own else _GLOBAL)
            series = self._series.get(key)
            if series is None:
                series = self._series[key] = Series()
            series.add(assignment)

    @property
    def series(self) -> list[Series]:
        """All variables."""
        return list(self._series.values())

    def find(self, name: str, routine: int, place: int) -> Assignment | Literal["argument"] | None:
        """Return what a name holds in a routine at a place; ``argument`` for one that the routine is called with."""
        own = self._series.get((name, routine))
        if name in self._routines[routine].arguments and (own is None or own.assignments[0].start >= place):
            return "argument"
        series = own or self._series.get((name, _GLOBAL))
        around = self._routines[routine].parent
        while series is None and around is not None:
            series = self._series.get((name, around))
            around = self._routines[around].parent
        if series is None:
            return None
        return series.assignments[max(bisect_left(series.assignments, place, key=_START) - 1, 0)]


#: Blend radius at the points on the way [m]; less where segments are short.
_RADIUS: Final = 0.001
#: Which argument is the time, and which the blend radius.
_TIME: Final = {"movej": 3, "movel": 3}
_BLEND: Final = {"movej": 4, "movel": 4, "movec": 4, "movep": 3, "optimovej": 3, "optimovel": 3}
_WORD_SPLIT: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_DECIMALS: Final = 6


# Split linear and circular moves of URScript: the same call before itself, once for each point on the way.
#
# The robot would stop at every point without a blend radius, and blends must not overlap (script manual, movej: a move
# whose blend overlaps with another one is skipped). So the points on the way get a small radius, and a move is left
# whole where its own radius, or the one it comes with, does not fit into its segments; where a time is given for it;
# where it goes to a target in a frame that the call does not name; and where its end is known to the robot alone.
def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split moves."""
    texts: dict[int, _Blends] = {}
    edits: list[Edit] = []
    whole: list[int] = []
    for split in splits:
        source = program.moves[split.move].source
        if source not in texts:
            texts[source] = _Blends(Text(program.sources[source]))
        new_edits = _edits(program, split, texts[source])
        edits += new_edits
        whole += [] if new_edits else [split.move]
    return SplitEdits(edits, whole)


class _Blends:
    """A text, and what it says of times and blend radii."""

    def __init__(self, text: Text) -> None:
        self.text = text
        self._known: dict[str, float | None] = {}

    def call(self, move: Move) -> tuple[str, int]:
        """Return the function of a move and its opening bracket."""
        word = _WORD_SPLIT.match(self.text.code, move.statement[0])
        return "" if word is None else word[0], self.text.code.index("(", move.statement[0])

    def number(self, argument: Value | None) -> float | None:
        """Return the number that an argument is, the largest that its variable gets, 0 for none; None if computed."""
        if argument is None:
            return 0.0
        word = self.text.code[argument.start : argument.stop]
        if word not in self._known:
            self._known[word] = self._value(word)
        return self._known[word]

    def _value(self, word: str) -> float | None:
        if re.fullmatch(NUMBER, word, re.ASCII):
            return float(word)
        if not _WORD_SPLIT.fullmatch(word):
            return None
        assigned = re.findall(rf"(?<![\w.]){word}[ \t]*=(?!=)[ \t]*([^\n]*)", self.text.code)
        values = [float(text) for text in map(str.rstrip, assigned) if re.fullmatch(NUMBER, text, re.ASCII)]
        return max(values) if values and len(values) == len(assigned) else None

    def radius(self, move: Move) -> float | None:
        """Return the blend radius of a move; None if it is computed."""
        function, opened = self.call(move)
        if function not in _BLEND:
            return 0.0
        return self.number(self.text.argument(opened, _BLEND[function], "r"))


def _edits(program: Program, split: Split, blends: _Blends) -> list[Edit]:
    """Return the edits that split a move; none if it stays whole."""
    move, text = program.moves[split.move], blends.text
    target = program.targets[move.target]
    function, opened = blends.call(move)
    if move.kind == "joint" or move.target_text == (0, 0) or not split.points:
        return []
    if function in _TIME and blends.number(text.argument(opened, _TIME[function], "t")) != 0.0:
        return []
    radius = _radius(program, split, blends)
    if radius is None:
        return []
    start, stop = move.statement
    blend = text.argument(opened, _BLEND[function], "r")
    copies = []
    for numbers, via in split.points:
        parts = [(*move.target_text, _written(numbers, target))]
        if move.via_text is not None and via is not None:
            parts.append((*move.via_text, _written(via, target)))
        place = (stop - 1, stop - 1) if blend is None else (blend.start, blend.stop)
        parts.append((*place, f", r={radius}" if blend is None else radius))
        copies.append(replaced(text.source.text, start, stop, parts))
    between = line_end(text.source.text, start) + indentation(text.source.text, start)
    edits = [Edit(move.source, start, start, "".join(copy + between for copy in copies))]
    if move.via_text is not None and split.last_via is not None:
        edits.append(Edit(move.source, *move.via_text, _written(split.last_via, target)))
    return edits


def _radius(program: Program, split: Split, blends: _Blends) -> str | None:
    """Return the blend radius of the points on the way, as it is written; None if there is no room for any."""
    move = program.moves[split.move]
    own = blends.radius(move)
    before = program.moves[split.move - 1] if split.move else None
    follows = before is not None and (before.source, before.routine) == (move.source, move.routine)
    coming = blends.radius(before) if before is not None and follows else 0.0
    if own is None or coming is None:
        return None
    target = program.targets[move.target]
    shortest = math.inf
    if target.form.kind == "pose":
        points = [numbers[:3] for numbers, _ in split.points]
        if target.parent is None:
            points.append(target.values[:3])
        shortest = min((math.dist(a, b) for a, b in pairwise(points)), default=math.inf)
    radius = min(_RADIUS, shortest / 4)
    longest = shortest - radius if math.isfinite(shortest) else _RADIUS
    if max(own, coming) > longest:
        return None
    return written(radius, _DECIMALS)


def _written(numbers: Sequence[float], target: ProgramTarget) -> str:
    return f"{'p' if target.form.kind == 'pose' else ''}[{', '.join(written(v, _DECIMALS) for v in numbers)}]"
