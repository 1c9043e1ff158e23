"""``truearm validate``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity
from truearm.cli.output import Json, end_on_error, print_json, print_record


def validate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="New measurements in the same frames.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a calibrated robot on new measurements taken in the same frames."""
    from truearm.jobs.validate import validate as run

    validation = run(robot, data, payload=payload, gravity=read_gravity(gravity))
    if json:
        print_json(validation.summary())
    else:
        print_record(validation)
    end_on_error(validation.warnings)
