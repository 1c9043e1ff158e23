"""``truearm distances``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity
from truearm.cli.output import Json, print_json, print_record


def distances(
    robot: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements, of whatever instrument's frame.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed."""
    from truearm.jobs.distances import distances as run

    judged = run(robot, data, payload=payload, gravity=read_gravity(gravity))
    if json:
        print_json(judged.summary())
    else:
        print_record(judged)
