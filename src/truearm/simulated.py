"""Whether something comes from a virtual instrument, and how that is said: first, in one line, everywhere alike.

Data and robots carry a mark, `simulated`. Whatever holds them says by ``simulated_from`` which of the two have it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final, Literal

#: What can be simulated of a result: the measurements, or the calibration of the robot.
Marked = Literal["data", "robot"]

#: Column of tables of measurements, entry of files; and what a cell says of a row that a virtual instrument read.
COLUMN: Final = "simulated"
YES: Final = "yes"
#: What every sentence begins with; texts that begin so, in comments of files, are marks.
WORD: Final = "SIMULATED:"
_WORDS: Final[Mapping[tuple[Marked, ...], str]] = {
    ("data",): "measurements of a virtual instrument, not of a robot.",
    ("robot",): "the robot's parameters come from measurements of a virtual instrument.",
    ("data", "robot"): "measurements and the robot's parameters come from a virtual instrument, not from a robot.",
}
_LINES: Final = tuple(f"{WORD} {words}" for words in _WORDS.values())
#: What programs for a robot that was calibrated so have as a comment; every language has room for it.
IN_PROGRAMS: Final = "SIMULATED: no real calibration"
#: The mark of a robot alone, as files have it in a comment.
ROBOT_LINE: Final = _LINES[1]


def parts_of(things: Iterable[object]) -> tuple[Marked, ...]:
    """Return what is simulated of some things: of each that says so itself, and of those in a sequence."""
    found: set[Marked] = set()
    for thing in things:
        found.update(getattr(thing, "simulated_from", ()))
        if isinstance(thing, tuple | list):
            found.update(parts_of(part for part in thing if hasattr(part, "simulated_from")))
    return tuple(part for part in ("data", "robot") if part in found)


def said_of(parts: Sequence[Marked]) -> list[str]:
    """Return the line that says what is simulated; none of what is not."""
    return [f"{WORD} {_WORDS[tuple(parts)]}"] if parts else []


def with_mark(lines: Iterable[str], parts: Sequence[Marked]) -> list[str]:
    """Return lines with the mark first, and only there."""
    return [*said_of(parts), *without_mark(lines)] if parts else [*lines]


def without_mark(lines: Iterable[str]) -> list[str]:
    """Return lines as they stand where the mark is already."""
    return [line for line in lines if line not in _LINES]
