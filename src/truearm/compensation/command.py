"""``truearm path``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import (
    GravityText,
    JointsText,
    Json,
    NoteTexts,
    PayloadText,
    WrenchFrameText,
    WrenchText,
    command_line,
    end_on_error,
    print_json,
    print_line,
    print_record,
    progress,
    read_gravity,
    read_notes,
)
from truearm.engine.command.texts import read_seed

# ``truearm compensate``.


def compensate(
    robot: Annotated[str, typer.Argument(metavar="CALIBRATED.yaml", help="The robot that calibrate wrote.")],
    programs: Annotated[
        list[Path],
        typer.Argument(metavar="PROGRAM...", help="RAPID, KRL, FANUC LS, URScript, Yaskawa JBI or VAL3 files."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the corrected programs.")],
    tools: Annotated[
        Path | None,
        typer.Option(
            "--tool", metavar="FILE", help="Where the tools really are on the flange.", show_default="best with nominal"
        ),
    ] = None,
    frames: Annotated[
        Path | None,
        typer.Option(
            "--frame", metavar="FILE", help="Where the program's frames really are.", show_default="no shift on average"
        ),
    ] = None,
    payload: PayloadText = None,
    wrench: Annotated[
        str | None,
        typer.Option(
            metavar="FX,FY,FZ,MX,MY,MZ|FILE",
            help="What acts on the tool at every target besides weight, a force \\[N] at its point and a moment "
            "\\[N m]; or a file that says it of targets and tools by name.",
            show_default="nothing",
        ),
    ] = None,
    wrench_frame: WrenchFrameText = None,
    controller_kinematics: Annotated[
        str | None,
        typer.Option(
            metavar="nominal|proprietary|FILE",
            help="What the controller computes poses with: the robot file's table, a calibration of its maker that "
            "nobody can read, or a kinematics file (calibration.conf).",
            show_default="asked",
        ),
    ] = None,
    split: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Split straight and circular moves where the correction in between would deviate farther.",
            show_default=False,
        ),
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Correct the originals of programs corrected before, anew.")
    ] = False,
    joint_targets: Annotated[
        str, typer.Option(metavar="keep|correct", help="What becomes of targets that are given by joints.")
    ] = "keep",
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Correct only targets of this name or pattern; repeatable.", show_default=False
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Targets of this name or pattern stay; repeatable.", show_default=False),
    ] = None,
    taught: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What was taught with this robot, and is right already: points, frames, tools, or none.",
            show_default="asked",
        ),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Accept what speaks against the calibration, as rank-loss, or against a program: skipped, "
            "not-better-here, maker; repeatable.",
            show_default=False,
        ),
    ] = None,
    accept_correction: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH,ANGLE",
            help="How far targets may be moved and turned, for instance 95mm,3deg; a larger correction is refused.",
            show_default="twice the robot's largest deviation",
        ),
    ] = None,
    notes: NoteTexts = None,
    revert: Annotated[bool, typer.Option("--revert", help="Write the originals of corrected programs.")] = False,
    json: Json = False,
) -> None:
    """Correct robot programs so that the real robot goes where they say.

    Only the numbers of targets change, and a comment says so. Beside each program NAME.truearm.json records what was
    done, and holds the original; compensation.html shows how far each target was moved.
    """
    if revert:
        _revert(
            programs,
            out,
            json,
            tools=tools,
            frames=frames,
            payload=payload,
            wrench=wrench,
            wrench_frame=wrench_frame,
            controller_kinematics=controller_kinematics,
            split=split,
            again=again or None,
            joint_targets=None if joint_targets == "keep" else joint_targets,
            only=only or None,
            keep=keep or None,
            taught=taught,
            accept=accept or None,
            accept_correction=accept_correction,
            notes=notes or None,
        )
        return
    from truearm.compensation.compensate import compensate as run
    from truearm.compensation.result import REPORT

    with progress() as say:
        correction = run(
            robot,
            programs,
            out=out,
            tools=tools,
            frames=frames,
            payload=payload,
            wrench=wrench,
            wrench_frame=wrench_frame,  # type: ignore[arg-type]
            controller_kinematics=controller_kinematics,
            split=None if split is None else split / 1e3,
            again=again,
            joint_targets=joint_targets,
            only=only or (),
            keep=keep or (),
            taught=None if taught is None else [word.strip() for word in taught.split(",")],
            accept=accept or (),
            accept_correction=accept_correction,
            notes=read_notes(notes),
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(correction.summary())
    else:
        print_record(correction)
        print_line(f"Written to {out}, with the report {REPORT}")
    end_on_error(correction.warnings)


def _revert(programs: list[Path], out: Path, json: bool, **others: object) -> None:
    from truearm.compensation.compensate import revert as run
    from truearm.engine.base.errors import InputError

    for name, given in others.items():
        if given is not None:
            raise InputError("only one of them can hold", parameter=f"revert, {name}", cure="Leave one out.")
    restored = run(programs, out=out)
    if json:
        print_json(restored.summary())
    else:
        print_record(restored)


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
    from truearm.compensation.path import path as run

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
