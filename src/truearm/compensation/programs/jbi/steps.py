"""Yaskawa INFORM: the instructions of a job that move the robot, and what the others tell of its positions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from truearm.compensation.programs.jbi.job import LINE, Job, Key
from truearm.compensation.programs.lines import Lines
from truearm.compensation.programs.program import MoveKind, Source

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
    text, found = source.text, Steps()
    ended = shifted = False
    for line in LINE.finditer(text, job.instructions, job.stop):
        start, stop = line.span()
        plain = _PLAIN.match(text, start, stop)
        if plain is not None and plain.end() == stop and not shifted:
            (first, _), target_text = plain.regs[1:3]
            last = first + len(text[first:stop].rstrip(" \t"))
            key = (plain[3], int(plain[4]))
            found.steps.append(Step(plain[1], key, first, last, target_text, lines.number(first), True, False))
            continue
        worded = _WORD.match(text, start, stop)
        if worded is None:
            if text.startswith("///GROUP", start) and (group := _GROUP.match(text, start, stop)) is not None:
                found.robots += len(_ROBOT.findall(group[1]))
            elif text[start:stop].lstrip(" \t").startswith("*"):
                found.steps.append(None)
            continue
        word = worded[1].upper()
        if word in KINDS:
            step = _step(text, word, worded.start(1), worded.end(), stop, lines)
            found.steps.append(step)
            if shifted:
                found.barred.setdefault(step.key, "is shifted by SFTON when the program runs")
        elif word in _INCREMENTS:
            found.steps.append(None)
            by = _TARGET.match(text, worded.end(), stop)
            if by is not None:
                found.barred[by[2], int(by[3])] = f"is the increment of {word}, not a place"
        else:
            ended = ended or word == "END"
            if word in ("SFTON", "SFTOF"):
                shifted = word == "SFTON"
            if word == "CALL":
                found.steps.append(None)
            if word not in _KNOWN:
                found.unknown[word] += 1
            if word != "REFP" and "P" in text[worded.end() : stop]:
                said = _STRING.sub("", text[worded.end() : stop])
                for used in _USED.finditer(said):
                    found.barred.setdefault(("P", int(used[1])), f"is also used by {word}")
                found.all_variables_barred |= _ANY_USED.search(said) is not None
    if not ended:
        source.refuse(lines.number(job.stop), "the job is not complete: it has no END")
    return found


def _step(text: str, word: str, start: int, after: int, stop: int, lines: Lines) -> Step:
    stop = start + len(text[start:stop].rstrip(" \t"))
    at = _TARGET.match(text, after, stop)
    rest = text[at.end() if at is not None else after : stop]
    return Step(
        word=word,
        key=(at[2], int(at[3])) if at is not None else NOWHERE,
        start=start,
        stop=stop,
        target_text=at.span(1) if at is not None else (start, start),
        line=lines.number(start),
        alone=_OTHERS.search(rest) is None,
        ends_arc=rest.endswith(" FPT") or " FPT " in rest,
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
