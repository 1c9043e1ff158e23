"""``truearm path``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, JointsText, PayloadText, WrenchFrameText, WrenchText, read_gravity
from truearm.cli.options import command_line
from truearm.cli.output import Json, end_on_error, print_json, print_line, print_record
from truearm.jobs.texts import read_seed


def path(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Usually a calibrated.yaml.")],
    file: Annotated[Path, typer.Argument(metavar="PATH.yaml", help="Lines, circles and waypoints with a time law.")],
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Folder for what is written.")],
    seed: Annotated[
        str | None,
        typer.Option(
            "--seed-joints",
            metavar="DEG,DEG,..",
            help="Joint positions near which it begins (mm if sliding), of the kind that is written.",
            show_default="zeros",
        ),
    ] = None,
    payload: PayloadText = None,
    gravity: GravityText = None,
    wrench: WrenchText = None,
    wrench_frame: WrenchFrameText = None,
    programs: Annotated[
        list[str] | None,
        typer.Option(
            "--program",
            metavar="LANGUAGE",
            help="rapid, krl, fanuc-ls, urscript, inform, val3 or all; repeatable.",
            show_default=False,
        ),
    ] = None,
    targets: Annotated[str, typer.Option(metavar="joints|poses", help="Of the programs.")] = "joints",
    spacing: Annotated[float, typer.Option(metavar="S", help="Time from one target of a program to the next.")] = 0.02,
    name: Annotated[str, typer.Option(metavar="NAME", help="Of the programs.")] = "truearm_path",
    controller_kinematics: Annotated[
        str | None,
        typer.Option(
            metavar="nominal|proprietary|unknown|FILE",
            help="With what the controller turns poses into joint positions.",
            show_default="as the robot file says",
        ),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="What may speak against the calibration; repeatable.", show_default=False),
    ] = None,
    accept_correction: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH,ANGLE",
            help="How far a program may move and turn the tip from the path, for instance 95mm,3deg.",
            show_default="twice the robot's largest deviation",
        ),
    ] = None,
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Follow a path of lines, circles and waypoints, and correct it for the calibrated robot.

    Writes motion.csv, corrected.csv, loads.csv, report.html, and the corrected path as programs.
    """
    from truearm.jobs.path import path as run

    found = run(
        robot,
        file,
        seed=read_seed(robot, seed, joints),
        payload=payload,
        gravity=read_gravity(gravity),
        wrench=wrench,
        wrench_frame=wrench_frame,  # type: ignore[arg-type]
        programs=programs or [],
        targets=targets,
        spacing=spacing,
        name=name,
        controller_kinematics=controller_kinematics,
        accept=accept or [],
        accept_correction=accept_correction,
        joints=joints,  # type: ignore[arg-type]
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}: {', '.join(found.contents())}")
    end_on_error(found.warnings)
