"""Jobs of Yaskawa controllers: the sections of a job file and its table of positions."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from truearm.compensation.programs.lines import BYTE_ORDER_MARK, Lines
from truearm.compensation.programs.numbers import LARGEST, NUMBER
from truearm.compensation.programs.program import Source
from truearm.errors import InputError

JOB: Final = re.compile(rf"(?:\A(?:{BYTE_ORDER_MARK})?|[\r\n])[ \t]*/JOB[ \t]*(?=[\r\n]|\Z)")
LINE: Final = re.compile(r"[^\r\n]+")

_N: Final = rf"[ \t]*((?>{NUMBER}))[ \t]*"
_SIX: Final = re.compile(rf"[ \t]*([CP])(\d{{1,6}})[ \t]*={_N},{_N},{_N},{_N},{_N},{_N}")
_NAME: Final = re.compile(r"[ \t]*(BC|BP|EC|EX|C|P)(\d{1,6})[ \t]*=")
_ONE: Final = re.compile(_N)
_STATE: Final = re.compile(r"[ \t]*///(NPOS|TOOL|USER|POSTYPE|RCONF)(?:[ \t]+|$)")
_COUNT: Final = re.compile(r"\d{1,6}")
_POSTYPES: Final = ("PULSE", "ANGLE", "BASE", "ROBOT", "USER", "TOOL", "MTOOL")
#: No length or angle is larger [mm, deg], and no motor turns further [pulses].
_LARGEST: Final = {"PULSE": 1e9}

#: A position by the letter of its table and its number in it.
Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class State:
    """What the lines of a table of positions that begin with ``///`` say of the positions after them."""

    tool: str = "0"
    user: str = ""
    postype: str = ""
    rconf: str = ""


@dataclass(slots=True)
class Position:
    """A position of the robot in the table of a job."""

    table: str  #: table, number: ``C`` for a position of a step, ``P`` for a position variable, and its number.
    number: int
    name: str  #: As it is written.
    line: int  #: In the file, from 1.
    stop: int  #: Place after the last character of its line.
    values: tuple[float, ...]  #: values, places: its numbers, and where they stand in the text.
    places: tuple[tuple[int, int], ...]
    state: State  #: What holds for it.


@dataclass(frozen=True)
class Job:
    """A job: the places of its sections, and its positions."""

    start: int  #: start, stop: where it begins and ends in the text.
    stop: int
    instructions: int  #: Where its instructions begin.
    count: tuple[int, int]  #: Where the number of its positions is written.
    positions: tuple[Position, ...]  #: Of the robot, in the order of the text.
    carried: bool  #: Whether base axes, which carry the robot, have positions too.


def jobs_of(source: Source, lines: Lines) -> Iterator[Job]:
    """Find the jobs of a file, or refuse it."""
    starts = [found.end() for found in JOB.finditer(source.text)]
    if not starts:
        raise InputError("this is no job: it has no line /JOB", where=str(source.path))
    for start, stop in zip(starts, [*starts[1:], len(source.text)], strict=True):
        yield _job(source, lines, start, stop)


def _job(source: Source, lines: Lines, start: int, stop: int) -> Job:
    text = source.text
    state = State()
    count: tuple[int, int] | None = None
    positions: dict[Key, Position] = {}
    carried = False
    in_table = False
    for found in LINE.finditer(text, start, stop):
        begin, end = found.span()
        six = _SIX.match(text, begin, end) if in_table else None
        if six is not None and six.end() == end:
            # Nearly every line of a large job.
            places = six.regs[3:]
            values = tuple(map(float, six.groups()[2:]))
            table, number = six[1], int(six[2])
            name = table + six[2]
        else:
            line = found[0].strip(" \t")
            if line.startswith("//INST") and line[6:].strip() == "":
                break
            if line.startswith("//POS") and line[5:].strip() == "":
                in_table = True
            if not in_table or not line or line.startswith("//POS"):
                continue
            said = _STATE.match(text, begin, end)
            if said is not None:
                value = text[said.end() : end].strip(" \t")
                if said[1] == "NPOS":
                    digits = _COUNT.match(text, said.end(), end)
                    if digits is None:
                        source.refuse(lines.number(begin), "the number of positions is missing", came=line)
                    count = digits.span()
                else:
                    state = _said(source, lines.number(begin), state, said[1], value)
                continue
            if line.startswith("///"):
                continue
            named = _NAME.match(text, begin, end)
            if named is None:
                source.refuse(lines.number(begin), "this is no line of a table of positions", came=line)
            table, number, name = named[1], int(named[2]), named[1] + named[2]
            carried = carried or table in ("BC", "BP")
            if table not in ("C", "P"):
                continue
            values, places = _numbers(source, lines.number(begin), named.end(), end)
        line_number = lines.number(begin)
        if not state.postype:
            source.refuse(line_number, f"{name} stands before any ///POSTYPE", allowed=", ".join(_POSTYPES))
        if max(map(abs, values)) > _LARGEST.get(state.postype, LARGEST):
            source.refuse(line_number, f"{name} has a number out of all proportion", came=max(values, key=abs))
        if state.postype == "PULSE" and not all(value.is_integer() for value in values):
            source.refuse(line_number, f"{name} has a part of a pulse", came=values, allowed="whole pulses")
        if (table, number) in positions:
            source.refuse(line_number, f"{name} is given twice")
        positions[table, number] = Position(table, number, name, line_number, end, values, places, state)
    else:
        source.refuse(lines.number(stop), "the job is not complete: it has no line //INST")
    instructions = end
    if count is None:
        if positions:
            source.refuse(lines.number(start), "the job does not say how many positions it has", allowed="///NPOS")
        count = (instructions, instructions)
    steps = sum(table == "C" for table, _ in positions)
    if positions and int(text[slice(*count)]) != steps:
        said_count = text[slice(*count)]
        source.refuse(lines.number(count[0]), f"the job has {steps} positions C and says {said_count}")
    return Job(start, stop, instructions, count, tuple(positions.values()), carried)


def _said(source: Source, line: int, state: State, word: str, value: str) -> State:
    if word == "RCONF":
        return replace(state, rconf=value)
    if word == "POSTYPE":
        if value not in _POSTYPES:
            source.refuse(line, "there are no such positions", came=value, allowed=", ".join(_POSTYPES))
        return replace(state, postype=value)
    if _COUNT.fullmatch(value) is None:
        source.refuse(line, f"///{word} needs a number", came=value)
    number = str(int(value))
    return replace(state, tool=number) if word == "TOOL" else replace(state, user=number)


def _numbers(source: Source, line: int, start: int, stop: int) -> tuple[tuple[float, ...], tuple[tuple[int, int], ...]]:
    """Read numbers with commas between them, as many as there are."""
    values: list[float] = []
    places: list[tuple[int, int]] = []
    while True:
        one = _ONE.match(source.text, start, stop)
        if one is None:
            source.refuse(line, "a number is missing or malformed", came=source.text[start:stop])
        values.append(float(one[1]))
        places.append(one.span(1))
        start = one.end()
        if start == stop:
            return tuple(values), tuple(places)
        if source.text[start] != ",":
            source.refuse(line, "a number is missing or malformed", came=source.text[start:stop])
        start += 1
