"""Units at the edges; metres, radians, newtons and kilograms inside.

A unit is written in the header of every column and beside every number that leaves the program. Nothing is
ever guessed from magnitudes.
"""

from __future__ import annotations

import math
from typing import Final

from truearm.errors import InputError

# How many of the unit make one SI unit (lengths, as divisors) or how much SI one unit is (angles, inch):
# mm to m divides by 1000, which is correctly rounded, where multiplying by 0.001 is not.
_PER_SI: Final = {"m": 1.0, "mm": 1e3, "um": 1e6}
_SI_PER: Final = {"in": 0.0254, "rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3, "1": 1.0}

LENGTH_UNITS: Final = ("mm", "m", "um", "in")
ANGLE_UNITS: Final = ("deg", "rad")
SMALL_ANGLE_UNITS: Final = ("mrad", "rad", "deg")

#: The unit in which a quantity of this SI unit is shown and written to files.
SHOWN_AS: Final = {"m": "mm", "rad": "deg", "1": "1"}


def si_factor(unit: str) -> float:
    """Return how much SI one `unit` is, for scaling whole arrays."""
    if unit in _PER_SI:
        return 1.0 / _PER_SI[unit]
    return _SI_PER[unit]


def to_si(value: float, unit: str) -> float:
    """Convert one number from `unit` to metres or radians."""
    if unit in _PER_SI:
        return value / _PER_SI[unit]
    return value * _SI_PER[unit]


def from_si(value: float, unit: str) -> float:
    """Convert one number from metres or radians to `unit`."""
    if unit in _PER_SI:
        return value * _PER_SI[unit]
    return value / _SI_PER[unit]


def written(value: float, unit: str) -> float:
    """Return the shortest number in `unit` that reads back as exactly this SI value.

    Files written, read and written again are then identical byte for byte. Where no number in `unit` reads
    back exactly (mm to m and back is not a bijection of floats), the nearest one is returned; it is at most
    1 ulp off and stable from then on.
    """
    raw = from_si(value, unit)
    for digits in (15, 16, 17):
        candidate = float(f"{raw:.{digits}g}")
        if to_si(candidate, unit) == value:
            return candidate
    for neighbour in (math.nextafter(raw, math.inf), math.nextafter(raw, -math.inf)):
        if to_si(neighbour, unit) == value:
            return neighbour
    return raw


def checked_unit(unit: str | None, allowed: tuple[str, ...], where: str) -> str:
    """Return `unit` if it is one of `allowed`, else refuse it."""
    if unit in allowed:
        return unit
    raise InputError(
        "no unit is given" if not unit else "the unit is not one that fits here",
        where=where,
        came=unit or None,
        allowed=", ".join(allowed),
        cure="Units are never guessed: name it.",
    )
