"""``truearm study``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.options import command_line
from truearm.cli.output import Json, print_json, print_line, print_record, progress
from truearm.studies import STUDIES

HELP = "\n\n".join(
    [
        "Make a published experiment again and set our figures beside the printed ones, over several seeds.",
        "Writes report.html and study.json into DIR. The studies:",
        *(f"{entry.name}: {entry.about}{' (with --data)' if entry.files else ''}" for entry in STUDIES),
    ]
)


def study(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which study; see above.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for report.html, study.json and more.")],
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of measured data, for a study that needs them.", show_default=False),
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="How often to do it anew.")] = 10,
    workers: Annotated[int, typer.Option(metavar="N", min=1, help="Processes that do the seeds.")] = 1,
    json: Json = False,
) -> None:
    """Make a published experiment again."""
    from truearm.jobs.study import study as run
    from truearm.studies.study import STUDY_FILES

    with progress() as say:
        finished = run(name, seeds=seeds, data=data, out=out, workers=workers, command=command_line(), progress=say)
    if json:
        print_json(finished.summary())
    else:
        print_record(finished)
        print_line(f"Written to {out}: {', '.join((*STUDY_FILES, *finished.files))}")
