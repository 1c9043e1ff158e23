"""``truearm simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import (
    GravityText,
    PayloadText,
    Pull,
    WrenchAtText,
    WrenchFrameText,
    WrenchText,
    number_or,
    read_gravity,
    refuse_pull,
)


def simulate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    truth: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="nominal, random, gear-errors, tooth-errors, a truth of the robot file ('truearm show'), or a file.",
        ),
    ],
    poses: Annotated[
        str,
        typer.Option(metavar="N|FILE.csv", help="Configurations, drawn evenly within the limits; or those of a file."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    noise: Annotated[
        float | None,
        typer.Option(
            metavar="MM", min=0.0, help="Standard deviation of a reading.", show_default="the deviation of the device"
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="An instrument of 'truearm devices', or inclinometers.",
            show_default="one that sees every target everywhere",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of configurations, noise and a random truth.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    pull: Pull = None,
    wrench: WrenchText = None,
    wrench_frame: WrenchFrameText = None,
    wrench_at: WrenchAtText = None,
    joints: Annotated[
        str,
        typer.Option(
            metavar="controller|model",
            help="Whose joint positions to write: as the controller shows them (axis_i), or the model's (joint_i).",
        ),
    ] = "model",
) -> None:
    """Measure a digital twin whose truth is known, with a simulated instrument."""
    from truearm.cli.output import print_record, progress
    from truearm.jobs.simulate import simulate as run
    from truearm.units import sized_si

    refuse_pull(pull)
    with progress() as say:
        simulated = run(
            robot,
            truth=truth,
            poses=number_or(poses),
            out=out,
            noise=sized_si(noise, "mm", parameter="noise", deviation=True) if noise else noise,
            device=device,
            seed=seed,
            payload=payload,
            gravity=read_gravity(gravity),
            wrench=wrench,
            wrench_frame=wrench_frame,  # type: ignore[arg-type]
            wrench_at=wrench_at,
            joints=joints,  # type: ignore[arg-type]
            progress=say,
        )
    print_record(simulated)
