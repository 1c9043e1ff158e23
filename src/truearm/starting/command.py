"""``truearm demo``, ``example``, ``new-robot`` and ``study``: ways to begin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.base.errors import InputError
from truearm.engine.command.options import Json, command_line, print_json, print_line, print_record, progress
from truearm.starting.published import find_papers


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for data and results.")] = Path(
        "truearm-demo"
    ),
) -> None:
    """Run the main job on a built-in digital twin of an ABB IRB 120: calibrate it and correct a program."""
    from truearm.starting.demo import demo as run

    with progress() as say:
        shown = run(out, progress=say)
    print_record(shown)
    if not shown.calibration.finished:
        raise typer.Exit(3)


def example(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write into.")]) -> None:
    """Write a small complete session to imitate: a robot, its data, the commands."""
    from truearm.starting.example import example as run

    print_record(run(folder))


def new_robot(file: Annotated[Path, typer.Argument(metavar="FILE", help="Robot file to write.")]) -> None:
    """Write a commented robot file to fill in."""
    from truearm.starting.example import new_robot as run

    print_record(run(file))


def study_help() -> str:
    """Return the help of ``truearm study``, which lists the studies where they are."""
    told = [
        "Make a published experiment again and set our figures beside the printed ones, over several seeds.",
        "Writes report.html and study.json into DIR. The studies:",
    ]
    try:
        find_papers()
    except InputError as error:
        return "\n\n".join([*told, error.message(str)])
    from papers import STUDIES

    return "\n\n".join(
        [*told, *(f"{entry.name}: {entry.about}{' (with --data)' if entry.files else ''}" for entry in STUDIES)]
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
    from truearm.starting.study import study as run

    with progress() as say:
        finished = run(name, seeds=seeds, data=data, out=out, workers=workers, command=command_line(), progress=say)
    if json:
        print_json(finished.summary())
    else:
        from papers.study import STUDY_FILES, Study

        assert isinstance(finished, Study)
        print_record(finished)
        print_line(f"Written to {out}: {', '.join((*STUDY_FILES, *finished.files))}")
