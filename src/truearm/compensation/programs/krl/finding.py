"""Finds what the words of a KRL move mean: a place that is written in them, one of a name, or an offset from it."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from truearm.compensation.programs.krl.aggregates import JOINTS, aggregate
from truearm.compensation.programs.krl.holding import Holding
from truearm.compensation.programs.krl.lines import Text, short
from truearm.compensation.programs.krl.names import (
    REFERENCE,
    TARGET_TYPES,
    Names,
    Taught,
    Variable,
    literal_index,
)
from truearm.compensation.programs.krl.outline import Routine
from truearm.compensation.programs.krl.places import Span, operands
from truearm.compensation.programs.program import Skipped

#: Where the robot stands already: a move there changes nothing.
_PRESENT: Final = frozenset({"$POS_ACT", "$AXIS_ACT", "$POS_ACT_MES", "$AXIS_ACT_MES"})
#: Home positions, which KUKA keeps in $config.dat: every cell has its own, and no program goes there for accuracy.
_HOME: Final = re.compile(r"XHOME\d*")
#: More offsets than this at one place are a mistake.
_MOST_OFFSETS: Final = 20


class Found(NamedTuple):
    """A place; whether the robot ends exactly there, and whether the words are nothing but that place."""

    taught: Taught | None
    exact: bool = False
    plain: bool = False


_NOTHING: Final = Found(None)


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
        self._held = Holding()
        self._problem: str | None = None
        self._pair = ("", "")
        self.written: list[Taught] = []
        self.pairs: set[tuple[str, str] | None] = set()

    @property
    def skipped(self) -> list[Skipped]:
        """What is left as it is."""
        return list(self._skipped.values())

    def skip(self, text: Text, place: int, reason: str, what: str | None = None) -> None:
        """List what is left as it is: a name once for each reason, else what stands at a place."""
        self._skipped.setdefault(
            ((text.index, place) if what is None else what, reason), Skipped(text.index, text.line(place), reason)
        )

    def enter(
        self, routine: Routine, held: Holding, current: dict[int, Taught | None], *, by_axes: bool, first: bool
    ) -> None:
        """Take the next move.

        Args:
            held: The tool and the base that it has.
            current: Which value a name has here, by the identity of its variable, if the routine gave it one.
            by_axes: Whether it heeds Status and Turn.
            first: Whether the posture before it is not known.
        """
        self._routine, self._current, self._by_axes, self._first = routine, current, by_axes, first
        if held is not self._held:
            self._held, self._problem = held, held.problem
            self._pair = (held.tool.name if held.tool else "", held.base.name if held.base else "")

    def find(self, span: Span) -> Found:
        """Return the place that words mean."""
        text = self._routine.text
        first, *others = operands(text.flat, span)
        if text.flat[first[0]] == "{":
            if others:
                self.skip(text, span[0], "the place is computed: it begins with an offset")
                return _NOTHING
            return Found(self._write(first, None), True, True)
        if len(others) > _MOST_OFFSETS:
            self.skip(text, span[0], "the place has too many offsets")
            return _NOTHING
        seconds = [self._offset(other) for other in others]
        variable = self._variable(first)
        taught = self._value(variable, first) if variable is not None else None
        if variable is None or taught is None:
            return _NOTHING
        if not others:
            return Found(self._use(taught), True, True)
        places = [second for second in seconds if second is not None and second.type in TARGET_TYPES]
        if variable.type not in TARGET_TYPES or taught.numbers.form is JOINTS or places:
            self.skip(text, span[0], "the place is computed from others")
            return _NOTHING
        self._use(taught)
        for other in others:
            if text.flat[other[0]] != "{":
                return Found(taught)
            taught = self._write(other, taught)
        return Found(taught, True)

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
            for one in (variable, *variable.listed):
                one.offset = True
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
            here = self._current.get(id(variable))
            if here is not None:
                return here
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


def _same(one: tuple[str, str], other: tuple[str, str]) -> bool:
    return (one[0].casefold(), one[1].casefold()) == (other[0].casefold(), other[1].casefold())
