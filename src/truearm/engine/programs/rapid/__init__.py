"""ABB RAPID: task modules and program files.

Sources: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001): the sections of
MoveAbsJ, MoveC, MoveJ, MoveL and their variants, the Trigg and Search instructions, Offs, RelTool and PDispOn; RAPID
Kernel (3HAC050946-001) for the rest of the syntax; application manuals for the instructions of arc and spot welding,
dispensing, painting and continuous processes, which all have the tool for their last argument. Those manuals were not
at hand: they are cited as public programs, and public code that quotes them, have their contents.

A tool that is not held by the robot, a work object that the robot holds or another unit moves, and displacements of the
program (PDispOn, PDispSet) put targets where the file does not say; such targets are left as they are.

After ConfL or ConfJ with Off the controller does not look at configuration data but takes the nearest posture, and so
are the targets read that moves only go to then. That is followed in the order of each file's text, which begins with
both on.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from truearm.engine.programs.program import (
    BYTE_ORDER_MARK,
    Language,
    MakersCalibration,
    Program,
    Source,
    with_lines_behind,
)
from truearm.engine.programs.rapid.data import MOTIONS, QUIET
from truearm.engine.programs.rapid.new import motion_program, new_program
from truearm.engine.programs.rapid.split import split_moves, with_postures_left_free
from truearm.engine.programs.rapid.syntax import listing_of
from truearm.engine.programs.rapid.targets import Finder

_MODULE: Final = re.compile(
    rf"(?:\A(?:{BYTE_ORDER_MARK})?|[\r\n])[ \t]*+MODULE[ \t]++[^\W\d]\w*+(?:\s*+\([^()]*+\))?", re.I
)


def _recognizes(text: str) -> bool:
    return _MODULE.search(text) is not None


def _read(sources: Sequence[Source]) -> Program:
    listing = listing_of(sources, frozenset(MOTIONS), QUIET)
    return with_postures_left_free(Finder(listing).program(RAPID.name))


def _commented(text: str, lines: Sequence[str]) -> str:
    head = _MODULE.search(text)
    return text if head is None else with_lines_behind(text, head.end(), [f"  ! {line}" for line in lines], "!")


#: A component of a robtarget that is not assigned. What it can begin with comes first: numbers are passed over at once.
_READS: Final = re.compile(
    r"(?=[!\"A-Z])(?:![^\n]*+|\"[^\"\n]*+\"|\b([A-Z]\w*+)(?:\s*+\{[^}\n]*+\})?+\s*+\.\s*+(?:trans|rot)\b"
    r"(?!(?:\s*+\.\s*+\w++)*+\s*+:=)(?:\s*+\.\s*+\w++)*+)",
    re.IGNORECASE,
)

RAPID: Final = Language(
    name="RAPID",
    suffixes=(".mod", ".prg", ".sys", ".modx", ".prgx", ".sysx"),
    makers=("ABB",),
    recognizes=_recognizes,
    read=_read,
    comment=_commented,
    split=split_moves,
    new=new_program,
    motion=motion_program,
    together=True,
    calibration=MakersCalibration("ABB", "Absolute Accuracy"),
    flange=("tool0",),
    base=("wobj0",),
    reads=_READS,
)
