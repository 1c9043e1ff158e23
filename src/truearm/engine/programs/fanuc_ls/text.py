"""The parts of a FANUC program in ASCII: sections, instructions, positions, and where each stands in the text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final, Literal, NamedTuple

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import BYTE_ORDER_MARK, Configuration, Form, Lines, Source
from truearm.engine.robot.transform import FIXED_XYZ_ANGLES

# The CONFIG of FANUC positions, such as ``N U T, 0, 0, 0``.
#
# N (no flip) is J5 below zero and F (flip) J5 above: an R-2000iB/165F has J5 = -51.975 deg in NUT and +51.975 deg in
# FUT at the same place ("The perils of six-axis robots", onerobotics.com, 2013), and the current positions that
# controllers save (CURPOS.DG) agree.
#
# T (front) and B (back) is the wrist before or behind axis 1. U (up) and D (down) is the side to which the forearm
# bends from the upper arm, whether the wrist is before or behind: an arm that leans back until its wrist is behind axis
# 1 goes from NUT to NUB, as taught positions of overhead arms have it. The branches of
# :mod:`truearm.engine.robot.inverse.branches` change their word there, so U is `up` in T and `down` in B.
#
# The three numbers are turns of J1, J4 and J6: 0 from -179 to 179 deg, 1 from 180 to 539, -1 from -539 to -180. Which
# joints they count is a system variable ($TURN_AXIS), and J4, J5 and J6 are read of too. But in taught programs the
# first is off zero where the arm points backwards, and the second is -1, which J5 cannot reach. Where a controller
# counts others, no posture lies within the ranges asked for, and the target is not corrected.
#
# All this holds for arms of six axes with a wrist in line. An L or R is not looked at.
#
# Source: FANUC, HandlingTool operator's manual (V9.40), section 11.21.2, by a public repository's notes on it.
_PAIRS: Final = ("NF", "LR", "UD", "TB")
_TURN: Final = re.compile(r"[ \t]*[+-]?\d{1,2}[ \t]*", re.ASCII)


@lru_cache(maxsize=1024)
def configuration(text: str) -> Configuration | None:
    """Return what a CONFIG means, None if it cannot be read."""
    first, *turns = text.upper().split(",")
    letters = "".join(first.split())
    if any(letters.count(letter) + letters.count(other) > 1 for letter, other in _PAIRS):
        return None
    if not set(letters) <= set("".join(_PAIRS)) or not all(_TURN.fullmatch(turn) for turn in turns):
        return None
    shoulder: Literal["front", "back"] | None = "front" if "T" in letters else "back" if "B" in letters else None
    elbow: Literal["up", "down"] | None = None
    if shoulder is not None and ("U" in letters or "D" in letters):
        elbow = "up" if ("U" in letters) == (shoulder == "front") else "down"
    ranges: list[tuple[int, float, float]] = []
    if "N" in letters or "F" in letters:
        ranges.append((5, -math.pi, 0.0) if "N" in letters else (5, 0.0, math.pi))
        if len(turns) == 3:
            for joint, turn in zip((1, 4, 6), map(int, turns), strict=True):
                ranges.append((joint, (2 * turn - 1) * math.pi, (2 * turn + 1) * math.pi))
    return Configuration(shoulder, elbow, ranges=tuple(sorted(ranges)), literal=bool(ranges))


POSE: Final = Form("XYZWPR", "pose", angle=math.pi / 180, orientation=FIXED_XYZ_ANGLES)
JOINTS: Final = Form("joints", "joints", angle=math.pi / 180)


_FIRST: Final = re.compile(rf"(?:{BYTE_ORDER_MARK})?\s*+/PROG\b", re.IGNORECASE)
LINE_COUNT: Final = re.compile(r"\bLINE_COUNT[ \t]*+=[ \t]*+(\d{1,9})", re.IGNORECASE)
_SECTION: Final = re.compile(r"\n/(MN|POS|END)\b", re.IGNORECASE)
_LINE: Final = re.compile(r"^[ \t]*+(?:(\d{0,9})[ \t]*+:)?(.*)$", re.MULTILINE)
_NUMBER: Final = r"([+-]?(?:\d+(?:\.\d*)?|\.\d+))"
#: Name, number, comment.
_HEAD: Final = r"[ \t\n;]*+(P\[[ \t]*+0*(\d{1,9})[ \t]*+(?::([^\n]*?))?\])\s*+\{"
#: User frame, tool, configuration.
_FRAMES: Final = r"\s*+UF\s*+:\s*+(F|\d{1,3})\s*+,\s*+UT\s*+:\s*+(F|\d{1,3})\b(?:\s*+,\s*+CONFIG\s*+:\s*+'([^'\n]*)')?"
_POSE: Final = ("X", "Y", "Z", "W", "P", "R")
_UNITS: Final = ("mm", "mm", "mm", "deg", "deg", "deg")
#: A position of motion group 1 alone, with a pose and no external axes, as controllers write it.
_PLAIN: Final = re.compile(
    rf"{_HEAD}\s*+GP1\s*+:{_FRAMES}\s*+,\s*+"
    + r"\s*+,\s*+".join(rf"{name}\s*+=[ \t]*+{_NUMBER}[ \t]*+{unit}" for name, unit in zip(_POSE, _UNITS, strict=True))
    + r"\s*+\}[ \t]*+;?",
    re.IGNORECASE,
)
#: Any position: its head, the data of all motion groups.
_POSITION: Final = re.compile(rf"{_HEAD}([^{{}}]*)\}}[ \t]*+;?", re.IGNORECASE)
_ANY_FRAMES: Final = re.compile(_FRAMES, re.IGNORECASE)
_GROUP: Final = re.compile(r"\bGP(\d)\s*+:", re.IGNORECASE)
#: A field's name, its number and its unit; no number if what stands there is none with a unit.
_FIELD: Final = re.compile(rf"\b([XYZWPR]|[JE]\d)\s*+=[ \t]*+(?:{_NUMBER}[ \t]*+(mm|deg)\b)?", re.IGNORECASE)


def recognizes(text: str) -> bool:
    """Return whether a text is a FANUC program in ASCII."""
    return _FIRST.match(text) is not None


class Statement(NamedTuple):
    """An instruction: on one line, or on several of which the first alone has a number."""

    number: tuple[int, int]  #: Where its line number stands in the text, ``(start, stop)``; empty if it has none.
    start: int  #: start, stop: from after the colon to after the last character, a semicolon if it is complete.
    stop: int


class Position(NamedTuple):
    """A position of the section /POS."""

    number: str  #: Its number, without leading zeros.
    comment: str  #: Its comment, without quotes.
    start: int  #: start, stop: where it stands.
    stop: int
    name: tuple[int, int]  #: Where its name stands, such as ``P[3:"approach"]``.
    frame: str = ""  #: frame, tool, configuration: uF, UT and CONFIG as they are written, of the first motion group.
    tool: str = ""
    configuration: str = ""
    #: names, texts, places, units: its numbers: their names, x to r or J1 to the last joint, as they are written,
    #: where, and in mm or deg.
    names: Sequence[str] = ()
    texts: Sequence[str] = ()
    places: Sequence[tuple[int, int]] = ()
    units: Sequence[str] = ()
    #: Where external axes of the first motion group are: name and number as it is written.
    external: Sequence[tuple[str, str]] = ()
    alone: bool = True  #: Whether it has no other motion group.
    fault: str = ""  #: Why its data are not complete; empty if they are.


class LsFile:
    """A FANUC program in ASCII.

    Attributes:
        text: Its text with every line end as line feeds, so that all places stay what they are.
        instructions, positions: Where the sections /MN and /POS begin and end.

    Raises:
        InputError: If a section is missing.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.text = source.text.replace("\r", "\n")
        self._lines = Lines(source.text)
        if not recognizes(self.text):
            raise InputError("there is no section /PROG", where=source.where(1), cure="Is this an LS file?")
        places: dict[str, tuple[int, int]] = {}
        wanted = ["MN", "POS", "END"]
        for match in _SECTION.finditer(self.text):
            if wanted and match[1].upper() == wanted[0]:
                places[wanted.pop(0)] = (match.start() + 1, match.end())
        if wanted:
            raise InputError(
                f"there is no section /{wanted[0]}",
                where=self.where(max(len(self.text) - 1, 0)),
                allowed="sections /PROG, /MN, /POS and /END, in this order",
                cure="Is the file complete?",
            )
        self.instructions = (places["MN"][1], places["POS"][0])
        self.positions = (places["POS"][1], places["END"][0])

    def line(self, place: int) -> int:
        """Return the number of the line that a place in the text is on, from 1."""
        return self._lines.number(place)

    def where(self, place: int) -> str:
        """Return file and line of a place, for a message."""
        return self._source.where(self.line(place))

    def statements(self) -> Iterator[Statement]:
        """Yield the instructions of /MN."""
        number, start, stop = (0, 0), -1, -1
        for match in _LINE.finditer(self.text, *self.instructions):
            digits, words = match[1], match[2].rstrip()
            if start >= 0 and digits:
                yield Statement(number, start, stop)
                start = -1
            if start < 0:
                if digits is None:
                    continue
                number, start = match.span(1), match.start(2)
            stop = match.start(2) + len(words)
            if words.endswith(";"):
                yield Statement(number, start, stop)
                start = -1
        if start >= 0:
            yield Statement(number, start, stop)

    def taught(self) -> Iterator[Position]:
        """Yield the positions of /POS; refuse what is none, and numbers that come twice."""
        seen: set[str] = set()
        place, stop = self.positions
        while position := self._position(place, stop):
            if position.number in seen:
                raise InputError(f"P[{position.number}] appears twice", where=self.where(position.start))
            seen.add(position.number)
            yield position
            place = position.stop
        tail = self.text[place:stop].lstrip(" \t\n;")
        if tail:
            raise InputError(
                "this is no complete position",
                where=self.where(stop - len(tail)),
                came=tail[:40].partition("\n")[0],
                allowed="P[number]{ data };",
            )

    def _position(self, place: int, stop: int) -> Position | None:
        plain = _PLAIN.match(self.text, place, stop)
        if plain is not None:
            _, number, comment, frame, tool, config, *texts = plain.groups("")
            spans = plain.regs
            head = (number, comment and _comment(comment), spans[1][0], plain.end(), spans[1])
            return Position(*head, frame, tool, config, _POSE, texts, spans[7:], _UNITS)
        match = _POSITION.match(self.text, place, stop)
        if match is None:
            return None
        position = Position(match[2], _comment(match[3] or ""), match.start(1), match.end(), match.span(1))
        start, end = match.span(4)
        groups = list(_GROUP.finditer(self.text, start, end))
        if groups:
            ends = [group.start() for group in groups[1:]] + [end]
            first = [(group.end(), end) for group, end in zip(groups, ends, strict=True) if group[1] == "1"]
            if len(first) != 1:
                return position._replace(fault="has two groups 1" if first else "has no data of motion group 1")
            start, end = first[0]
        frames = _ANY_FRAMES.match(self.text, start, end)
        if frames is None:
            return position._replace(fault="has no UF and UT")
        frame, tool, config = frames.groups("")
        position = position._replace(frame=frame, tool=tool, configuration=config, alone=len(groups) < 2)
        return self._with_numbers(position, start, end)

    def _with_numbers(self, position: Position, start: int, stop: int) -> Position:
        fields: dict[str, re.Match[str]] = {}
        for match in _FIELD.finditer(self.text, start, stop):
            name = match[1].upper()
            if name in fields:
                return position._replace(fault=f"has {name} twice")
            if match[2] is None:
                untaught = self.text.startswith("*", match.end())
                fault = f"is not taught: {name} is ****" if untaught else f"has a {name} without mm or deg"
                return position._replace(fault=fault)
            fields[name] = match
        joints = sum(name[0] == "J" for name in fields)
        if joints and not fields.keys().isdisjoint(_POSE):
            return position._replace(fault="has a pose and joints")
        names = tuple(f"J{i + 1}" for i in range(joints)) or _POSE
        missing = [name for name in names if name not in fields]
        if missing:
            return position._replace(fault=f"has no {missing[0]}")
        units = tuple(fields[name][3].lower() for name in names)
        if not joints and units != _UNITS:
            return position._replace(fault="is not in mm and deg")
        return position._replace(
            names=names,
            texts=[fields[name][2] for name in names],
            places=tuple(fields[name].span(2) for name in names),
            units=units,
            external=[(name, field[2]) for name, field in fields.items() if name[0] == "E"],
        )


def _comment(text: str) -> str:
    return text.strip().strip('"')
