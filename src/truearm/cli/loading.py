"""Options as texts: what a robot carries and how it is mounted (``--payload``, ``--gravity``), and lengths."""

from __future__ import annotations

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


def read_payload(text: str | None) -> Payload | None:
    """Return the payload that a text names, None for None."""
    from truearm.modeling.parts import Payload

    return None if text is None else Payload.of_text(text)


def read_gravity(text: str | None) -> tuple[float, float, float] | None:
    """Return the acceleration of free fall that a text names, None for None."""
    from truearm.units import as_number

    if text is None:
        return None
    numbers = [as_number(part.strip()) for part in text.split(",")]
    if len(numbers) != 3 or any(number is None for number in numbers):
        raise InputError(
            "three numbers belong here", parameter="gravity", came=text, allowed="0,0,-9.81 for a robot that stands"
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
