"""Yaskawa INFORM: the sections of a job, its table of positions, and the instructions that move the robot."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import radians
from typing import Final

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import BYTE_ORDER_MARK, LARGEST, NUMBER, Form, Lines, MoveKind, Source
from truearm.engine.robot.transform import FIXED_XYZ_ANGLES

PULSES: Final = Form("pulses", "pulses", decimals=(0, 0))
ANGLES: Final = Form("joint angles", "joints", angle=radians(1.0))
POSE: Final = Form("rectangular position", "pose", angle=radians(1.0), orientation=FIXED_XYZ_ANGLES)


JOB: Final = re.compile(rf"(?:\A(?:{BYTE_ORDER_MARK})?|[\r\n])[ \t]*/JOB[ \t]*(?=[\r\n]|\Z)")
LINE: Final = re.compile(r"[^\r\n]+")

_N: Final = rf"[ \t]*((?>{NUMBER}))[ \t]*"
_SIX: Final = re.compile(rf"[ \t]*([CP])(\d{{1,6}})[ \t]*={_N},{_N},{_N},{_N},{_N},{_N}")
_NAME: Final = re.compile(r"[ \t]*(BC|BP|EC|EX|C|P)(\d{1,6})[ \t]*=")
_NUMBER: Final = re.compile(_N)
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
    starts = [match.end() for match in JOB.finditer(source.text)]
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
    for match in LINE.finditer(text, start, stop):
        begin, end = match.span()
        six = _SIX.match(text, begin, end) if in_table else None
        if six is not None and six.end() == end:
            # Nearly every line of a large job.
            places = six.regs[3:]
            values = tuple(map(float, six.groups()[2:]))
            table, number = six[1], int(six[2])
            name = table + six[2]
        else:
            line = match[0].strip(" \t")
            if line.startswith("//INST") and line[6:].strip() == "":
                break
            if line.startswith("//POS") and line[5:].strip() == "":
                in_table = True
            if not in_table or not line or line.startswith("//POS"):
                continue
            state_match = _STATE.match(text, begin, end)
            if state_match is not None:
                value = text[state_match.end() : end].strip(" \t")
                if state_match[1] == "NPOS":
                    digits = _COUNT.match(text, state_match.end(), end)
                    if digits is None:
                        source.refuse(lines.number(begin), "the number of positions is missing", came=line)
                    count = digits.span()
                else:
                    state = _next_state(source, lines.number(begin), state, state_match[1], value)
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
        stated_count = text[slice(*count)]
        source.refuse(lines.number(count[0]), f"the job has {steps} positions C and says {stated_count}")
    return Job(start, stop, instructions, count, tuple(positions.values()), carried)


def _next_state(source: Source, line: int, state: State, word: str, value: str) -> State:
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
        match = _NUMBER.match(source.text, start, stop)
        if match is None:
            source.refuse(line, "a number is missing or malformed", came=source.text[start:stop])
        values.append(float(match[1]))
        places.append(match.span(1))
        start = match.end()
        if start == stop:
            return tuple(values), tuple(places)
        if source.text[start] != ",":
            source.refuse(line, "a number is missing or malformed", came=source.text[start:stop])
        start += 1


KINDS: Final[dict[str, MoveKind]] = {
    **{"MOVJ": "joint", "MOVL": "linear", "MOVC": "circular"},
    # The way of a spline, and of a move together with other axes, is not known from its positions.
    **{"MOVS": "joint", "SMOVL": "joint", "SMOVC": "joint", "SMOVS": "joint", "SMOVJ": "joint"},
}
_INCREMENTS: Final = frozenset(("IMOV", "SIMOV", "EIMOVL", "EIMOVC"))
_WORD: Final = re.compile(r"[ \t]*([A-Za-z][A-Za-z0-9_]*)")
#: Nearly every move: a position, and tags with numbers.
_PLAIN: Final = re.compile(r"[ \t]*(MOV[JLCS])[ \t]+(([CP])(\d{1,6}))(?:[ \t]+[A-Z]++=[\d.]++)*+[ \t]*+")
_TARGET: Final = re.compile(r"[ \t]+(([CP])(\d{1,6}))(?=[ \t]|\Z)")
_OTHERS: Final = re.compile(r"\+|\b(?:BC|EC|BP|EX)\d")
_USED: Final = re.compile(r"\bPX?(\d{1,6})\b")
_ANY_USED: Final = re.compile(r"\bPX?\[")
_GROUP: Final = re.compile(r"///GROUP\d+[ \t]+([^\r\n]*)")
_ROBOT: Final = re.compile(r"\bRB\d+\b")
_STRING: Final = re.compile(r'"[^"]*"?')

#: Instructions of the INFORM manuals that send the robot nowhere.
_WORDS: Final = (
    "NOP END JUMP CALL TIMER RET PAUSE ABORT CWAIT NWAIT ENWAIT MSG ADVINIT ADVSTOP PSTART PWAIT COMM LABEL "
    "IF IFTHEN IFTHENEXP ELSE ELSEIF ELSEIFEXP ENDIF ANDIF ORIF SWITCH CASE DEFAULT ENDSWITCH "
    "WHILE WHILEEXP ENDWHILE FOR NEXT UNTIL WAIT DOUT DIN PULSE AOUT GOUT GIN ARATION ARATIOF ANTOUT "
    "CLEAR INC DEC SET SETE GETE GETS ADD SUB MUL DIV CNVRT AND OR NOT XOR MFRAME SQRT SIN COS ATAN MULMAT INVMAT "
    "SETFILE GETFILE SETREG GETREG VAL2STR VAL ASC CHR MID LEN CAT GETPOS GETARG SETUALM DIALOG GETTOOL SETTOOL "
    "SPEED REFP SFTON SFTOF MSHIFT RESET PRINT "
    "ARCON ARCOF VWELD AWELD ARCSET WVON WVOF ARCCTS ARCCTE RETRY REPLAY ANTSTK "
    "HAND HSEN GUNCL SPOT STROKE STRWAIT TOOLON TOOLOF"
)
_KNOWN: Final = frozenset(_WORDS.split())

#: Stands for the instruction of a step at which a circle begins because the one before ends there.
_BEGUN: Final = "(begun)"

#: Where a move goes if a variable or another job decides it.
NOWHERE: Final[Key] = ("", 0)


@dataclass(slots=True)
class Step:
    """A move as it is written."""

    word: str
    key: Key
    start: int
    stop: int
    target_text: tuple[int, int]
    line: int
    alone: bool
    ends_arc: bool


@dataclass
class Steps:
    """The instructions of a job: its moves, None where the robot may come from elsewhere, and what they tell."""

    steps: list[Step | None] = field(default_factory=list)
    robots: int = 0
    barred: dict[Key, str] = field(default_factory=dict)
    all_variables_barred: bool = False
    unknown: Counter[str] = field(default_factory=Counter)


def steps_of(source: Source, lines: Lines, job: Job) -> Steps:
    """Read the instructions of a job, or refuse them if its end is missing."""
    text, steps = source.text, Steps()
    ended = shifted = False
    for line in LINE.finditer(text, job.instructions, job.stop):
        start, stop = line.span()
        plain = _PLAIN.match(text, start, stop)
        if plain is not None and plain.end() == stop and not shifted:
            (first, _), target_text = plain.regs[1:3]
            last = first + len(text[first:stop].rstrip(" \t"))
            key = (plain[3], int(plain[4]))
            steps.steps.append(Step(plain[1], key, first, last, target_text, lines.number(first), True, False))
            continue
        worded = _WORD.match(text, start, stop)
        if worded is None:
            if text.startswith("///GROUP", start) and (group := _GROUP.match(text, start, stop)) is not None:
                steps.robots += len(_ROBOT.findall(group[1]))
            elif text[start:stop].lstrip(" \t").startswith("*"):
                steps.steps.append(None)
            continue
        word = worded[1].upper()
        if word in KINDS:
            step = _step(text, word, worded.start(1), worded.end(), stop, lines)
            steps.steps.append(step)
            if shifted:
                steps.barred.setdefault(step.key, "is shifted by SFTON when the program runs")
        elif word in _INCREMENTS:
            steps.steps.append(None)
            by = _TARGET.match(text, worded.end(), stop)
            if by is not None:
                steps.barred[by[2], int(by[3])] = f"is the increment of {word}, not a place"
        else:
            ended = ended or word == "END"
            if word in ("SFTON", "SFTOF"):
                shifted = word == "SFTON"
            if word == "CALL":
                steps.steps.append(None)
            if word not in _KNOWN:
                steps.unknown[word] += 1
            if word != "REFP" and "P" in text[worded.end() : stop]:
                unquoted = _STRING.sub("", text[worded.end() : stop])
                for used in _USED.finditer(unquoted):
                    steps.barred.setdefault(("P", int(used[1])), f"is also used by {word}")
                steps.all_variables_barred |= _ANY_USED.search(unquoted) is not None
    if not ended:
        source.refuse(lines.number(job.stop), "the job is not complete: it has no END")
    return steps


def _step(text: str, word: str, start: int, after: int, stop: int, lines: Lines) -> Step:
    stop = start + len(text[start:stop].rstrip(" \t"))
    at = _TARGET.match(text, after, stop)
    tail = text[at.end() if at is not None else after : stop]
    return Step(
        word=word,
        key=(at[2], int(at[3])) if at is not None else NOWHERE,
        start=start,
        stop=stop,
        target_text=at.span(1) if at is not None else (start, start),
        line=lines.number(start),
        alone=_OTHERS.search(tail) is None,
        ends_arc=tail.endswith(" FPT") or " FPT " in tail,
    )


def arcs_of(steps: Sequence[Step | None]) -> Iterator[tuple[Step, ...]]:
    """Put the moves of circles together: a way to one point has one step, a circle its via and its end, a break none.

    The first MOVC of a row is reached on a line, and three make a circle. FPT ends a circle and begins the next. Rows
    of other lengths are taken apart into ways that are not known.
    """
    row: list[Step] = []
    for step in steps:
        if step is not None and step.word == "MOVC" and step.key != NOWHERE and step.alone:
            row.append(step)
            if not step.ends_arc:
                continue
            yield from _row(row)
            row = [replace(step, word=_BEGUN)]
            continue
        if row:
            yield from _row(row)
            row = []
        if step is None:
            yield ()
        elif step.word == "MOVC" or not step.alone:
            yield (replace(step, word="MOVS"),)
        else:
            yield (step,)
    if row:
        yield from _row(row)


def _row(row: list[Step]) -> Iterator[tuple[Step, ...]]:
    first, *rest = row
    if first.word != _BEGUN:
        yield (replace(first, word="MOVL"),)
    if len(rest) == 2:
        yield tuple(rest)
    else:
        yield from ((replace(step, word="MOVS"),) for step in rest)
