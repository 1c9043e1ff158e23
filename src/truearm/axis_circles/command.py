"""``truearm axes``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import Json, end_on_error, print_json, print_line, print_record, progress


def axes(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements in which one joint moves at a time.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    frame: Annotated[
        str,
        typer.Option(
            metavar="instrument|robot",
            help="What the data are given in: the instrument's frame, or the robot's base frame, set up before.",
        ),
    ] = "instrument",
    json: Json = False,
) -> None:
    """Find a robot's axes from circles, and with them its frames, parameters and joint errors.

    Writes calibrated.yaml, joint-errors.yaml and axes.json into DIR.
    """
    from truearm.axis_circles.axes import axes as run

    with progress() as say:
        found = run(robot, data, out=out, frame=frame, progress=say)  # type: ignore[arg-type]
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}: calibrated.yaml, joint-errors.yaml, axes.json")
    end_on_error(found.warnings)
