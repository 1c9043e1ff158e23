"""What a variable of a URScript file holds where it is used.

A name is looked for in the routine, then among the global variables, then in the routines around it (script manual,
"Scoping rules"). Of several assignments the last one before the place of use holds, in the order of the text, or else
the first one.
"""

from __future__ import annotations

from bisect import bisect_left
from operator import attrgetter
from typing import Final, Literal

from truearm.compensation.programs.urscript.script import Assignment, Script, Series

_GLOBAL: Final = -1
_START: Final = attrgetter("start")


class Names:
    """The variables of a file."""

    def __init__(self, script: Script) -> None:
        self._routines = script.routines
        self._series: dict[tuple[str, int], Series] = {}
        assignments = script.assignments
        shared = {one.name for one in assignments if one.scope == "global" or (not one.routine and not one.scope)}
        for one in assignments:
            own = one.scope == "local" or (one.scope == "" and one.name not in shared)
            key = (one.name, one.routine if own else _GLOBAL)
            series = self._series.get(key)
            if series is None:
                series = self._series[key] = Series()
            series.add(one)

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
