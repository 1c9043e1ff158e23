"""``truearm lines``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import JointsText
from truearm.cli.output import Json, print_json, print_line, print_record
from truearm.jobs.texts import read_lengths


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
    from truearm.jobs.lines import lines as run
    from truearm.units import sized_si

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
