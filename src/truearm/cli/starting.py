"""``truearm demo``, ``example`` and ``new-robot``: ways to begin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.output import print_record, progress


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for data and results.")] = Path(
        "truearm-demo"
    ),
) -> None:
    """Run the main job on a built-in digital twin of an ABB IRB 120: calibrate it and correct a program."""
    from truearm.jobs.demo import demo as run

    with progress() as say:
        shown = run(out, progress=say)
    print_record(shown)
    if not shown.calibration.finished:
        raise typer.Exit(3)


def example(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")]) -> None:
    """Write a small complete session to imitate: a robot, its data, the commands."""
    from truearm.jobs.example import example as run

    print_record(run(folder))


def new_robot(file: Annotated[Path, typer.Argument(metavar="FILE", help="Robot file to write.")]) -> None:
    """Write a commented robot file to fill in."""
    from truearm.jobs.new_robot import new_robot as run

    print_record(run(file))
