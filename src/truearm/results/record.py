"""What every result is: figures with a short text of their own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from typing import Any, Final

from truearm.notices import Notice

#: What a `repr` may be long at most.
_LONGEST: Final = 2000


class Record(ABC):
    """A result that a person can read: its text is what the command prints, its summary what JSON holds."""

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Return the figures as JSON holds them, units in the names."""

    @abstractmethod
    def lines(self) -> list[str]:
        """Return the result in words and figures, line by line, as the command prints it."""

    def __repr__(self) -> str:
        text = "\n".join(self.lines())
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4].rstrip()}\n..."

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def notice_lines(notices: Sequence[Notice]) -> list[str]:
    """Return what to know about a result, one line each."""
    return [f"Warning ({notice.code}): {notice.message}" for notice in notices]
