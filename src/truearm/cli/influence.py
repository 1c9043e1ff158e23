"""``truearm influence``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_train
from truearm.cli.options import command_line
from truearm.cli.output import Json, print_json, print_line, print_record, progress


def influence(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    data: Annotated[
        str | None,
        typer.Argument(metavar="[DATA.csv]", help="Measurements in the canonical CSV.", show_default=False),
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
    from truearm.jobs.influence import influence as run
    from truearm.units import sized_si

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
