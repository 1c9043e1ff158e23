"""Extra moves before the linear and circular moves of a RAPID program, and its ConfL and ConfJ.

A move is split into several of the same instruction. Its target is written out in the added ones, with the
configuration data and external axes of the move's own target; an offset stays one, with other numbers. A stop point
(fine) becomes ``z1`` in the added moves, so that the robot does not stop on the way.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from truearm.engine.programs.program import (
    ANY_POSTURE,
    Edit,
    Lines,
    Move,
    Program,
    ProgramTarget,
    Split,
    SplitEdits,
    indentation,
    line_end,
    replaced,
    written,
)
from truearm.engine.programs.rapid.data import RELTOOL, ROBTARGET_TAIL
from truearm.engine.programs.rapid.syntax import arguments_of, code_of

# ConfL and ConfJ: where the controller does not look at the configuration data of targets. In small letters, and the
# word comes first: then it is found at once.
_SWITCH: Final = re.compile(r"conf(?<=\bconf)([lj])[ \t]*+\\[ \t]*+(on|off)\b")


def with_postures_left_free(program: Program) -> Program:
    """Return the program in which targets are in any posture to which moves only go while the data are not looked at.

    In the order of each file's text: before the first switch in it the data are looked at.
    """
    switches: dict[str, list[list[tuple[int, bool]]]] = {
        kind: [[] for _ in program.sources] for kind in ("straight", "joint")
    }
    for number, source in enumerate(program.sources):
        if not _SWITCH.search(source.text.lower()):
            continue
        code, lines = code_of(source.text)[0], Lines(source.text)
        for match in _SWITCH.finditer(code.lower()):
            kind = "straight" if match[1] == "l" else "joint"
            switches[kind][number].append((lines.number(match.start()), match[2] == "on"))
    if not any(places for kind in switches.values() for places in kind):
        return program
    looked: set[int] = set()
    free: set[int] = set()
    for move in program.moves:
        kind = "joint" if move.kind == "joint" else "straight"
        switched = switches[kind][move.source]
        last = bisect_right([line for line, _ in switched], move.line) - 1
        off = last >= 0 and not switched[last][1]
        (free if off else looked).update(index for index in (move.via, move.target) if index is not None)
    targets = tuple(
        replace(target, configuration=ANY_POSTURE) if index in free and index not in looked else target
        for index, target in enumerate(program.targets)
    )
    return replace(program, targets=targets)


_WORD: Final = re.compile(r"\w++")


def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    r"""Split moves.

    Moves without a known place of their statement are left whole: those with a time (``\T``), an identity for moves
    of several robots (``\ID``), ``\Conc`` or ``\Inpos``; instructions that do something at the end of the path or at
    points of it (MoveLDO, TriggL, SearchL, ArcLStart and their like); the instruction of an IF without THEN; and
    offsets from targets without a name.
    """
    codes: dict[int, str] = {}
    edits: list[Edit] = []
    whole: list[int] = []
    for split in splits:
        move = program.moves[split.move]
        if move.statement == (0, 0):
            whole.append(split.move)
            continue
        for source in (move.source, program.targets[move.target].source):
            if source not in codes:
                codes[source] = code_of(program.sources[source].text)[0]
        edits += _split_edits(program, codes, move, split)
    return SplitEdits(edits, whole)


def _split_edits(program: Program, codes: dict[int, str], move: Move, split: Split) -> list[Edit]:
    text, code = program.sources[move.source].text, codes[move.source]
    start, stop = move.statement
    word = _WORD.match(code, start)
    zone = arguments_of(code, word.end() if word else start, stop - 1).needed[-2]
    between = line_end(text, stop) + indentation(text, start)
    target = program.targets[move.target]
    added = []
    for numbers, via in split.points:
        words = [(*move.target_text, _written(program, codes, move, target, numbers))]
        if via is not None and move.via_text is not None:
            words.append((*move.via_text, _written(program, codes, move, target, via)))
        if code[slice(*zone)].lower() == "fine":
            words.append((*zone, "z1"))
        added.append(replaced(text, start, stop, words) + between)
    edits = [Edit(move.source, start, start, "".join(added))] if added else []
    if split.last_via is not None and move.via_text is not None:
        edits.append(Edit(move.source, *move.via_text, _written(program, codes, move, target, split.last_via)))
    return edits


def _written(
    program: Program, codes: dict[int, str], move: Move, target: ProgramTarget, numbers: tuple[float, ...]
) -> str:
    """Return the words for a target that has other numbers than the move's own, in the same form."""
    position = ",".join(written(value, 3) for value in numbers[:3])
    if target.parent is None:
        place = target.places[-1]
        tail = ROBTARGET_TAIL.match(codes[target.source], place[1]) if place else None
        ending = "".join(tail[0].split()) if tail else ""
        return f"[[{position}],[{','.join(written(value, 7) for value in numbers[3:])}{ending}"
    first = target.places[0]
    call = program.sources[move.source].text[move.target_text[0] : first[0] if first else None]
    turns = ""
    if target.form is RELTOOL:
        turns = "".join(f"\\R{axis}:={written(value, 4)}" for axis, value in zip("xyz", numbers[3:], strict=True))
    return f"{call}{position}{turns})"
