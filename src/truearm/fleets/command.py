"""``truearm fleet``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import (
    Json,
    command_line,
    end_on_error,
    print_json,
    print_line,
    print_record,
    progress,
)


def fleet(
    manifest: Annotated[str, typer.Argument(metavar="MANIFEST.yaml", help="Which robots, or which experiment.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the parts and the result.")],
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes of this machine; one a processor by default.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers do the parts.", show_default=False),
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Reach a scheduler on another machine without TLS.")
    ] = False,
    json: Json = False,
) -> None:
    """Calibrate many robots of a series, measured or simulated; run again, it goes on where it stopped."""
    from truearm.fleets.fleet import fleet as run

    with progress() as say:
        found = run(
            manifest,
            out=out,
            workers=workers,
            scheduler=scheduler,
            insecure=insecure,
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}: {', '.join(found.files)}, and the parts")
    end_on_error(found.warnings)
