"""KRL as statements, its positions and axis values, and what Status and Turn say about the posture.

==== ====================================================== ===================================================
bit  of Status                                              posture
==== ====================================================== ===================================================
0    the wrist stands behind axis 1 (overhead area)         back, else front
1    axis 3 is bent to the side of its positive angles      elbow up in front and down at the back; the other
     from where the arm is stretched                        way round if the bit is not set
2    axis 5 is less than zero                               the angle itself
==== ====================================================== ===================================================

Bit i of Turn is set if axis i + 1 reads less than zero. Higher bits of Status (4: taught with an absolutely accurate
robot) say nothing about the posture. Sources: KUKA System Software 8.3, Operating and Programming Instructions for
System Integrators, "Status and Turn"; KUKA, Expert Programming, KSS 5.2, "Motion programming", where bit 2 is given by
the angle of axis 5; the same bits, as Siemens runs these arms, in SINUMERIK ONE, Programming Manual NC programming
(12/2019), "Transformations", address STAT.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from math import inf, pi, radians
from typing import Final, NamedTuple

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import LARGEST, NUMBER, Configuration, Form, Lines, Source, without_mark
from truearm.engine.robot.transform import ZYX_ANGLES

_LONE_RETURN: Final = re.compile(r"\r(?!\n)")
#: Lines that are empty, a comment or a header (``&ACCESS``), and then one that is not.
_LINE: Final = re.compile(r"(?:[ \t\r]*+(?:[;&][^\n]*+)?\n)*+[ \t\r]*+((\$?[A-Za-z_][\w$]*+)?+[^\n]*+)\n?", re.ASCII)
_CODE: Final = re.compile(r'(?:[^";\n]++|"[^"\n]*+")*+')
_STRING: Final = re.compile(r'"[^"\n]*+"')


#: A statement: its first word in capitals, where it begins, and where its first word and itself end.
Statement = tuple[str, int, int, int]


def short(name: str) -> str:
    """Return a name as it can be shown."""
    return name if len(name) <= 60 else f"{name[:57]}..."


class Text:
    """One source, read as lines.

    Attributes:
        index: Of the source.
        module: Its name without suffix, in capitals: .src and .dat of one name are one module.
        flat: Its text, every character at its place, with a newline at the end of every line.
    """

    def __init__(self, index: int, source: Source) -> None:
        self.index = index
        self._source = source
        self.module = source.path.stem.upper()
        self.flat = _LONE_RETURN.sub("\n", without_mark(source.text))
        self._lines = Lines(source.text)

    def line(self, place: int) -> int:
        """Return the number of the line that a place is on, from 1."""
        return self._lines.number(place)

    def refusal(
        self, what: str, place: int, came: str | None = None, allowed: str | None = None, cure: str | None = None
    ) -> InputError:
        """Return the error that refuses what stands at a place."""
        return InputError(what, where=self._source.where(self.line(place)), came=came, allowed=allowed, cure=cure)

    def statements(self) -> Iterator[Statement]:
        """Yield the statements that begin with a word, and refuse those that end in the middle."""
        flat = self.flat
        for line in _LINE.finditer(flat):
            start, stop = line.span(1)
            word = line[2]
            if word is None:
                continue
            if flat.find('"', start, stop) >= 0:
                stop = self._end_of_code(start, stop)
                bare = _STRING.sub("", flat[start:stop])
                closed = bare.count("{") == bare.count("}")
            else:
                comment = flat.find(";", start, stop)
                if comment >= 0:
                    stop = comment
                closed = flat.count("{", start, stop) == flat.count("}", start, stop)
            while flat[stop - 1] in " \t\r":
                stop -= 1
            if not closed:
                raise self.refusal(
                    "the curly brackets of this line do not close", start, flat[start:stop], cure="Is the file cut off?"
                )
            yield word.upper(), start, start + len(word), stop

    def _end_of_code(self, start: int, stop: int) -> int:
        code = _CODE.match(self.flat, start, stop)
        end = code.end() if code else start
        if end < stop and self.flat[end] == '"':
            raise self.refusal("a string does not close", start, self.flat[start:stop], cure="Is the file cut off?")
        return end


POSE: Final = Form("POS", "pose", angle=radians(1.0), orientation=ZYX_ANGLES)
JOINTS: Final = Form("AXIS", "joints", angle=radians(1.0))
#: An offset along the axes of a place, without a turn.
SHIFT: Final = Form("FRAME", "pose")

_POSE_NAMES: Final = ("X", "Y", "Z", "A", "B", "C")
_JOINT_NAMES: Final = ("A1", "A2", "A3", "A4", "A5", "A6")
_OTHER_NAMES: Final = frozenset({"S", "T", "E1", "E2", "E3", "E4", "E5", "E6"})
_EXTERNAL: Final = ("E1", "E2", "E3", "E4", "E5", "E6")
_TYPE: Final = re.compile(r"\s*+\w++\s*+:", re.ASCII)
_ITEM: Final = re.compile(rf"\s*+([A-Za-z_]\w*+)\s*+((?>{NUMBER}))?+([^,{{}}]*+)[,}}]", re.ASCII)
_TEXT_OF_NUMBER: Final = rf"\s++((?>{NUMBER}))\s*+"
#: A position in the usual order, with external axes at zero.
_USUAL: Final = re.compile(
    r"\{(?:\s*+\w++\s*+:)?+\s*+"
    + r",\s*+".join(name + _TEXT_OF_NUMBER for name in "XYZABC")
    + r"(?:,\s*+S\s++(\d{1,9}+)\s*+,\s*+T\s++(\d{1,9}+)\s*+)?+(?:,\s*+E[1-6]\s++[+-]?0++(?:\.0*+)?+\s*+)*+\}",
    re.ASCII | re.IGNORECASE,
)
_BITS: Final = re.compile(r"'\s*+([BH])\s*+([0-9A-F]++)\s*+'", re.ASCII | re.IGNORECASE)
_SIX: Final = range(1, 7)

Item = tuple[float | None, int, int]


class Aggregate(NamedTuple):
    """The numbers of a target, and why it cannot be corrected where `problem` says so."""

    form: Form
    values: tuple[float, ...]
    places: tuple[tuple[int, int] | None, ...]
    status: int | None = None
    turn: int | None = None
    problem: str | None = None


def aggregate(text: Text, start: int, stop: int, *, offset: bool = False) -> Aggregate:
    """Read what stands from one curly bracket to the other.

    Args:
        start, stop: From the first bracket to after the last.
        offset: Whether it is an offset, in which what is not written is zero; in a target it would keep the value that
            it has.

    Raises:
        InputError: If a number is out of all proportion.
    """
    usual = None if offset else _USUAL.match(text.flat, start, stop)
    if usual is not None and usual.end() == stop:
        *numbers, status, turn = usual.groups()
        written: tuple[float, ...] = tuple(map(float, numbers))
        if max(written) <= LARGEST and min(written) >= -LARGEST:
            spans = tuple(map(usual.span, _SIX))
            return Aggregate(POSE, written, spans, int(status) if status else None, int(turn) if turn else None)
    items, problem = _items(text, start, stop)
    form = JOINTS if "A1" in items else POSE
    names: Sequence[str] = _JOINT_NAMES if form is JOINTS else _POSE_NAMES
    if offset:
        if form is JOINTS:
            return Aggregate(form, (), (), problem="an offset of axes is not handled")
        if not any(name in items for name in "ABC"):
            form, names = SHIFT, _POSE_NAMES[:3]
    else:
        problem = problem or _missing(items, names)
    odd = next((name for name in items if name not in names and name not in _OTHER_NAMES), None)
    if odd is not None:
        problem = problem or f"{odd} is no part of a position"
    if form is not JOINTS and any(items[name][0] != 0.0 for name in _EXTERNAL if name in items):
        problem = problem or "an external axis is not at zero, and may carry the robot or move the work"
    values, places = [], []
    for name in names:
        value, begin, end = items.get(name, (0.0, 0, 0))
        if value is None:
            problem = problem or f"{name} is not a number"
            value = 0.0
        values.append(value)
        places.append((begin, end) if end else None)
    return Aggregate(form, tuple(values), tuple(places), _whole(items, "S"), _whole(items, "T"), problem)


def _items(text: Text, start: int, stop: int) -> tuple[dict[str, Item], str | None]:
    flat = text.flat
    head = _TYPE.match(flat, start + 1, stop)
    at = head.end() if head else start + 1
    items: dict[str, Item] = {}
    problem = None
    while at < stop:
        item = _ITEM.match(flat, at, stop)
        if item is None:
            return items, problem or "it is not a list of names and values"
        at = item.end()
        name = item[1].upper()
        if name in items:
            problem = problem or f"{name} appears twice"
        tail = item[3]
        if item[2] is not None and (not tail or tail.isspace()):
            value = float(item[2])
            if not abs(value) <= LARGEST:
                raise text.refusal("a number is out of all proportion", item.start(2), item[2], f"up to {LARGEST:g}")
            items[name] = value, *item.span(2)
        else:
            items[name] = _bits(tail.strip()) if name in ("S", "T") else None, *item.span(3)
    return items, problem


def _bits(written: str) -> float | None:
    """Return a whole number that is written in bits or in hexadecimal digits, None if it is not."""
    match = _BITS.fullmatch(written)
    if match is None or (match[1] in "Bb" and match[2].strip("01")) or len(match[2]) > 32:
        return None
    return float(int(match[2], 2 if match[1] in "Bb" else 16))


def _missing(items: dict[str, Item], names: Sequence[str]) -> str | None:
    missing = [name for name in names if name not in items]
    if not missing:
        return None
    return f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} not written and would stay as before"


def _whole(items: dict[str, Item], name: str) -> int | None:
    value = items[name][0] if name in items else None
    return int(value) if value is not None and value >= 0.0 and value == int(value) else None


@cache
def _posture(status: int | None, turn: int | None) -> Configuration:
    signs = () if turn is None else tuple((i + 1, -inf, 0.0) if turn >> i & 1 else (i + 1, 0.0, inf) for i in range(6))
    if status is None:
        return Configuration(ranges=signs)
    back, elbow_bit = bool(status & 1), bool(status & 2)
    wrist = (5, -pi, 0.0) if status & 4 else (5, 0.0, pi)
    return Configuration(
        shoulder="back" if back else "front", elbow="up" if elbow_bit != back else "down", ranges=(wrist, *signs)
    )


def configuration(status: int | None, turn: int | None) -> Configuration:
    """Return the posture that Status and Turn mean; None where they are not written."""
    return _posture(None if status is None else status & 7, None if turn is None else turn & 63)
