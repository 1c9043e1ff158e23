"""What a variable of a URScript file holds where it is used.

A name is looked for in the routine, then among the global variables, then in the routines around it (script manual,
"Scoping rules"). Of several assignments the last one before the place of use holds, in the order of the text, or else
the first one.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import Final, Literal

from truearm.compensation.programs.urscript_syntax import Assignment, Numbers, Script, Value

_GLOBAL: Final = -1


@dataclass(slots=True, eq=False)
class Definition:
    """One assignment to a variable.

    Attributes
    ----------
    start, routine
        Where it stands.
    value
        What is assigned; None where elements are assigned one by one.
    series
        All assignments to the variable.
    aimed
        Whether a move goes there.
    """

    name: str
    start: int
    routine: int
    value: Value | None
    series: Series
    aimed: bool = False

    @property
    def numbers(self) -> Numbers | None:
        """Its six numbers, if that is what is assigned."""
        return self.value if isinstance(self.value, Numbers) else None


@dataclass(slots=True, eq=False)
class Series:
    """All assignments to one variable in the order of the text, and whether a move goes to one of them."""

    definitions: list[Definition] = field(default_factory=list)
    starts: list[int] = field(default_factory=list)
    last_computed: int = -1
    several: bool = False
    reached: bool = False

    def add(self, definition: Definition) -> None:
        """Add the next assignment."""
        numbers = definition.numbers
        if numbers is None:
            self.last_computed = definition.start
        if self.definitions:
            first = self.definitions[0].numbers
            self.several |= first is None or numbers is None or first.values != numbers.values
        self.definitions.append(definition)
        self.starts.append(definition.start)


class Names:
    """The variables of a file."""

    def __init__(self, script: Script) -> None:
        self._script = script
        self._series: dict[tuple[str, int], Series] = {}
        assignments = script.assignments
        shared = {one.name for one in assignments if one.scope == "global" or (not one.routine and not one.scope)}
        for one in assignments:
            own = one.scope == "local" or (one.scope == "" and one.name not in shared)
            series = self._series.setdefault((one.name, one.routine if own else _GLOBAL), Series())
            series.add(Definition(one.name, one.start, one.routine, _value(script, one), series))

    @property
    def series(self) -> list[Series]:
        """All variables."""
        return list(self._series.values())

    def find(self, name: str, routine: int, place: int) -> Definition | Literal["argument"] | None:
        """Return what a name holds in a routine at a place; ``argument`` for one that the routine is called with."""
        own = self._series.get((name, routine))
        if name in self._script.routines[routine].arguments and (own is None or own.starts[0] >= place):
            return "argument"
        series = own or self._series.get((name, _GLOBAL))
        around = self._script.routines[routine].parent
        while series is None and around is not None:
            series = self._series.get((name, around))
            around = self._script.routines[around].parent
        if series is None:
            return None
        return series.definitions[max(bisect_left(series.starts, place) - 1, 0)]


def _value(script: Script, assignment: Assignment) -> Value | None:
    return None if assignment.element else script.assigned(assignment.value)
