"""The CONFIG of FANUC positions, such as ``N U T, 0, 0, 0``.

N (no flip) is J5 below zero and F (flip) J5 above: an R-2000iB/165F has J5 = -51.975 deg in NUT and +51.975 deg in
FUT at the same place ("The perils of six-axis robots", onerobotics.com, 2013), and the current positions that
controllers save (CURPOS.DG) agree.

T (front) and B (back) is the wrist before or behind axis 1. U (up) and D (down) is the side to which the forearm
bends from the upper arm, whether the wrist is before or behind: an arm that leans back until its wrist is behind axis
1 goes from NUT to NUB, as taught positions of overhead arms have it. The branches of
:mod:`truearm.modeling.inverse.branches` change their word there, so U is `up` in T and `down` in B.

The three numbers are turns of J1, J4 and J6: 0 from -179 to 179 deg, 1 from 180 to 539, -1 from -539 to -180. Which
joints they count is a system variable ($TURN_AXIS), and J4, J5 and J6 are read of too. But in taught programs the first
is off zero where the arm points backwards, and the second is -1, which J5 cannot reach. Where a controller counts
others, no posture lies within the ranges asked for, and the target is not corrected.

All this holds for arms of six axes with a wrist in line. An L or R is not looked at.

Source: FANUC, HandlingTool operator's manual (V9.40), section 11.21.2, by a public repository's notes on it.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Final, Literal

from truearm.compensation.programs.program import Configuration

_PAIRS: Final = ("NF", "LR", "UD", "TB")
_TURN: Final = re.compile(r"[ \t]*[+-]?\d{1,2}[ \t]*", re.ASCII)


@lru_cache(maxsize=1024)
def configuration(text: str) -> Configuration | None:
    """Return what a CONFIG means, None if it cannot be read."""
    first, *turns = text.upper().split(",")
    letters = "".join(first.split())
    if any(letters.count(one) + letters.count(other) > 1 for one, other in _PAIRS):
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
