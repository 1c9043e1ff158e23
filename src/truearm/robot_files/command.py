"""``truearm convert``, ``export``, ``export-robodk``, ``ik``, ``robots``, ``show`` and ``import ur-kinematics``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.base.errors import InputError
from truearm.engine.command.options import (
    GravityText,
    JointsText,
    Json,
    PayloadText,
    WrenchFrameText,
    WrenchText,
    print_json,
    print_line,
    print_record,
    read_gravity,
)
from truearm.engine.command.texts import read_joints, read_seed


def convert(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    convention: Annotated[str, typer.Option(metavar="NAME", help="The kinematic convention to write it in.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Robot file to write; nothing is overwritten.")],
) -> None:
    """Write a robot in another kinematic convention, every pose the same."""
    from truearm.robot_files.convert import convert as run

    print_record(run(robot, convention, out=out))


def export(
    robot: Annotated[
        str, typer.Argument(metavar="CALIBRATED.yaml", help="A robot file, calibrated or not, a library id or a URDF.")
    ],
    format: Annotated[
        str,
        typer.Option(
            metavar="dh|mdh|hayati|urdf|json|python|ur-kinematics",
            help="A standard DH, modified DH or Hayati table (CSV), a URDF, everything as JSON, a Python file for "
            "forward and inverse kinematics that needs only NumPy, or the kinematics file of the ROS driver of "
            "Universal Robots.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Write a robot for other programs, and say what the format cannot hold."""
    from truearm.robot_files.convert import export as run

    exported = run(robot, format, out=out)
    if json:
        print_json(exported.summary())
        return
    written, *left_out = exported.lines()
    print_line(written)
    for message in left_out:
        print_line(message, err=True)


def export_robodk(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A calibrated robot, or one whose file has these targets on a tool.")
    ],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements in the canonical CSV.")],
    out: Annotated[Path, typer.Option("--out", metavar="TABLE.csv", help="File to write; nothing is overwritten.")],
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Write measurements as RoboDK's robot calibration has them: joints, measured points and tool points."""
    from truearm.robot_files.convert import export_robodk as run

    exported = run(robot, data, joints=joints, out=out)  # type: ignore[arg-type]
    if json:
        print_json(exported.summary())
    else:
        print_record(exported)


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
    from truearm.robot_files.inverse import inverse as run

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
    from truearm.robot_files.import_ur_kinematics import import_ur_kinematics

    imported = import_ur_kinematics(file, robot, out=out)
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)


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
    from truearm.robot_files.show import robots as run

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
    from truearm.engine.command.loading import load_robot
    from truearm.robot_files.show import show as run

    loaded = load_robot(robot)
    given = None if joints is None else read_joints(joints, loaded, "joints")
    described = run(loaded, joints=given, joints_are=joints_are)  # type: ignore[arg-type]
    if json:
        print_json(described.summary())
    else:
        print_record(described)
