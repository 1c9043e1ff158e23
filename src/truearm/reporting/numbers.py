"""Numbers with as many digits as mean something."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from truearm.modeling.chain import Array


def significant(value: float, digits: int = 3, decimals: int = 4) -> str:
    """Write a size that is not negative with so many significant digits, and at most so many decimals."""
    if not math.isfinite(value):
        return "–"
    smallest = 10.0**-decimals
    if value < smallest / 2:
        return "0" if value == 0 else f"< {smallest:.{decimals}f}"
    # Rounded first: 0.9996 has its first digit before the point once it is written.
    places = digits - 1 - math.floor(math.log10(float(f"{value:.{digits - 1}e}")))
    return f"{value:.{min(max(places, 0), decimals)}f}"


def rounded(values: Array, digits: int) -> list[float]:
    """Return a list of numbers with so many significant digits."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, float).tolist()]


def rounded_to(values: Array, decimals: int) -> list[Any]:
    """Return a list, or a list of lists, of numbers with so many decimals."""
    made: list[Any] = (np.round(np.asarray(values, float), decimals) + 0.0).tolist()
    return made
