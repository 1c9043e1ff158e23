"""``truearm import ur-kinematics``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, print_record


def ur_kinematics(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="calibration.conf of the controller, or the ROS driver's file.")
    ],
    robot: Annotated[
        str, typer.Option("--robot", metavar="ROBOT", help="The arm's type: a library id such as ur5e, or a file.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="ROBOT.yaml", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Write what the controller of a Universal Robots arm computes with as a robot file."""
    from truearm.jobs.import_ur_kinematics import import_ur_kinematics

    imported = import_ur_kinematics(file, robot, out=out)
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)
