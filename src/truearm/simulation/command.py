"""``truearm simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import (
    GravityText,
    Json,
    PayloadText,
    Pull,
    WrenchAtText,
    WrenchFrameText,
    WrenchText,
    command_line,
    number_or,
    print_json,
    print_line,
    print_record,
    progress,
    read_gravity,
    read_train,
    refuse_pull,
)

# ``truearm devices``.


def devices(json: Json = False) -> None:
    """List the instruments that can be simulated and planned for, with what each is good for."""
    from truearm.simulation.simulate import devices as run

    found = run()
    if json:
        print_json(found.summary()["devices"])
    else:
        print_record(found)


# ``truearm influence``.


def influence(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    data: Annotated[
        str | None, typer.Argument(metavar="[DATA.csv]", help="Measurements in the canonical CSV.", show_default=False)
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results.")] = None,
    model: Annotated[
        str, typer.Option(metavar="MODEL", help="Whose parameters are changed, as in truearm calibrate, without auto.")
    ] = "geometric",
    target: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The tip.", show_default="the first of the data or the robot, or the flange"),
    ] = None,
    angle: Annotated[float, typer.Option(metavar="DEG", help="By how much angles are changed.")] = 0.05,
    length: Annotated[float, typer.Option(metavar="MM", help="By how much lengths are changed.")] = 0.1,
    poses: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Random configurations, without DATA.csv.", show_default="118"),
    ] = None,
    frames: Annotated[
        str,
        typer.Option(
            metavar="placed|robot",
            help="Where base and targets are: fitted with the nominal robot, or as its file says.",
        ),
    ] = "placed",
    combination: Annotated[
        str,
        typer.Option(
            "--combine", metavar="HOW", help="One set out of those of all poses: mean, scaled-mean or best-pose."
        ),
    ] = "mean",
    train: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Configurations to train on; the rest judges.", show_default="70 %"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the split, or of the configurations.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Change one parameter after the other and see what the tip does; with DATA.csv, identify by that.

    With --out it writes influence.csv, result.json and report.html.
    """
    from truearm.engine.base.units import sized_si
    from truearm.simulation.influence import influence as run

    with progress() as say:
        found = run(
            robot,
            data,
            out=out,
            model=model,
            target=target,
            angle=sized_si(angle, "deg", parameter="angle"),
            length=sized_si(length, "mm", parameter="length"),
            poses=poses,
            frames=frames,  # type: ignore[arg-type]
            combination=combination,  # type: ignore[arg-type]
            train=read_train(train),
            seed=seed,
            payload=payload,
            gravity=read_gravity(gravity),
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(found.summary())
        return
    print_record(found)
    if out is not None:
        print_line(f"Written to {out}: influence.csv, result.json, report.html")


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
    from truearm.engine.base.units import sized_si
    from truearm.engine.command.options import print_record, progress
    from truearm.simulation.simulate import simulate as run

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
