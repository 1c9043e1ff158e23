"""``truearm robots`` and ``truearm show``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.output import Json, print_json, print_record
from truearm.jobs.texts import read_joints


def robots(
    text: Annotated[
        str | None, typer.Argument(metavar="[TEXT]", help="Words of the id or the name, such as 'IRB 1200'.")
    ] = None,
    maker: Annotated[str | None, typer.Option(metavar="NAME", help="Those of a maker.", show_default="all")] = None,
    axes: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Those with so many joints.", show_default="any number")
    ] = None,
    json: Json = False,
) -> None:
    """List the robots of the library, all or some."""
    from truearm.jobs.robots import robots as run

    found = run(text, maker=maker, axes=axes)
    if json:
        print_json(found.summary())
    else:
        print_record(found)


def show(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    joints: Annotated[
        str | None,
        typer.Option(metavar="DEG,DEG,..", help="Where the robot stands (mm if sliding): print the pose, too."),
    ] = None,
    joints_are: Annotated[
        str | None,
        typer.Option(
            metavar="controller|model",
            help="Whose joint positions they are: as the controller shows them, or the model's.",
            show_default="the controller's where the robot file says that they differ",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Show a robot: its joints, its reach at zero, what is known about it, and where it stands at joint positions."""
    from truearm.jobs.load_robot import load_robot
    from truearm.jobs.show import show as run

    loaded = load_robot(robot)
    given = None if joints is None else read_joints(joints, loaded, "joints")
    described = run(loaded, joints=given, joints_are=joints_are)  # type: ignore[arg-type]
    if json:
        print_json(described.summary())
    else:
        print_record(described)
