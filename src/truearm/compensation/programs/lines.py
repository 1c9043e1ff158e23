"""Numbers of lines in a text, whatever its lines end with."""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import Final

_END: Final = re.compile(r"\r\n?|\n")


class Lines:
    """The lines of a text, which end with a line feed, a carriage return or both."""

    def __init__(self, text: str) -> None:
        self._starts = [found.end() for found in _END.finditer(text)]

    def number(self, place: int) -> int:
        """Return the number of the line that a place in the text is on, from 1."""
        return bisect_right(self._starts, place) + 1
