"""The text of a mapping that is guessed: entries with what they rest on, and the units of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from truearm.measurement.readers.guessing.layouts import GON
from truearm.measurement.readers.guessing.meanings import Column

#: Where nothing in the file tells an answer.
OPEN: Final = "?"
_PLAIN: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?: [A-Za-z0-9_]+)*")
_NOT_PLAIN: Final = frozenset({"true", "false", "null"})
#: Angles beyond this are degrees: nobody turns a joint more than once about itself and a little more [rad].
_MOST_RADIANS: Final = 7.0
#: Positions beyond this are millimetres: no arm reaches that many metres or inches away.
_MOST_METRES: Final = 30.0
#: Rows from which small angles are taken for radians.
_ENOUGH: Final = 10


@dataclass(frozen=True)
class Guess:
    """One entry of a mapping, and what the guess rests on."""

    entry: str  #: The entry, such as ``joints.unit``.
    value: str  #: Its value; ``?`` where nothing tells it.
    because: str  #: What the guess rests on.


@dataclass
class MappingText:
    """The lines of a mapping as they are written, and the guesses in them."""

    lines: list[str] = field(default_factory=list)
    guesses: list[Guess] = field(default_factory=list)

    def add(self, entry: str, value: str, because: str, line: str | None = None) -> None:
        """Add an entry with its guess; `line` is how it is written, if not by its name and value alone."""
        name = entry.rpartition(".")[2]
        self.lines.append(f"{line or f'{name}: {value}'}  # guess: {because}")
        self.guesses.append(Guess(entry, value, because))


def plain(text: str) -> str:
    """Return a text as YAML takes it."""
    is_plain = _PLAIN.fullmatch(text) is not None and text.lower() not in _NOT_PLAIN
    return text if is_plain else f'"{escaped(text)}"'


def named(column: Column) -> str:
    """Return the name of a column as YAML takes it; its number stays one."""
    return column.name if column.name.isdigit() else plain(column.name)


def escaped(text: str) -> str:
    """Return a text as it stands between double quotes in YAML."""
    known = {'"': '\\"', "\\": "\\\\"}
    return "".join(known.get(c, c if c.isprintable() else f"\\U{ord(c):08x}") for c in text)


def list_of(columns: Sequence[Column]) -> str:
    """Return the names of columns as a list in YAML."""
    return f"[{', '.join(map(named, columns))}]"


def quoted(unit: str) -> str:
    """Return a unit as YAML takes it, or the question for it."""
    return f"'{OPEN}'" if unit == OPEN else unit


def unit_of(columns: Sequence[Column]) -> str | None:
    """Return the unit that the headings of all these columns name, None if they do not agree."""
    units = {column.unit for column in columns}
    return units.pop() or None if len(units) == 1 else None


def angle_unit(columns: Sequence[Column]) -> tuple[str, str]:
    """Return the unit of angles and what it rests on."""
    units = list(dict.fromkeys(column.unit for column in columns))
    of_gon = next((unit for unit in units if unit in GON), None)
    if of_gon is not None:
        return OPEN, f"the headings say {of_gon}: 400 to a turn are not read, convert them; 360 to a turn are deg"
    if any(units):
        return (units[0], "the headings") if len(units) == 1 else (OPEN, "the headings do not name one unit for all")
    if not columns:
        return OPEN, "nothing tells the unit"
    most = max((float(np.abs(column.values).max()) for column in columns if len(column.values)), default=0.0)
    if most > _MOST_RADIANS:
        return "deg", f"{most:g} is too much for radians"
    if len(columns[0].values) >= _ENOUGH:
        return "rad", f"no angle is beyond {most:.3g}"
    return OPEN, f"deg or rad: no angle is beyond {most:.3g}"


def length_unit(columns: Sequence[Column]) -> tuple[str, str]:
    """Return the unit of positions and what it rests on."""
    unit = unit_of(columns)
    if unit is not None:
        return unit, "the headings"
    units = {column.unit for column in columns if column.unit}
    if len(units) == 1:
        return units.pop(), "the headings that name one"
    if units:
        return f"'{OPEN}'", "the headings name several units, and a mapping has one for all positions"
    most = max((float(np.abs(column.values).max()) for column in columns if len(column.values)), default=0.0)
    if most > _MOST_METRES:
        return "mm", f"{most:g} is too much for metres; it may be in"
    return f"'{OPEN}'", f"m, mm or in: no coordinate is beyond {most:.3g}"
