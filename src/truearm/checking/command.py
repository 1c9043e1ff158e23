"""``truearm check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import Json, end_on_error, print_json, print_record, progress


def check(
    robot: Annotated[
        str | None, typer.Argument(metavar="[ROBOT]", help="A library id, a robot file or a URDF.", show_default=False)
    ] = None,
    data: Annotated[
        str | None, typer.Argument(metavar="DATA.csv", help="Measurements in the canonical CSV.", show_default=False)
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The instrument, of 'truearm devices': its range.", show_default=False),
    ] = None,
    exclude: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Readings to exclude: configuration, target and reason.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Say what is wrong with measurements before they are believed.

    With ROBOT, also units, joint order and signs, limits, and readings that are far off; with --device its range.
    """
    from truearm.checking.check import check as run

    with progress() as say:
        say("checking")
        checked = run(robot, data, device=device, exclude=exclude)
    if json:
        print_json(checked.summary())
    else:
        print_record(checked)
    end_on_error(checked.warnings)
