"""Where the words of a KRL move stand: the place, the auxiliary point of a circle, and what follows."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from truearm.compensation.programs.krl.lines import Statement

Span = tuple[int, int]

_OPERAND_TEXT: Final = (
    r"(?:\{[^{}\n]*+\}|\$?[A-Za-z_][\w$]*+(?:\s*+\[[^\]\n]*+\])?+(?:\s*+\.\s*+\w++(?:\[[^\]\n]*+\])?+)*+)"
)
_OPERAND: Final = re.compile(_OPERAND_TEXT, re.ASCII)
_PLACE: Final = re.compile(rf"\s*+({_OPERAND_TEXT}(?:\s*+:\s*+{_OPERAND_TEXT})*+)", re.ASCII)
_COMMA: Final = re.compile(r"\s*+,")
_AFTER: Final = re.compile(r"\s*+(?:,|\Z|C_\w|WITH\b)", re.ASCII | re.IGNORECASE)
_CIRCLE_ANGLE: Final = re.compile(r"\s*+,\s*+CA\b", re.ASCII | re.IGNORECASE)
_WITH: Final = re.compile(r"\bWITH\b", re.ASCII | re.IGNORECASE)


class Words(NamedTuple):
    """The words of a move."""

    target: Span  #: target, via: where the words for the places stand; `via` is None if it is no circle.
    via: Span | None
    angle: bool  #: Whether a circle has an angle of its own, and does not end at its target.
    settings: int | None  #: Where the text after WITH begins, None if there is none.


def words_of(flat: str, statement: Statement) -> Words | None:
    """Return the words of a move, None if they are not understood."""
    word, _, after, stop = statement
    first = _PLACE.match(flat, after, stop)
    if first is None:
        return None
    via, target = None, first
    if word in ("CIRC", "SCIRC"):
        comma = _COMMA.match(flat, first.end(), stop)
        second = _PLACE.match(flat, comma.end(), stop) if comma else None
        if second is None:
            return None
        via, target = first, second
    if not _AFTER.match(flat, target.end(), stop):
        return None
    if target.end() == stop:
        return Words(target.span(1), via.span(1) if via else None, False, None)
    settings = _WITH.search(flat, target.end(), stop)
    angle = via is not None and _CIRCLE_ANGLE.match(flat, target.end(), stop) is not None
    return Words(target.span(1), via.span(1) if via else None, angle, settings.end() if settings else None)


def operands(flat: str, place: Span) -> list[Span]:
    """Return the parts of a place between its colons."""
    if flat.find(":", *place) < 0:
        return [place]
    return [part.span() for part in _OPERAND.finditer(flat, *place)]


def with_of(flat: str, statement: Statement) -> int | None:
    """Return where the text after the WITH of a spline begins, None if it has none."""
    _, _, after, stop = statement
    found = _WITH.search(flat, after, stop)
    return found.end() if found else None
