"""Division of KRL moves: the same instruction once more for each piece, with its place written in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.compensation.programs.program import Division, Edit, Form, Move, Program

_NAMES: Final = ("X", "Y", "Z", "A", "B", "C")


def divide(program: Program, divisions: Sequence[Division]) -> list[Edit]:
    """Return the edits that put a piece of a move into a line of its own before it.

    Moves whose :attr:`Move.target_text` is ``(0, 0)`` stay whole.
    """
    edits: list[Edit] = []
    for division in divisions:
        move = program.moves[division.move]
        if move.target_text == (0, 0) or not division.points:
            continue
        form = program.targets[move.target].form
        text = program.sources[move.source].text
        start = move.statement[0]
        between = _line_end(text, move.statement[1]) + _indent(text, start)
        pieces = [_piece(text, move, form, target, via) + between for target, via in division.points]
        edits.append(Edit(move.source, start, start, "".join(pieces)))
        if division.last_via is not None and move.via_text is not None:
            edits.append(Edit(move.source, *move.via_text, _written(form, division.last_via)))
    return edits


def _piece(text: str, move: Move, form: Form, target: Sequence[float], via: Sequence[float] | None) -> str:
    begin, end = move.target_text
    head = text[move.statement[0] : begin]
    if via is not None and move.via_text is not None:
        at, after = move.via_text
        head = text[move.statement[0] : at] + _written(form, via) + text[after:begin]
    return head + _written(form, target) + text[end : move.statement[1]]


def _written(form: Form, numbers: Sequence[float]) -> str:
    lengths, angles = form.decimals
    decimals = (lengths,) * 3 + (angles,) * 3
    parts = zip(_NAMES, numbers, decimals, strict=True)
    return "{" + ",".join(f"{name} {round(number, digits) + 0.0:.{digits}f}" for name, number, digits in parts) + "}"


def _indent(text: str, start: int) -> str:
    begin = max(text.rfind("\n", 0, start), text.rfind("\r", 0, start)) + 1
    before = text[begin:start]
    return before if before.isspace() else ""


def _line_end(text: str, stop: int) -> str:
    """Return the end of a line of the text, as it is after a place or else before it."""
    ends = [place for place in (text.find("\n", stop), text.find("\r", stop)) if place >= 0]
    place = min(ends) if ends else max(text.rfind("\n", 0, stop), text.rfind("\r", 0, stop))
    if place < 0:
        return "\n"
    if text[place] == "\n":
        return "\r\n" if text[place - 1 : place] == "\r" else "\n"
    return "\r\n" if text[place + 1 : place + 2] == "\n" else "\r"
