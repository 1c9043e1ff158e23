"""``truearm tilting``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, NoteTexts, PayloadText, read_gravity, read_notes, read_train
from truearm.cli.options import command_line
from truearm.cli.output import Json, print_json, print_line, print_record, progress


def tilting(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    inclinations: Annotated[
        str, typer.Argument(metavar="INCLINATIONS.csv", help="What inclinometers on the links read.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    poses: Annotated[
        str | None,
        typer.Argument(
            metavar="[POSES.csv]", help="Measurements in the canonical CSV, for the geometry.", show_default=False
        ),
    ] = None,
    pushed: Annotated[
        str | None,
        typer.Option(
            metavar="PUSHED.csv",
            help="Measurements in pairs of configurations under two forces, for joints whose axes stand upright.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        str, typer.Option(metavar="MODEL", help="What the poses tell: offsets, joints or geometric.")
    ] = "geometric",
    train: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Configurations to train on; the rest judges.", show_default="70 %"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the split.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    notes: NoteTexts = None,
    json: Json = False,
) -> None:
    """Find tilt, backlash and stiffness of the joints by inclinometers, then the geometry with these held.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into DIR, and with POSES geometry.html.
    """
    from truearm.jobs.tilting import tilting as run

    with progress() as say:
        found = run(
            robot,
            inclinations,
            poses,
            pushed=pushed,
            out=out,
            model=model,
            train=read_train(train),
            seed=seed,
            payload=payload,
            gravity=read_gravity(gravity),
            notes=read_notes(notes),
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        more = "" if found.geometry is None else ", geometry.html"
        print_line(f"Written to {out}: calibrated.yaml, result.json, report.html, calibrated.urdf{more}")
    if not found.finished:
        raise typer.Exit(3)
