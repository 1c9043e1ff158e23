"""``truearm distances``, ``lines``, ``sphere``, ``tolerance`` and ``validate``."""

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
    WrenchAtText,
    WrenchFrameText,
    WrenchText,
    command_line,
    end_on_error,
    print_json,
    print_line,
    print_record,
    read_gravity,
    read_notes,
)
from truearm.engine.command.texts import read_lengths


def distances(
    robot: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements, of whatever instrument's frame.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed."""
    from truearm.validation.distances import distances as run

    judged = run(robot, data, payload=payload, gravity=read_gravity(gravity))
    if json:
        print_json(judged.summary())
    else:
        print_record(judged)


def lines(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The nominal robot, as the controller knows it.")],
    centre: Annotated[str, typer.Option(metavar="X,Y,Z", help="Middle of the box in the base frame \\[mm].")],
    size: Annotated[str, typer.Option(metavar="X,Y,Z", help="Of the box \\[mm].")] = "600,800,400",
    joint_errors: Annotated[
        str | None,
        typer.Option("--model", metavar="FILE", help="joint-errors.yaml to compensate with.", show_default=False),
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Try it on this twin, as in 'truearm simulate'.", show_default=False),
    ] = None,
    data: Annotated[
        str | None,
        typer.Option(metavar="DATA.csv", help="Measured, configurations named x-1 to xyz-11.", show_default=False),
    ] = None,
    noise: Annotated[float, typer.Option(metavar="MM", min=0.0, help="Of a coordinate of a repetition.")] = 0.0,
    repeats: Annotated[int, typer.Option(metavar="N", min=1, help="Repetitions on the twin.")] = 30,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the noise.")] = 0,
    joints: JointsText = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="PLAN.csv", help="Write the joint positions to command.")
    ] = None,
    json: Json = False,
) -> None:
    """Test a robot along seven directions of a box, and compensate it off-line through its joint errors."""
    from truearm.engine.base.units import sized_si
    from truearm.validation.lines import lines as run

    found = run(
        robot,
        read_lengths(centre, "centre"),  # type: ignore[arg-type]
        size=read_lengths(size, "size"),  # type: ignore[arg-type]
        joint_errors=joint_errors,
        truth=truth,
        data=data,
        noise=sized_si(noise, "mm", parameter="noise", deviation=True) if noise else 0.0,
        repeats=repeats,
        seed=seed,
        joints=joints,  # type: ignore[arg-type]
        out=out,
    )
    if json:
        print_json(found.summary())
        return
    print_record(found)
    if out is not None:
        said = "compensated" if found.compensated else "nominal"
        shown = " as the controller shows them (axis_i)" if found.joints_are == "controller" else ""
        print_line(f"{out}: {len(found.joints)} configurations, {said} joint positions{shown}.")


def sphere(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Usually a calibrated.yaml.")],
    data: Annotated[
        str, typer.Argument(metavar="DATA.csv", help="What the bar read: columns target, fixture, distance \\[mm].")
    ],
    taught: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Configuration at which the target was brought to the ball.",
            show_default="the centre that fits best",
        ),
    ] = None,
    tip: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where the bar is attached, in the flange frame \\[mm].",
            show_default="where the robot has the target",
        ),
    ] = None,
    payload: PayloadText = None,
    gravity: GravityText = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="PAGE.html", help="Write the error of every reading.")
    ] = None,
    json: Json = False,
) -> None:
    """Judge a robot by a ballbar between its tool and a fixed ball, before and after calibration."""
    from truearm.validation.sphere import sphere as run

    found = run(
        robot,
        data,
        taught=taught,
        tip=None if tip is None else read_lengths(tip, "tip"),  # type: ignore[arg-type]
        payload=payload,
        gravity=read_gravity(gravity),
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        if out is not None:
            print_line(f"Written: {out}")
    end_on_error(found.warnings)


def tolerance(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A robot with joint errors, as 'axes' writes it.")],
    depth: Annotated[str, typer.Option(metavar="MM[,MM..]", help="Depth of each joint's hole, or of all.")],
    lean: Annotated[
        str | None,
        typer.Option(metavar="MM[,MM..]", help="Perpendicularity or parallelism that is allowed.", show_default=False),
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(
            metavar="MM[,MM..]", help="Radius about its place, half the drawing's diameter.", show_default=False
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Say what joint errors use of their tolerances, or what tolerances may do at the flange.

    With --lean or --position the largest flange error that they allow, else the tolerances of the robot's own errors.
    """
    from truearm.validation.tolerances import tolerance as run

    found = run(
        robot,
        read_lengths(depth, "depth"),
        lean=None if lean is None else read_lengths(lean, "lean"),
        position=None if position is None else read_lengths(position, "position"),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)


def validate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="New measurements in the same frames.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    wrench: WrenchText = None,
    wrench_frame: WrenchFrameText = None,
    wrench_at: WrenchAtText = None,
    refit: Annotated[
        str | None,
        typer.Option(
            metavar="base|targets|tool",
            help="What was moved since the calibration and is found anew from these measurements.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for report.html and result.json.", show_default=False),
    ] = None,
    notes: NoteTexts = None,
    json: Json = False,
) -> None:
    """Judge a calibrated robot on new measurements taken in the same frames."""
    from truearm.validation.validate import validate as run

    validation = run(
        robot,
        data,
        payload=payload,
        gravity=read_gravity(gravity),
        wrench=wrench,
        wrench_frame=wrench_frame,  # type: ignore[arg-type]
        wrench_at=wrench_at,
        refit=refit,
        out=out,
        notes=read_notes(notes),
        command=command_line(),
    )
    if json:
        print_json(validation.summary())
    else:
        print_record(validation)
        if out is not None:
            print_line(f"Written to {out}: result.json, report.html")
    end_on_error(validation.warnings)
