"""KRL programs read, what the words of their moves mean, and split moves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from truearm.engine.programs.krl.lines import JOINTS, Statement, Text, aggregate, configuration, short
from truearm.engine.programs.krl.names import (
    REFERENCE,
    TARGET_TYPES,
    Frames,
    Holding,
    Names,
    Setting,
    Taught,
    Variable,
    literal_index,
)
from truearm.engine.programs.krl.outline import Outline, Routine
from truearm.engine.programs.program import (
    ANY_POSTURE,
    Configuration,
    Edit,
    Form,
    Move,
    MoveKind,
    Program,
    ProgramTarget,
    Skipped,
    Source,
    Split,
    SplitEdits,
    indentation,
    line_end,
    replaced,
    written,
)

Span = tuple[int, int]

_OPERAND_TEXT: Final = (
    r"(?:\{[^{}\n]*+\}|\$?[A-Za-z_][\w$]*+(?:\s*+\[[^\]\n]*+\])?+(?:\s*+\.\s*+\w++(?:\[[^\]\n]*+\])?+)*+)"
)
_OPERAND: Final = re.compile(_OPERAND_TEXT, re.ASCII)
_PLACE: Final = re.compile(rf"\s*+({_OPERAND_TEXT}(?:\s*+:\s*+{_OPERAND_TEXT})*+)", re.ASCII)
_COMMA: Final = re.compile(r"\s*+,")
_AFTER: Final = re.compile(r"\s*+(?:,|\Z|C_\w|WITH\b)", re.ASCII | re.IGNORECASE)
_CIRCLE_ANGLE: Final = re.compile(r"\s*+,\s*+CA\b", re.ASCII | re.IGNORECASE)
_WITH: Final = re.compile(r"\bWITH\b", re.ASCII | re.IGNORECASE)


class Words(NamedTuple):
    """The words of a move."""

    target: Span  #: target, via: where the words for the places stand; `via` is None if it is no circle.
    via: Span | None
    angle: bool  #: Whether a circle has an angle of its own, and does not end at its target.
    settings: int | None  #: Where the text after WITH begins, None if there is none.


def words_of(flat: str, statement: Statement) -> Words | None:
    """Return the words of a move, None if they are not understood."""
    word, _, after, stop = statement
    first = _PLACE.match(flat, after, stop)
    if first is None:
        return None
    via, target = None, first
    if word in ("CIRC", "SCIRC"):
        comma = _COMMA.match(flat, first.end(), stop)
        second = _PLACE.match(flat, comma.end(), stop) if comma else None
        if second is None:
            return None
        via, target = first, second
    if not _AFTER.match(flat, target.end(), stop):
        return None
    if target.end() == stop:
        return Words(target.span(1), via.span(1) if via else None, False, None)
    settings = _WITH.search(flat, target.end(), stop)
    angle = via is not None and _CIRCLE_ANGLE.match(flat, target.end(), stop) is not None
    return Words(target.span(1), via.span(1) if via else None, angle, settings.end() if settings else None)


def operands(flat: str, place: Span) -> list[Span]:
    """Return the parts of a place between its colons."""
    if flat.find(":", *place) < 0:
        return [place]
    return [part.span() for part in _OPERAND.finditer(flat, *place)]


def with_of(flat: str, statement: Statement) -> int | None:
    """Return where the text after the WITH of a spline begins, None if it has none."""
    _, _, after, stop = statement
    match = _WITH.search(flat, after, stop)
    return match.end() if match else None


#: Where the robot stands already: a move there changes nothing.
_PRESENT: Final = frozenset({"$POS_ACT", "$AXIS_ACT", "$POS_ACT_MES", "$AXIS_ACT_MES"})
#: Home positions, which KUKA keeps in $config.dat: every cell has its own, and no program goes there for accuracy.
_HOME: Final = re.compile(r"XHOME\d*")
#: More offsets than this at one place are a mistake.
_MOST_OFFSETS: Final = 20


class NamedPlace(NamedTuple):
    """A place; whether the robot ends exactly there, and whether the words are nothing but that place."""

    taught: Taught | None
    exact: bool = False
    plain: bool = False


_NOTHING: Final = NamedPlace(None)


class Finder:
    """Finds places, and notes with which tool and base they are used.

    Attributes:
        written: The places that stand in moves.
        pairs: All names of tool and base that moves have; None among them if those of some move are not known.
    """

    def __init__(self, names: Names) -> None:
        self._names = names
        self._skipped: dict[tuple[object, str], Skipped] = {}
        self._lists: set[tuple[int, str | None, tuple[str, str], bool, bool]] = set()
        self._holding = Holding()
        self._problem: str | None = None
        self._pair = ("", "")
        self.written: list[Taught] = []
        self.pairs: set[tuple[str, str] | None] = set()

    @property
    def skipped(self) -> list[Skipped]:
        """What is left as it is."""
        return list(self._skipped.values())

    def skip(self, text: Text, place: int, reason: str, key: str | None = None) -> None:
        """List what is left as it is: a name once for each reason, else what stands at a place."""
        self._skipped.setdefault(
            ((text.index, place) if key is None else key, reason), Skipped(text.index, text.line(place), reason)
        )

    def enter(
        self, routine: Routine, holding: Holding, current: dict[int, Taught | None], *, by_axes: bool, first: bool
    ) -> None:
        """Take the next move.

        Args:
            holding: The tool and the base that it has.
            current: Which value a name has here, by the identity of its variable, if the routine gave it one.
            by_axes: Whether it heeds Status and Turn.
            first: Whether the posture before it is not known.
        """
        self._routine, self._current, self._by_axes, self._first = routine, current, by_axes, first
        if holding is not self._holding:
            self._holding, self._problem = holding, holding.problem
            self._pair = (holding.tool.name if holding.tool else "", holding.base.name if holding.base else "")

    def find(self, span: Span) -> NamedPlace:
        """Return the place that words mean."""
        text = self._routine.text
        first, *others = operands(text.flat, span)
        if text.flat[first[0]] == "{":
            if others:
                self.skip(text, span[0], "the place is computed: it begins with an offset")
                return _NOTHING
            return NamedPlace(self._write(first, None), True, True)
        if len(others) > _MOST_OFFSETS:
            self.skip(text, span[0], "the place has too many offsets")
            return _NOTHING
        seconds = [self._offset(other) for other in others]
        variable = self._variable(first)
        taught = self._value(variable, first) if variable is not None else None
        if variable is None or taught is None:
            return _NOTHING
        if not others:
            return NamedPlace(self._use(taught), True, True)
        places = [second for second in seconds if second is not None and second.type in TARGET_TYPES]
        if variable.type not in TARGET_TYPES or taught.numbers.form is JOINTS or places:
            self.skip(text, span[0], "the place is computed from others")
            return _NOTHING
        self._use(taught)
        for other in others:
            if text.flat[other[0]] != "{":
                return NamedPlace(taught)
            taught = self._write(other, taught)
        return NamedPlace(taught, True)

    def _write(self, span: Span, parent: Taught | None) -> Taught:
        text = self._routine.text
        taught = Taught(text.index, span[0], "", aggregate(text, *span, offset=parent is not None), parent=parent)
        self.written.append(taught)
        return self._use(taught)

    def _offset(self, span: Span) -> Variable | None:
        """Return the name that an offset has, and note that it is one."""
        reference = REFERENCE.fullmatch(self._routine.text.flat, *span)
        variable = self._names.find(reference[1].upper(), self._routine.scopes) if reference else None
        if variable is None or reference is None:
            return None
        index = literal_index(reference[2]) if reference[2] is not None else None
        if index is not None:
            variable.element(index).offset = True
        elif not variable.offset:
            for member in (variable, *variable.listed):
                member.offset = True
        return variable

    def _variable(self, span: Span) -> Variable | None:
        """Return what a name stands for, None if it is no place that the program writes out."""
        text, scopes = self._routine.text, self._routine.scopes
        name = text.flat[span[0] : span[1]]
        plain = self._names.find(name.upper(), scopes)
        if plain is not None and not plain.shared:
            return plain
        reference = REFERENCE.fullmatch(text.flat, *span)
        key = reference[1].upper() if reference else ""
        if key in _PRESENT:
            return None
        if _HOME.fullmatch(name.upper()):
            return None
        variable = None if reference is None or reference[3] else self._names.find(key, scopes)
        if variable is None or reference is None:
            self.skip(text, span[0], f"{short(name)} is not declared in this program", name.upper())
            return None
        if variable.shared:
            self.skip(text, span[0], f"{short(name)} is in $config.dat, which other programs share", name.upper())
            return None
        if reference[2] is None:
            return variable
        index = literal_index(reference[2])
        if index is not None:
            return variable.element(index)
        # Which element it is does not matter: all of them have this tool and this base.
        use = (id(variable), self._problem, self._pair, self._by_axes, self._first)
        if use not in self._lists:
            self._lists.add(use)
            for element in variable.listed:
                for value in element.values if not element.computed else ():
                    self._use(value)
        if variable.computed or not variable.elements:
            self.skip(text, span[0], f"{short(name)} is not written out in this program", name.upper())
        return None

    def _value(self, variable: Variable, span: Span) -> Taught | None:
        """Return the value that a name has here."""
        text, name = self._routine.text, variable.name
        if variable.computed:
            self.skip(text, span[0], f"{short(name)} is computed, in line {variable.computed}", name.upper())
        elif not variable.values:
            self.skip(text, span[0], f"{short(name)} is declared without numbers", name.upper())
        elif len(variable.values) == 1:
            return variable.values[0]
        else:
            taught = self._current.get(id(variable))
            if taught is not None:
                return taught
            self.skip(
                text, span[0], f"{short(name)} has several values, and which one holds here is not known", name.upper()
            )
        return None

    def _use(self, taught: Taught) -> Taught:
        problem, pair = self._problem, self._pair
        taught.by_axes = taught.by_axes or self._by_axes
        taught.first = taught.first or self._first
        if taught.numbers.form is JOINTS:
            if not taught.used and problem is None:
                taught.tool, taught.frame = pair
        elif problem is not None:
            self.pairs.add(None)
            taught.problem = taught.problem or problem
        else:
            self.pairs.add(pair)
            if taught.used and not _same(pair, (taught.tool, taught.frame)):
                taught.problem = taught.problem or "it is used with different tools or bases"
            taught.tool, taught.frame = pair
        taught.used = True
        return taught


def _same(first: tuple[str, str], second: tuple[str, str]) -> bool:
    return (first[0].casefold(), first[1].casefold()) == (second[0].casefold(), second[1].casefold())


_KINDS: Final[dict[str, MoveKind]] = {
    "PTP": "joint",
    "SPTP": "joint",
    "LIN": "linear",
    "SLIN": "linear",
    "SPL": "linear",
    "CIRC": "circular",
    "SCIRC": "circular",
}
#: Routines that call each other are followed this far.
_DEEPEST: Final = 100


class _Pending(NamedTuple):
    """A move whose targets are known, but not yet whether they can be corrected."""

    kind: MoveKind
    target: Taught
    via: Taught | None
    routine: int
    text: Text
    statement: Statement
    target_text: Span
    via_text: Span | None
    splittable: bool
    follows: bool


def read(sources: Sequence[Source]) -> Program:
    """Read the files of one KRL program, given together.

    Raises:
        InputError: If brackets, strings, routines or data lists do not close, if a move stands outside of a routine, or
            if a number is out of all proportion.
    """
    return _Reader(sources).program()


class _Reader:
    def __init__(self, sources: Sequence[Source]) -> None:
        self._sources = tuple(sources)
        self._texts = [Text(index, source) for index, source in enumerate(sources)]
        self._outline = Outline(self._texts)
        self._frames = Frames(self._outline.names)
        self._finder = Finder(self._outline.names)
        self._moves: list[_Pending] = []
        self._left: dict[int, Holding] = {}

    def program(self) -> Program:
        """Return what the program contains."""
        text, holding = None, Holding()
        for number, routine in enumerate(self._outline.routines):
            if routine.text is not text:
                text, holding = routine.text, self._before(routine.text)
            holding = self._follow(number, routine, holding)
        targets = self._targets()
        return Program(
            "KRL",
            self._sources,
            tuple(targets),
            tuple(self._finished_moves()),
            self._frames.tools,
            self._frames.bases,
            tuple(sorted(self._finder.skipped, key=lambda skipped: (skipped.source, skipped.line))),
            dict(self._outline.unknown),
        )

    def _before(self, text: Text) -> Holding:
        later = "the %s is set only further down in the file"
        return Holding(
            Setting(problem=later % "tool" if text.index in self._outline.sets_tool else None),
            Setting(problem=later % "base" if text.index in self._outline.sets_base else None),
            False,
        )

    def _left_by(self, routine: Routine, depth: int = 0) -> Holding:
        """Return what a routine leaves set; one that calls itself leaves what it sets besides."""
        if depth > _DEEPEST:
            lost = Setting(problem="it is set in routines that call each other too deeply")
            return Holding(lost, lost)
        if id(routine) not in self._left:
            self._left[id(routine)] = holding = Holding()
            for kind, statement, _ in routine.steps:
                if kind == "set":
                    holding = holding.then(self._frames.set_by(routine.text, statement, routine.scopes))
                elif kind == "call":
                    called = self._outline.called(statement[0], routine)
                    holding = holding.then(self._left_by(called, depth + 1)) if called else holding
            self._left[id(routine)] = holding
        return self._left[id(routine)]

    def _after_call(self, name: str, routine: Routine, holding: Holding) -> Holding:
        called = self._outline.called(name, routine)
        return holding.then(self._left_by(called)) if called else holding.after_stranger(name)

    def _follow(self, number: int, routine: Routine, holding: Holding) -> Holding:
        """Read the moves of a routine, and return what holds at its end."""
        text, scopes = routine.text, routine.scopes
        current: dict[int, Taught | None] = {}
        first, known, triggered = True, False, False
        outside: Holding | None = None  # of the spline that is being read
        for kind, statement, assigned in routine.steps:
            if kind == "move":
                move, known = self._move(number, routine, statement, holding, current, first, known)
                if move is not None:
                    unsplit = triggered or outside is not None
                    self._moves.append(move._replace(splittable=False) if unsplit else move)
                    first = False
                triggered = False
            elif kind == "set":
                holding = holding.then(self._frames.set_by(text, statement, scopes))
            elif kind == "assign" and assigned is not None:
                current[id(assigned[0])] = assigned[1]
            elif kind == "trigger":
                triggered = True
            elif kind == "spline":
                outside, at = outside or holding, with_of(text.flat, statement)
                if at is not None:
                    holding = holding.then(self._frames.set_with(text, at, statement[3], scopes))
            elif kind == "end of spline":
                holding, outside = outside or holding, None
            else:
                known = False
                if kind == "call":
                    holding = self._after_call(statement[0], routine, holding)
        return outside or holding

    def _move(
        self,
        number: int,
        routine: Routine,
        statement: Statement,
        holding: Holding,
        current: dict[int, Taught | None],
        first: bool,
        known: bool,
    ) -> tuple[_Pending | None, bool]:
        """Return a move, None if its target is not known, and whether it is known where the robot is after it."""
        text = routine.text
        words = words_of(text.flat, statement)
        if words is None:
            self._finder.skip(text, statement[1], "the words of this move are not understood")
            return None, False
        if words.settings is not None:
            holding = holding.then(self._frames.set_with(text, words.settings, statement[3], routine.scopes))
        kind = _KINDS[statement[0]]
        self._finder.enter(routine, holding, current, by_axes=kind == "joint", first=first)
        via = self._finder.find(words.via) if words.via else None
        end = self._finder.find(words.target)
        if end.taught is None:
            return None, False
        splittable = end.plain and not words.angle and (via is None or via.plain)
        move = _Pending(
            kind,
            end.taught,
            via.taught if via else None,
            number,
            text,
            statement,
            words.target,
            words.via,
            splittable,
            known,
        )
        return move, end.exact and not words.angle

    def _targets(self) -> list[ProgramTarget]:
        variables = self._outline.names.variables
        taught = self._finder.written + [value for variable in variables for value in variable.values if value.used]
        for variable in variables:
            if variable.type in TARGET_TYPES and not (variable.shared or variable.computed or variable.offset):
                for value in variable.values:
                    if not value.used:
                        self._place_unused(value, variable)
                        taught.append(value)
        taught.sort(key=lambda place: (place.source, place.place))
        sound: list[Taught] = []
        for place in taught:
            reason = place.trouble()
            if reason is None:
                place.index = len(sound)
                sound.append(place)
            else:
                self._finder.skip(self._texts[place.source], place.place, reason)
        return [self._target(place) for place in sound]

    def _place_unused(self, value: Taught, variable: Variable) -> None:
        if value.numbers.form is JOINTS:
            return
        pairs = self._finder.pairs
        partner = self._frames.of_inline_form(variable.name, (variable.module, ""))
        if partner is not None and partner.tool is not None and partner.base is not None:
            value.problem = partner.problem
            value.tool, value.frame = partner.tool.name, partner.base.name
        elif len(pairs) == 1 and None not in pairs:
            value.tool, value.frame = next(pair for pair in pairs if pair is not None)
        elif pairs:
            value.problem = "no move uses it, and not all moves of the program have one tool and one base"
        else:
            value.problem = "no move uses it, so its tool and base are not known"

    def _target(self, place: Taught) -> ProgramTarget:
        numbers = place.numbers
        posture: Configuration = ANY_POSTURE
        if numbers.form is not JOINTS and place.parent is None:
            if place.by_axes or not place.used:
                posture = configuration(numbers.status, numbers.turn)
            elif place.first:
                posture = configuration(numbers.status, None)
        return ProgramTarget(
            place.source,
            self._texts[place.source].line(place.place),
            place.name,
            numbers.form,
            numbers.values,
            numbers.places,
            place.tool,
            place.frame,
            posture,
            place.parent.index if place.parent else None,
            place.parent is not None,
        )

    def _finished_moves(self) -> list[Move]:
        moves: list[Move] = []
        start_known = False
        for move in self._moves:
            if move.target.index < 0:
                start_known = False
                continue
            via = None if move.via is None or move.via.index < 0 else move.via.index
            splittable = move.splittable and move.follows and start_known and (via is None) == (move.via is None)
            _, start, _, stop = move.statement
            moves.append(
                Move(
                    move.kind,
                    move.target.index,
                    move.text.index,
                    move.text.line(start),
                    via,
                    move.routine,
                    (start, stop),
                    move.target_text if splittable or move.kind == "joint" else (0, 0),
                    move.via_text if splittable else None,
                )
            )
            start_known = True
        return moves


_NAMES: Final = ("X", "Y", "Z", "A", "B", "C")


def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split moves: their segments are lines of their own before them.

    Moves whose :attr:`Move.target_text` is ``(0, 0)`` stay whole.
    """
    edits: list[Edit] = []
    whole: list[int] = []
    for split in splits:
        move = program.moves[split.move]
        if move.target_text == (0, 0) or not split.points:
            whole.append(split.move)
            continue
        form = program.targets[move.target].form
        text = program.sources[move.source].text
        start = move.statement[0]
        between = line_end(text, move.statement[1]) + indentation(text, start)
        segments = [_segment(text, move, form, target, via) + between for target, via in split.points]
        edits.append(Edit(move.source, start, start, "".join(segments)))
        if split.last_via is not None and move.via_text is not None:
            edits.append(Edit(move.source, *move.via_text, _written(form, split.last_via)))
    return SplitEdits(edits, whole)


def _segment(text: str, move: Move, form: Form, target: Sequence[float], via: Sequence[float] | None) -> str:
    words = [(*move.target_text, _written(form, target))]
    if via is not None and move.via_text is not None:
        words.append((*move.via_text, _written(form, via)))
    return replaced(text, *move.statement, words)


def _written(form: Form, numbers: Sequence[float]) -> str:
    lengths, angles = form.decimals
    decimals = (lengths,) * 3 + (angles,) * 3
    parts = zip(_NAMES, numbers, decimals, strict=True)
    return "{" + ",".join(f"{name} {written(number, digits)}" for name, number, digits in parts) + "}"
