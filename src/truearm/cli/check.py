"""``truearm check``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, print_record, progress


def check(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="[ROBOT] DATA.csv",
            help="A library id, a robot file or a URDF, where wanted; measurements in the canonical CSV.",
        ),
    ],
    device: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The instrument, of 'truearm devices': its range.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Say what is wrong with measurements before they are believed.

    With ROBOT, also units, joint order and signs, limits, and readings that are far off; with --device its range.
    """
    from truearm.errors import InputError
    from truearm.jobs.check import check as run

    if len(files) > 2:
        raise InputError(
            "one robot and one file of measurements at most", parameter="files", came=f"{len(files)} names"
        )
    robot, data = files if len(files) == 2 else (None, files[0])
    with progress() as say:
        say("checking")
        checked = run(robot, data, device=device)
    if json:
        print_json(checked.summary())
    else:
        print_record(checked)
