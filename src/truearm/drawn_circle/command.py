"""``truearm import circle``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.base.errors import InputError
from truearm.engine.command.options import _named, print_record


def circle(
    scans: Annotated[list[str], typer.Option("--scan", metavar="NAME=IMAGE", help="A scanned page; repeat for each.")],
    points: Annotated[
        list[str],
        typer.Option(metavar="NAME=FILE", help="Joints, angle and height read while it was drawn; one a page."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    dpi: Annotated[
        str | None, typer.Option(metavar="N|X,Y", help="Dots per inch of the scans.", show_default="as the files say")
    ] = None,
    sigma: Annotated[
        float | None, typer.Option(metavar="MM", help="Deviation of radius and height.", show_default="not declared")
    ] = None,
) -> None:
    """Circles that the robot drew with a pencil: scanned pages and the potentiometer's readings."""
    from truearm.drawn_circle.import_circle import import_circle
    from truearm.engine.base.units import sized_si

    imported = import_circle(
        _named(scans, "scans"),
        _named(points, "points"),
        dpi=_dots(dpi),
        sigma=None if sigma is None else sized_si(sigma, "mm", parameter="sigma", deviation=True),
        out=out,
    )
    print_record(imported)


def _dots(text: str | None) -> float | tuple[float, float] | None:
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise InputError("a resolution belongs here", parameter="dpi", came=text, allowed="a number, or X,Y")
    return numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])
