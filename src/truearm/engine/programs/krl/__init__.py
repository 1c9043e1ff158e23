"""KUKA Robot Language: ``.src`` and ``.sub`` files with the ``.dat`` file of the same name, and ``$config.dat``.

Targets are places of type POS, E6POS, E3POS and FRAME and axis values of type AXIS, E6AXIS and E3AXIS, declared,
assigned, as elements of lists or written in a move; PTP, LIN, CIRC, SPTP, SLIN, SCIRC and SPL move to them. An offset
behind a colon is in the axes of the place before it. Relative moves follow the place before them and are left alone.

Sources: KUKA System Software 8.3, Operating and Programming Instructions for System Integrators, "Programming for user
group Expert" (variables, motion instructions, splines), "Status and Turn", and the inline forms; KUKA, Expert
Programming, KSS 5.2, "Motion programming" (aggregates, the geometric operator, CIRC) and "Data lists". The titles are
from memory, the manuals were not at hand: the syntax was studied in public programs, and the bits of Status and Turn
agree with points taught on real robots.

What the language leaves open is decided so:

- A place has Status and Turn only for PTP and SPTP; for moves along a path the controller ignores them and keeps the
  posture. So a place that only such moves go to gets no posture of its own, unless its move is the first of a
  routine: then Status says how the arm stands, and Turn nothing. A place that no move uses has both.
- Tool and base are followed in the order of the text. A routine begins with what the file set before it; a file that
  never sets one has the flange and the robot's own base, and before the first statement that sets one it is not known.
  A call changes them to what the called routine leaves. ``BAS(#INITMOV, 0)`` takes tool 1 and base 0, as the
  controller's bas.src does, until a routine is called that is not in the program. ``$WORLD`` and ``$ROBROOT`` are the
  robot's own base, so the robot has to stand where its world is.
- A place of a name that gets several values is the last one that the routine gave it before the move. A name that gets
  a computed value anywhere, or a new value for one component, is left alone everywhere.
- External axes may carry the robot or move the work: a position with one that is not at zero is left alone.
- Targets in ``$config.dat`` are left alone, because all programs share them; its tools and bases are used.
- A move is split only if the move before it in the text is the one before it in time, if no TRIGGER belongs to it,
  and if its place is nothing but a target. A circle with an angle of its own (CA) and the segments of a spline stay
  whole. A segment SPL counts as linear.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from truearm.engine.programs.krl.new import motion_program, new_program
from truearm.engine.programs.krl.reading import read, split_moves
from truearm.engine.programs.program import BYTE_ORDER_MARK, Language, MakersCalibration, with_lines_behind

_HEADER: Final = re.compile(
    rf"(?:{BYTE_ORDER_MARK})?\s*+(?:&ACCESS\b|(?:[;&][^\r\n]*+\s*+)*+"
    r"(?:DEFDAT\s+\$?\w|DEFFCT\s+\w|(?:GLOBAL\s+)?DEF\s+\w+\s*\([^()\r\n]*+\)[ \t]*+(?:[;\r\n]|\Z)))",
    re.ASCII | re.IGNORECASE,
)

#: The line that begins a routine or a data list: headers of the file stand before it.
_BEGINNING: Final = re.compile(
    rf"(?:\A(?:{BYTE_ORDER_MARK})?|[\r\n])[ \t]*+(?:GLOBAL[ \t]++)?(?:DEF|DEFFCT|DEFDAT)[ \t][^;\r\n]*+",
    re.ASCII | re.IGNORECASE,
)


def recognizes(text: str) -> bool:
    """Return whether a text looks like KRL: after comments and headers it begins with a routine or a data list."""
    return _HEADER.match(text) is not None


def _commented(text: str, lines: Sequence[str]) -> str:
    head = _BEGINNING.search(text)
    return text if head is None else with_lines_behind(text, head.end(), [f"; {line}" for line in lines], ";")


#: A component of a place that is not assigned.
_READS: Final = re.compile(
    r";[^\n]*+|\"[^\"\n]*+\"|(?<![\w$])([A-Z]\w*+)(?:\[[^\]\n]*+\])?+\.[XYZABC]\b(?!\s*+=(?!=))", re.IGNORECASE
)

KRL: Final = Language(
    name="KRL",
    suffixes=(".src", ".dat", ".sub"),
    makers=("KUKA",),
    recognizes=recognizes,
    read=read,
    comment=_commented,
    split=split_moves,
    new=new_program,
    motion=motion_program,
    together=True,
    companions=((".src", ".dat"), (".sub", ".dat"), (".dat", ".src")),
    calibration=MakersCalibration("KUKA", "the positionally accurate robot model ($ABS_ACCUR)"),
    flange=("0", "$nullframe"),
    base=("0", "$nullframe", "$world", "$robroot"),
    reads=_READS,
)
