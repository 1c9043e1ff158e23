"""ConfL and ConfJ: where the controller does not look at the configuration data of targets."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import replace
from typing import Final

from truearm.compensation.programs.lines import Lines
from truearm.compensation.programs.program import ANY_POSTURE, Program
from truearm.compensation.programs.rapid.listing import code_of

_SWITCH: Final = re.compile(r"\bConf([LJ])[ \t]*+\\[ \t]*+(On|Off)\b", re.I)


def with_postures_left_free(program: Program) -> Program:
    """Return the program in which targets are in any posture to which moves only go while the data are not looked at.

    In the order of each file's text: before the first switch in it the data are looked at.
    """
    switches: dict[str, list[list[tuple[int, bool]]]] = {
        kind: [[] for _ in program.sources] for kind in ("straight", "joint")
    }
    for number, source in enumerate(program.sources):
        if not _SWITCH.search(source.text):
            continue
        code, lines = code_of(source.text)[0], Lines(source.text)
        for found in _SWITCH.finditer(code):
            kind = "straight" if found[1].upper() == "L" else "joint"
            switches[kind][number].append((lines.number(found.start()), found[2].lower() == "on"))
    if not any(places for kind in switches.values() for places in kind):
        return program
    looked: set[int] = set()
    free: set[int] = set()
    for move in program.moves:
        kind = "joint" if move.kind == "joint" else "straight"
        here = switches[kind][move.source]
        last = bisect_right([line for line, _ in here], move.line) - 1
        off = last >= 0 and not here[last][1]
        (free if off else looked).update(index for index in (move.via, move.target) if index is not None)
    targets = tuple(
        replace(target, configuration=ANY_POSTURE) if index in free and index not in looked else target
        for index, target in enumerate(program.targets)
    )
    return replace(program, targets=targets)
