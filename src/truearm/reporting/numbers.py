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


def decimals_of(deviation: float, most: int = 6) -> int:
    """Return to how many decimals a figure of this standard deviation is known: the last digit is the first doubtful.

    Two digits of a deviation count where the first is 1 or 2, one otherwise, as metrology rounds.
    """
    if not math.isfinite(deviation) or deviation <= 0.0:
        return most
    first = math.floor(math.log10(float(f"{deviation:.1e}")))
    digits = 2 if deviation / 10.0**first < 3.0 else 1
    return min(max(digits - 1 - first, 0), most)


def deserved(value: float, deviation: float | None) -> str:
    """Write a size with the digits that its standard deviation deserves; three of one whose deviation is not known."""
    if deviation is None or not math.isfinite(deviation) or deviation <= 0.0 or not math.isfinite(value):
        return significant(value)
    decimals = decimals_of(deviation)
    text = f"{value:.{decimals}f}"
    return text if float(text) else significant(value, 1)


def student_975(freedom: int) -> float:
    """Return the 97.5th percentile of Student's t (Cornish-Fisher expansion, Abramowitz and Stegun 26.7.5).

    It is off by less than 1 % from three degrees of freedom on.
    """
    z = 1.959964
    if freedom < 3:
        return {1: 12.706, 2: 4.303}.get(freedom, math.inf)
    terms = (
        (z**3 + z) / 4.0,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96.0,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384.0,
    )
    return z + math.fsum(term / float(freedom) ** power for power, term in enumerate(terms, 1))


def rounded(values: Array, digits: int) -> list[float]:
    """Return a list of numbers with so many significant digits."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, float).tolist()]


def rounded_to(values: Array, decimals: int) -> list[Any]:
    """Return a list, or a list of lists, of numbers with so many decimals."""
    made: list[Any] = (np.round(np.asarray(values, float), decimals) + 0.0).tolist()
    return made
