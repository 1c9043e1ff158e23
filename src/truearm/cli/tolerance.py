"""``truearm tolerance``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, print_record
from truearm.jobs.texts import read_lengths


def tolerance(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A robot with joint errors, as 'axes' writes it.")],
    depth: Annotated[str, typer.Option(metavar="MM[,MM..]", help="Depth of each joint's hole, or of all.")],
    lean: Annotated[
        str | None,
        typer.Option(metavar="MM[,MM..]", help="Perpendicularity or parallelism that is allowed.", show_default=False),
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(
            metavar="MM[,MM..]", help="Radius about its place, half the drawing's diameter.", show_default=False
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Say what joint errors use of their tolerances, or what tolerances may do at the flange.

    With --lean or --position the largest flange error that they allow, else the tolerances of the robot's own errors.
    """
    from truearm.jobs.tolerance import tolerance as run

    found = run(
        robot,
        read_lengths(depth, "depth"),
        lean=None if lean is None else read_lengths(lean, "lean"),
        position=None if position is None else read_lengths(position, "position"),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
