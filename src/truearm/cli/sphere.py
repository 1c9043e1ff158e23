"""``truearm sphere``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity
from truearm.cli.options import command_line
from truearm.cli.output import Json, end_on_error, print_json, print_line, print_record
from truearm.jobs.texts import read_lengths


def sphere(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Usually a calibrated.yaml.")],
    data: Annotated[
        str, typer.Argument(metavar="DATA.csv", help="What the bar read: columns target, fixture, distance \\[mm].")
    ],
    taught: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Configuration at which the target was brought to the ball.",
            show_default="the centre that fits best",
        ),
    ] = None,
    tip: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where the bar is attached, in the flange frame \\[mm].",
            show_default="where the robot has the target",
        ),
    ] = None,
    payload: PayloadText = None,
    gravity: GravityText = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="PAGE.html", help="Write the error of every reading.")
    ] = None,
    json: Json = False,
) -> None:
    """Judge a robot by a ballbar between its tool and a fixed ball, before and after calibration."""
    from truearm.jobs.sphere import sphere as run

    found = run(
        robot,
        data,
        taught=taught,
        tip=None if tip is None else read_lengths(tip, "tip"),  # type: ignore[arg-type]
        payload=payload,
        gravity=read_gravity(gravity),
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        if out is not None:
            print_line(f"Written: {out}")
    end_on_error(found.warnings)
