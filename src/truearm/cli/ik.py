"""``truearm ik``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import (
    GravityText,
    JointsText,
    PayloadText,
    WrenchFrameText,
    WrenchText,
    read_gravity,
)
from truearm.cli.output import Json, print_json, print_line, print_record
from truearm.errors import InputError
from truearm.jobs.texts import read_seed


def ik(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    poses: Annotated[
        Path, typer.Argument(metavar="POSES.csv", help="Columns pose, x \\[mm], y \\[mm], z \\[mm], qw, qx, qy, qz.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="JOINTS.csv", help="File to write.")],
    branch: Annotated[
        str | None,
        typer.Option(
            metavar="LABEL|all", help="A branch, as front-up-noflip, or all.", show_default="nearest to the seed"
        ),
    ] = None,
    seed: Annotated[
        str | None,
        typer.Option(
            "--seed-joints",
            metavar="DEG,DEG,..",
            help="Joint positions to stay near to (mm if sliding), of the kind that is written.",
            show_default="zeros",
        ),
    ] = None,
    target: Annotated[
        str | None, typer.Option(metavar="NAME", help="What goes to the poses.", show_default="the flange")
    ] = None,
    frame: Annotated[
        str,
        typer.Option(
            metavar="base|world|controller",
            help="What the poses are given in: the robot's base, the world, or the base frame of its controller.",
        ),
    ] = "base",
    orientation_free: Annotated[bool, typer.Option("--position-only", help="Leave the orientation free.")] = False,
    orientation_axis: Annotated[
        bool, typer.Option("--axis-only", help="Keep the z axis alone, free to turn about it.")
    ] = False,
    payload: PayloadText = None,
    gravity: GravityText = None,
    wrench: WrenchText = None,
    wrench_frame: WrenchFrameText = None,
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Find the joint positions that bring a robot to poses, with its calibration and joint effects."""
    from truearm.jobs.inverse import inverse as run

    if orientation_free and orientation_axis:
        raise InputError(
            "only one of them can hold", parameter="orientation_free, orientation_axis", cure="Leave one out."
        )
    found = run(
        robot,
        poses,
        out=out,
        branch=branch,
        seed=read_seed(robot, seed, joints),
        target=target,
        frame=frame,  # type: ignore[arg-type]
        orientation="free" if orientation_free else "axis" if orientation_axis else "full",
        payload=payload,
        gravity=read_gravity(gravity),
        wrench=wrench,
        wrench_frame=wrench_frame,  # type: ignore[arg-type]
        joints=joints,  # type: ignore[arg-type]
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}")
    if not found.complete:
        raise typer.Exit(3)
