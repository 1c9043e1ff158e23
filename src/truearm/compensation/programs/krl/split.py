"""Split KRL moves: the same instruction once more for each segment, with its position written out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.compensation.programs.lines import indentation, line_end, replaced
from truearm.compensation.programs.numbers import written
from truearm.compensation.programs.program import Edit, Form, Move, Program, Split, SplitEdits

_NAMES: Final = ("X", "Y", "Z", "A", "B", "C")


def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split moves: their segments are lines of their own before them.

    Moves whose :attr:`Move.target_text` is ``(0, 0)`` stay whole.
    """
    edits: list[Edit] = []
    whole: list[int] = []
    for split in splits:
        move = program.moves[split.move]
        if move.target_text == (0, 0) or not split.points:
            whole.append(split.move)
            continue
        form = program.targets[move.target].form
        text = program.sources[move.source].text
        start = move.statement[0]
        between = line_end(text, move.statement[1]) + indentation(text, start)
        segments = [_segment(text, move, form, target, via) + between for target, via in split.points]
        edits.append(Edit(move.source, start, start, "".join(segments)))
        if split.last_via is not None and move.via_text is not None:
            edits.append(Edit(move.source, *move.via_text, _written(form, split.last_via)))
    return SplitEdits(edits, whole)


def _segment(text: str, move: Move, form: Form, target: Sequence[float], via: Sequence[float] | None) -> str:
    words = [(*move.target_text, _written(form, target))]
    if via is not None and move.via_text is not None:
        words.append((*move.via_text, _written(form, via)))
    return replaced(text, *move.statement, words)


def _written(form: Form, numbers: Sequence[float]) -> str:
    lengths, angles = form.decimals
    decimals = (lengths,) * 3 + (angles,) * 3
    parts = zip(_NAMES, numbers, decimals, strict=True)
    return "{" + ",".join(f"{name} {written(number, digits)}" for name, number, digits in parts) + "}"
