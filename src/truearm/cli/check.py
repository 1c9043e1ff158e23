"""``truearm check``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, progress


def check(
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements in the canonical CSV.")],
    robot: Annotated[
        str | None, typer.Argument(metavar="[ROBOT]", help="A library id, a robot file or a URDF.", show_default=False)
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The instrument, of 'truearm devices': its range.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Say what is wrong with measurements before they are believed.

    With ROBOT, also units, joint order and signs, limits, and readings that are far off; with --device its range.
    """
    from truearm.calibration import check as run
    from truearm.calibration import load_data

    with progress() as say:
        say("checking")
        loaded = load_data(data)
        notices = run(loaded, robot, device)
    if json:
        print_json(
            {
                "configurations": loaded.configurations,
                "targets": list(loaded.targets),
                "warnings": [{"code": n.code, "message": n.message} for n in notices],
            }
        )
        return
    typer.echo(f"{data}: {loaded.configurations} configurations, targets {', '.join(loaded.targets)}")
    for notice in notices:
        typer.echo(f"Warning ({notice.code}): {notice.message}")
    if not notices:
        typer.echo("Nothing looks wrong.")
