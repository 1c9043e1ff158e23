"""Division of KRL moves: the same instruction once more for each piece, with its place written in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.compensation.programs.lines import indentation, line_end, replaced
from truearm.compensation.programs.numbers import written
from truearm.compensation.programs.program import Division, Edit, Form, Move, Pieces, Program

_NAMES: Final = ("X", "Y", "Z", "A", "B", "C")


def divide(program: Program, divisions: Sequence[Division]) -> Pieces:
    """Put pieces of moves into lines of their own before them.

    Moves whose :attr:`Move.target_text` is ``(0, 0)`` stay whole.
    """
    edits: list[Edit] = []
    whole: list[int] = []
    for division in divisions:
        move = program.moves[division.move]
        if move.target_text == (0, 0) or not division.points:
            whole.append(division.move)
            continue
        form = program.targets[move.target].form
        text = program.sources[move.source].text
        start = move.statement[0]
        between = line_end(text, move.statement[1]) + indentation(text, start)
        pieces = [_piece(text, move, form, target, via) + between for target, via in division.points]
        edits.append(Edit(move.source, start, start, "".join(pieces)))
        if division.last_via is not None and move.via_text is not None:
            edits.append(Edit(move.source, *move.via_text, _written(form, division.last_via)))
    return Pieces(edits, whole)


def _piece(text: str, move: Move, form: Form, target: Sequence[float], via: Sequence[float] | None) -> str:
    words = [(*move.target_text, _written(form, target))]
    if via is not None and move.via_text is not None:
        words.append((*move.via_text, _written(form, via)))
    return replaced(text, *move.statement, words)


def _written(form: Form, numbers: Sequence[float]) -> str:
    lengths, angles = form.decimals
    decimals = (lengths,) * 3 + (angles,) * 3
    parts = zip(_NAMES, numbers, decimals, strict=True)
    return "{" + ",".join(f"{name} {written(number, digits)}" for name, number, digits in parts) + "}"
