"""Units at the edges, SI units inside; and the mark of what comes from a virtual instrument.

A unit is written in the header of every column and beside every number that leaves the program. Nothing is
ever guessed from magnitudes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Final, Literal

from truearm.engine.base.errors import InputError, did_you_mean

# How many of the unit make one SI unit (lengths, grams and times, as divisors) or how much SI one unit is (angles,
# inch): mm to m divides by 1000, which is correctly rounded, where multiplying by 0.001 is not.
_PER_SI: Final = {"m": 1.0, "mm": 1e3, "um": 1e6, "g": 1e3, "ppm": 1e6, "ms": 1e3, "us": 1e6, "1/deg": math.pi / 180.0}
_SI_PER: Final = {
    **{"in": 0.0254, "rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3, "1": 1.0, "1/mm": 1e3},
    **{"mrad/(N m)": 1e-3, "mrad/(N m)^2": 1e-3, "mrad/(N m)^3": 1e-3, "um/N": 1e-6, "um/(m K)": 1e-6},
    **dict.fromkeys(("kg", "N", "N m", "degC", "s"), 1.0),
}

LENGTH_UNITS: Final = ("mm", "m", "um", "in")
TIME_UNITS: Final = ("s", "ms", "us")
ANGLE_UNITS: Final = ("deg", "rad")
SMALL_ANGLE_UNITS: Final = ("mrad", "rad", "deg")

#: The unit in which a quantity of this SI unit is shown and written to files.
SHOWN_AS: Final = {
    **{"m": "mm", "rad": "deg", "1": "1", "m/N": "um/N", "1/K": "um/(m K)"},
    **{"rad/(N m)": "mrad/(N m)", "rad/(N m)^2": "mrad/(N m)^2", "rad/(N m)^3": "mrad/(N m)^3"},
}


#: No length or angle that is meant is larger, nor anything else in a file [m, rad, 1].
_LARGEST: Final = 1e6
#: Lowest and highest standard deviation that is meant, of an angle [rad] and of anything else [m, 1].
_DEVIATION: Final = {True: (1e-9, 10.0), False: (1e-9, 1e3)}
#: A compliance of a large robot is small in SI units, and its cubic term smaller.
_RATE_DEVIATION: Final = (1e-24, 1.0)
_NUMBER: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def as_number(text: str) -> float | None:
    """Return the number that `text` is, None if it is none: digits, a decimal point, an exponent, nothing else."""
    return float(text) if _NUMBER.fullmatch(text) else None


def to_si(value: float, unit: str) -> float:
    """Convert one number from `unit` to SI units."""
    if unit in _PER_SI:
        return value / _PER_SI[unit]
    return value * _SI_PER[unit]


def from_si(value: float, unit: str) -> float:
    """Convert one number from SI units to `unit`."""
    if unit in _PER_SI:
        return value * _PER_SI[unit]
    return value / _SI_PER[unit]


@cache
def accepted_range(unit: str, *, deviation: bool = False) -> tuple[float, float]:
    """Return the lowest and highest number in `unit` that can be meant, as a value or as a standard deviation."""
    low, high = (-_LARGEST, _LARGEST)
    if deviation:
        low, high = _RATE_DEVIATION if "/" in unit else _DEVIATION[unit in SMALL_ANGLE_UNITS]
    return float(f"{from_si(low, unit):.9g}"), float(f"{from_si(high, unit):.9g}")


def sized_si(
    value: float,
    unit: str,
    where: str | None = None,
    *,
    parameter: str | None = None,
    came: object = None,
    deviation: bool = False,
) -> float:
    """Convert one number to metres or radians, or refuse one that is out of all proportion.

    Args:
        where, parameter: What the refusal names: a place in a file, or a parameter of a job.
        came: The number as the file has it.
        deviation: Whether it is a standard deviation, which can be too small as well.
    """
    low, high = accepted_range(unit, deviation=deviation)
    if math.isnan(value):
        raise InputError(
            "this is not a number",
            parameter=parameter,
            where=where,
            came=value if came is None else came,
            allowed=f"{low:.6g} to {high:.6g}{'' if unit == '1' else f' {unit}'}",
        )
    if low <= value <= high:
        return to_si(value, unit)
    raise InputError(
        f"the number is too {'small' if deviation and value < low else 'large'} to be plausible",
        parameter=parameter,
        where=where,
        came=value if came is None else came,
        allowed=f"{low:.6g} to {high:.6g}{'' if unit == '1' else f' {unit}'}",
        cure="Correct the number, or its unit.",
    )


def quantity_si(
    text: str, units: tuple[str, ...], parameter: str, number: str, whole: str, *, deviation: bool = False
) -> float:
    """Return a number that a text gives with its unit, such as ``50mm``, in SI units; zero needs none.

    Args:
        units: Those that it may have.
        parameter: What the refusal names.
        number, whole: A number as an example, and an example of everything that the parameter takes.
        deviation: Whether it is a standard deviation, which can be too small as well.

    Raises:
        InputError: If it is no number, or has no unit that fits.
    """
    match = re.fullmatch(r"\s*(?P<number>[^a-zA-Z]*(?:[eE][-+0-9]+)?)\s*(?P<unit>[a-zA-Z]*)\s*", text)
    value = None if match is None else as_number(match["number"].strip())
    if match is not None and value == 0.0 and not match["unit"] and not deviation:
        return 0.0
    if match is None or value is None or match["unit"] not in units:
        raise InputError(
            "a number with its unit belongs here" if value is None else "no unit that fits is given",
            parameter=parameter,
            came=text,
            allowed=" or ".join(f"{number}{unit}" for unit in units),
            cure=f"Units are never guessed: write {whole}.",
        )
    return sized_si(value, match["unit"], parameter=parameter, came=text, deviation=deviation)


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


def checked_unit(
    unit: str | None, allowed: tuple[str, ...], where: str | None = None, *, parameter: str | None = None
) -> str:
    """Return `unit` if it is one of `allowed`, else refuse it, naming a place in a file or a parameter of a job."""
    if unit in allowed:
        return unit
    # A file's unit says what its numbers are, so that no other is offered for it.
    meant = did_you_mean(unit, allowed) if unit and parameter is not None else None
    raise InputError(
        "no unit is given" if not unit else "this unit does not fit here",
        parameter=parameter,
        where=where,
        came=unit or None,
        allowed=", ".join(allowed),
        cure=" ".join(filter(None, (meant, "Units are never guessed: name it."))),
    )


# Whether something comes from a virtual instrument, and how that is said: first, in one line, everywhere alike.
#
# Data and robots carry a mark, `simulated`. Whatever holds them says by ``simulated_from`` which of the two have it.

#: What can be simulated of a result: the measurements, or the calibration of the robot.
Marked = Literal["data", "robot"]

#: Column of tables of measurements, entry of files; and what a cell says of a row that a virtual instrument read.
COLUMN: Final = "simulated"
YES: Final = "yes"
#: What every sentence begins with; texts that begin so, in comments of files, are marks.
WORD: Final = "SIMULATED:"
_WORDS: Final[Mapping[tuple[Marked, ...], str]] = {
    ("data",): "measurements of a virtual instrument, not of a robot.",
    ("robot",): "the robot's parameters come from measurements of a virtual instrument.",
    ("data", "robot"): "measurements and the robot's parameters come from a virtual instrument, not from a robot.",
}
_LINES: Final = tuple(f"{WORD} {words}" for words in _WORDS.values())
#: What programs for a robot that was calibrated so have as a comment; every language has room for it.
IN_PROGRAMS: Final = "SIMULATED: no real calibration"
#: The mark of a robot alone, as files have it in a comment.
ROBOT_LINE: Final = _LINES[1]


def parts_of(things: Iterable[object]) -> tuple[Marked, ...]:
    """Return what is simulated of some things: of each that says so itself, and of those in a sequence."""
    parts: set[Marked] = set()
    for thing in things:
        parts.update(getattr(thing, "simulated_from", ()))
        if isinstance(thing, tuple | list):
            parts.update(parts_of(part for part in thing if hasattr(part, "simulated_from")))
    return tuple(part for part in ("data", "robot") if part in parts)


def mark_lines(parts: Sequence[Marked]) -> list[str]:
    """Return the line that says what is simulated; none of what is not."""
    return [f"{WORD} {_WORDS[tuple(parts)]}"] if parts else []


def with_mark(lines: Iterable[str], parts: Sequence[Marked]) -> list[str]:
    """Return lines with the mark first, and only there."""
    return [*mark_lines(parts), *without_mark(lines)] if parts else [*lines]


def without_mark(lines: Iterable[str]) -> list[str]:
    """Return lines as they stand where the mark is already."""
    return [line for line in lines if line not in _LINES]
