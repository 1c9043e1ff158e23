"""``truearm export`` and ``truearm export-robodk``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import JointsText
from truearm.cli.output import Json, print_json, print_line, print_record


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
    from truearm.jobs.export import export as run

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
    from truearm.jobs.export_robodk import export_robodk as run

    exported = run(robot, data, joints=joints, out=out)  # type: ignore[arg-type]
    if json:
        print_json(exported.summary())
    else:
        print_record(exported)
