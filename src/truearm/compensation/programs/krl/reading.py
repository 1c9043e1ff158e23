"""Reading of KRL programs: follows every routine in the order of its text and puts targets and moves together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from truearm.compensation.programs.krl.aggregates import JOINTS, configuration
from truearm.compensation.programs.krl.finding import Finder
from truearm.compensation.programs.krl.holding import Frames, Holding, Setting
from truearm.compensation.programs.krl.lines import Statement, Text
from truearm.compensation.programs.krl.names import TARGET_TYPES, Taught, Variable
from truearm.compensation.programs.krl.outline import Outline, Routine
from truearm.compensation.programs.krl.places import Span, with_of, words_of
from truearm.compensation.programs.program import (
    ANY_POSTURE,
    Configuration,
    Move,
    MoveKind,
    Program,
    ProgramTarget,
    Source,
)

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
    """Reads one program."""

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
        came = False
        for move in self._moves:
            if move.target.index < 0:
                came = False
                continue
            via = None if move.via is None or move.via.index < 0 else move.via.index
            splittable = move.splittable and move.follows and came and (via is None) == (move.via is None)
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
            came = True
        return moves
