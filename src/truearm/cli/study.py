"""``truearm study``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.options import command_line
from truearm.cli.output import Json, print_json, progress
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
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for report.html and study.json.")],
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of measured data, for a study that needs them.", show_default=False),
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="How often to do it anew.")] = 10,
    json: Json = False,
) -> None:
    """Make a published experiment again."""
    from dataclasses import replace

    from truearm.files import writable_folder
    from truearm.studies import run_study
    from truearm.studies.study import STUDY_FILES

    writable_folder(out)
    with progress() as say:
        finished = replace(run_study(name, seeds, data, say), command=command_line())
        say("writing the report")
        finished.save(out)
    if json:
        print_json(finished.summary())
        return
    typer.echo(finished.title)
    for table in finished.tables:
        if table.compares:
            typer.echo(f"{table.title}:")
        for row in table.rows:
            if row.published is not None:
                allowed = "" if row.tolerance is None else f", may differ by {row.tolerance:.2g}"
                typer.echo(
                    f"  {row.verdict:8}{row.what}: {row.median:.3g}, published {row.published:g} {row.unit}{allowed}"
                )
    typer.echo(f"Written to {out}: {', '.join(STUDY_FILES)}")
