"""``truearm validate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import (
    GravityText,
    NoteTexts,
    PayloadText,
    WrenchAtText,
    WrenchFrameText,
    WrenchText,
    read_gravity,
    read_notes,
)
from truearm.cli.options import command_line
from truearm.cli.output import Json, end_on_error, print_json, print_line, print_record


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
    from truearm.jobs.validate import validate as run

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
