"""Options as texts: what a robot carries and how it is mounted (``--payload``, ``--gravity``), and lengths."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.modeling.parts import Payload

PayloadText = Annotated[
    str | None,
    typer.Option(
        "--payload",
        metavar="MASS,X,Y,Z",
        help='What the flange carries, with its centre of gravity in the flange frame: "2.7kg,50mm,25mm,100mm".',
        show_default="as the robot file says",
    ),
]
GravityText = Annotated[
    str | None,
    typer.Option(
        "--gravity",
        metavar="X,Y,Z",
        help="Free fall in the robot's base frame \\[m/s^2], 0,0,9.81 for a robot that hangs.",
        show_default="as the robot file says",
    ),
]
_MASSES = ("kg", "g")
_LENGTHS = ("mm", "m")


def read_payload(text: str | None) -> Payload | None:
    """Return the payload that a text names, None for None."""
    from truearm.modeling.parts import Payload

    if text is None:
        return None
    parts = text.split(",")
    if len(parts) != 4:
        raise InputError(
            "a mass and the three coordinates of its centre of gravity belong here",
            where="--payload",
            came=text,
            allowed="2.7kg,50mm,25mm,100mm",
        )
    mass, x, y, z = (
        _quantity(part, units) for part, units in zip(parts, (_MASSES, _LENGTHS, _LENGTHS, _LENGTHS), strict=True)
    )
    if mass < 0.0:
        raise InputError("a mass cannot be negative", where="--payload", came=parts[0])
    return Payload(mass, (x, y, z))


def _quantity(text: str, units: tuple[str, ...]) -> float:
    from truearm.units import as_number, sized_si

    match = re.fullmatch(r"\s*(?P<number>[^a-zA-Z]*(?:[eE][-+0-9]+)?)\s*(?P<unit>[a-zA-Z]*)\s*", text)
    number = None if match is None else as_number(match["number"].strip())
    if match is None or number is None or match["unit"] not in units:
        raise InputError(
            "a number with its unit belongs here" if number is None else "no unit is given that fits here",
            where="--payload",
            came=text,
            allowed=" or ".join(f"{'2.7' if units is _MASSES else '50'}{unit}" for unit in units),
            cure="Units are never guessed: write 2.7kg,50mm,25mm,100mm.",
        )
    return sized_si(number, match["unit"], "--payload", came=text)


def read_gravity(text: str | None) -> tuple[float, float, float] | None:
    """Return the acceleration of free fall that a text names, None for None."""
    from truearm.units import as_number

    if text is None:
        return None
    numbers = [as_number(part.strip()) for part in text.split(",")]
    if len(numbers) != 3 or any(number is None for number in numbers):
        raise InputError(
            "three numbers belong here", where="--gravity", came=text, allowed="0,0,-9.81 for a robot that stands"
        )
    x, y, z = (float(number) for number in numbers if number is not None)
    return x, y, z


def read_lengths(text: str, where: str, count: int) -> list[float]:
    """Return `count` lengths [m] of a text in mm; one number stands for all."""
    from truearm.units import as_number, sized_si

    numbers = [as_number(part.strip()) for part in text.split(",")]
    if None in numbers or len(numbers) not in (1, count):
        raise InputError(
            "numbers separated by commas belong here", where=where, came=text, allowed=f"{count} numbers in mm"
        )
    found = [sized_si(number, "mm", where) for number in numbers if number is not None]
    return found * count if len(found) == 1 else found
