"""``truearm robots`` and ``truearm show``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, print_record


def robots(json: Json = False) -> None:
    """List the robots of the library."""
    from truearm.jobs.robots import robots as run

    found = run()
    if json:
        print_json(found.summary())
    else:
        print_record(found)


def show(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    json: Json = False,
) -> None:
    """Show a robot: its joints, its reach at zero, what is known about it."""
    from truearm.jobs.load_robot import load_robot
    from truearm.results.robot_description import RobotDescription

    described = RobotDescription(load_robot(robot))
    if json:
        print_json(described.summary())
    else:
        print_record(described)
