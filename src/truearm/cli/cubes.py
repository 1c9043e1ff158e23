"""Options about a cube and what goes to the poses in it."""

from __future__ import annotations

from typing import Annotated

import typer

Ahead = Annotated[str, typer.Option(metavar="+x|-x|+y|-y", help="Where the largest cube is searched.")]
Nearest = Annotated[float, typer.Option(metavar="MM", help="How far ahead the largest cube begins.")]
Floor = Annotated[float, typer.Option(metavar="MM", help="How high the largest cube begins.")]
TargetName = Annotated[
    str | None, typer.Option(metavar="NAME", help="What goes to the poses.", show_default="the flange")
]
TipText = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z", help="What goes to the poses, in the flange frame \\[mm].", show_default="the flange"
    ),
]
