"""What an object shows of itself where a person looks at it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

#: What a `repr` may be long at most.
_LONGEST: Final = 2000
#: How many names are listed.
_LISTED: Final = 8


def short_text(lines: Iterable[str]) -> str:
    """Return lines as one text of at most 2000 characters."""
    text = "\n".join(lines)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4].rstrip()}\n..."


def as_html(text: str) -> str:
    """Return a text as a notebook shows it."""
    return f"<pre>{escape(text)}</pre>"


def listed(names: Sequence[str]) -> str:
    """Return names separated by commas, the first ones of many."""
    if len(names) <= _LISTED:
        return ", ".join(names)
    return f"{', '.join(names[: _LISTED - 1])} and {len(names) - _LISTED + 1} more"


def counted(count: int, thing: str) -> str:
    """Return a count with the thing in the singular or the plural: ``1 reading``, ``2 readings``."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def millimetres(length: float) -> str:
    """Return a length [m] in mm with three digits, more of a long one."""
    return _three_digits(length * 1e3)


def degrees(angle: float) -> str:
    """Return an angle [rad] in deg with three digits, more of a large one."""
    return _three_digits(math.degrees(angle))


def _three_digits(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
