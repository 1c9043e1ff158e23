"""``truearm validate``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, error_line, print_json


def validate(
    robot_file: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="New measurements in the same frames.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a calibrated robot on new measurements taken in the same frames."""
    from truearm.calibration import validate as run
    from truearm.reporting.summaries import errors_summary

    summary = errors_summary(run(robot_file, data, payload=read_payload(payload), gravity=read_gravity(gravity)))
    if json:
        print_json(summary)
        return
    typer.echo(f"On {summary['configurations']} configurations of {data}:")
    typer.echo(f"  {error_line(summary)}")
