"""Which TCP holds where in a URScript file, and the names of TCPs and frames.

``set_tcp`` holds from where it stands, in the order of the text: of two in the branches of an ``if`` the last one, and
what a loop carries from its end to its start is not followed. A routine begins with what holds where it is called, and
what holds at its end holds after the call. One that nothing in the file calls begins with what was set before it in the
text.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import Final

from truearm.modeling.transform import Transform

#: A TCP whose numbers are computed.
COMPUTED: Final = "(computed)"
#: A TCP by name; None is the one of the robot's installation, which holds until the script sets one.
Tcp = str | None
#: Calls are followed down to this depth; programs that call deeper than that are no programs.
_DEEPEST: Final = 200


class Places:
    """Tools, or frames, by name: the same name with other numbers becomes another name."""

    def __init__(self) -> None:
        self._named: dict[str, dict[tuple[float, ...], str]] = {}
        self._taken: set[str] = set()
        self.transforms: dict[str, Transform] = {}

    def named(self, name: str, numbers: tuple[float, ...]) -> str:
        """Return the name of a pose ``x, y, z, rx, ry, rz`` [m, rad] that the program calls so."""
        same = self._named.setdefault(name.lower(), {})
        if numbers not in same:
            unique, count = name, len(same) + 1
            while unique.lower() in self._taken:
                unique, count = f"{name} {max(count, 2)}", count + 1
            self._taken.add(unique.lower())
            same[numbers] = unique
            x, y, z, *vector = numbers
            angle = math.hypot(*vector)
            part = math.sin(angle / 2) / angle if angle else 0.5
            rx, ry, rz = (part * v for v in vector)
            self.transforms[unique] = Transform((x, y, z), (math.cos(angle / 2), rx, ry, rz))
        return same[numbers]


class Stretch:
    """Part of a routine in which the TCP does not change; every TCP that holds there, of all calls."""

    __slots__ = ("tcps",)

    def __init__(self) -> None:
        self.tcps: set[Tcp] = set()


class TcpFlow:
    """The TCPs along the routines of a file, each of which has a number."""

    def __init__(self, starts: list[int]) -> None:
        self._starts = starts
        self._stretches = [[Stretch()] for _ in starts]
        #: What ends each stretch: a TCP that is set, or the routine that is called.
        self._events: list[list[tuple[Tcp, int | None]]] = [[] for _ in starts]
        self._set: list[tuple[int, Tcp]] = []
        self._called: set[int] = set()
        self._ends: dict[tuple[int, Tcp], Tcp] = {}

    def here(self, routine: int) -> Stretch:
        """Return the stretch of a routine that was reached in the text."""
        return self._stretches[routine][-1]

    def set(self, routine: int, place: int, tcp: Tcp) -> None:
        """Note that a routine sets the TCP."""
        self._set.append((place, tcp))
        self._event(routine, (tcp, None))

    def call(self, routine: int, other: int) -> None:
        """Note that a routine calls another one."""
        self._called.add(other)
        self._event(routine, (None, other))

    def follow(self) -> None:
        """Find the TCPs of every stretch."""
        places = [place for place, _ in self._set]
        for routine, start in enumerate(self._starts):
            if routine not in self._called:
                before = bisect_left(places, start)
                self._run(routine, self._set[before - 1][1] if before else None, 0)
        for routine, stretches in enumerate(self._stretches):
            if not stretches[0].tcps:  # routines that only call one another
                self._run(routine, None, 0)

    def _event(self, routine: int, event: tuple[Tcp, int | None]) -> None:
        self._events[routine].append(event)
        self._stretches[routine].append(Stretch())

    def _run(self, routine: int, tcp: Tcp, depth: int) -> Tcp:
        key = (routine, tcp)
        if key in self._ends:
            return self._ends[key]
        self._ends[key] = tcp  # while it runs: a routine that calls itself
        stretches = self._stretches[routine]
        stretches[0].tcps.add(tcp)
        for (new, other), stretch in zip(self._events[routine], stretches[1:], strict=True):
            if other is None:
                tcp = new
            elif depth < _DEEPEST:
                tcp = self._run(other, tcp, depth + 1)
            stretch.tcps.add(tcp)
        self._ends[key] = tcp
        return tcp
