"""What all texts of programs have: lines, whatever they end with, byte order marks, and words to be replaced."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from typing import Final

import numpy as np

#: The byte order mark of UTF-8 in a text of one character a byte.
BYTE_ORDER_MARK: Final = "\xef\xbb\xbf"
_END: Final = re.compile(r"\r\n?|\n")
_BLANK: Final = re.compile(r"[ \t]*+")


class Lines:
    """The lines of a text, which end with a line feed, a carriage return or both."""

    def __init__(self, text: str) -> None:
        characters = np.frombuffer(text.encode("latin-1", "replace"), dtype=np.uint8)
        ends = (characters == 10) | (characters == 13)
        ends[:-1] &= (characters[:-1] != 13) | (characters[1:] != 10)
        self._starts: list[int] = (np.flatnonzero(ends) + 1).tolist()

    def number(self, place: int) -> int:
        """Return the number of the line that a place in the text is on, from 1."""
        return bisect_right(self._starts, place) + 1


def without_mark(text: str) -> str:
    """Return a text with blanks in the place of a byte order mark."""
    size = len(BYTE_ORDER_MARK)
    return " " * size + text[size:] if text.startswith(BYTE_ORDER_MARK) else text


def line_end(text: str, place: int = 0) -> str:
    """Return what ends the line that a place is on, for the last line what ends the first."""
    found = _END.search(text, place) or _END.search(text)
    return found[0] if found else "\n"


def indentation(text: str, place: int) -> str:
    """Return the blanks at the start of the line that a place is on, and before the place."""
    start = max(text.rfind("\n", 0, place), text.rfind("\r", 0, place)) + 1
    blank = _BLANK.match(text, start, place)
    return blank[0] if blank else ""


def replaced(text: str, start: int, stop: int, words: Iterable[tuple[int, int, str]]) -> str:
    """Return a stretch of a text with other words, ``(start, stop, word)``, in places that do not overlap."""
    parts, place = [], start
    for begin, end, word in sorted(words, key=lambda one: one[:2]):
        if begin < place:
            raise ValueError(f"words overlap at {begin}")
        parts += [text[place:begin], word]
        place = end
    return "".join((*parts, text[place:stop]))
