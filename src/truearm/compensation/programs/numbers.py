"""Numbers as programs write them, and new numbers in their place."""

from __future__ import annotations

import re
from typing import Final

#: A number in a program.
NUMBER: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
#: Neither millimetres nor degrees are ever as many.
LARGEST: Final = 1e6
_PARTS: Final = re.compile(r"[+-]?\d*\.?(\d*)(?:[eE]([+-]?\d+))?")
#: A number has more decimals only by mistake, and no float carries them.
_MOST: Final = 15


def decimals_of(text: str) -> int:
    """Return how many decimals a number is written with; ``1.5e-3`` has four."""
    if "e" not in text and "E" not in text:
        return min(len(text.partition(".")[2]), _MOST)
    found = _PARTS.fullmatch(text)
    if found is None:
        raise ValueError(f"{text!r} is no number")
    return int(min(max(len(found[1]) - float(found[2] or 0), 0), _MOST))  # an exponent may have 5000 digits


def rewritten(text: str, value: float, fewest: int) -> str:
    """Return the text of a number with another value, or the text as it is if its value is the same.

    Args:
        text: The number as it stands in the program.
        value: The new value, in the same unit.
        fewest: How many decimals it gets at least. It keeps those that it has.

    Note:
        Two values are the same if they agree when written with that many decimals, or to a hundredth of the last of
        `fewest`: what is smaller is the rounding of the arithmetic behind it.
    """
    old = float(text)
    if abs(value - old) < 0.01 * 10.0**-fewest:
        return text
    decimals = max(decimals_of(text), fewest)
    new = written(value, decimals)
    return text if float(new) == round(old, decimals) else new


def written(value: float, decimals: int) -> str:
    """Return the text of a number with so many decimals; zero has no sign."""
    text = f"{value:.{decimals}f}"
    return text if float(text) else text.lstrip("-")
