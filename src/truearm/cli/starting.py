"""``truearm demo``, ``example`` and ``new-robot``: ways to begin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for data and results.")] = Path(
        "truearm-demo"
    ),
) -> None:
    """Run the main job on a built-in digital twin of an ABB IRB 120: calibrate it and correct a program."""
    from truearm.cli.compensate import print_checked, print_correction
    from truearm.cli.output import print_record, progress
    from truearm.demonstration import demonstration

    with progress() as say:
        shown = demonstration(out, say)
    print_record(shown.calibration)
    if shown.correction is not None:
        print_correction(shown.correction)
        print_checked(shown.correction)
        typer.echo(f"The corrected program is in {out / 'corrected'}, with a report of its own, compensation.html.")
    typer.echo(f"The report is {out / 'report.html'}; open it in a browser.")
    if not shown.calibration.finished:
        raise typer.Exit(3)


def example(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")]) -> None:
    """Write a small complete session to imitate: a robot, its data, the commands."""
    from truearm.demonstration import example as write

    for path in write(folder):
        typer.echo(str(path))


def new_robot(file: Annotated[Path, typer.Argument(metavar="FILE", help="Robot file to write.")]) -> None:
    """Write a commented robot file to fill in."""
    from truearm.demonstration import new_robot as write

    write(file)
    typer.echo(f"{file}: fill it in, then look at it with 'truearm show {file}'.")
