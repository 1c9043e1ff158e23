"""A published experiment made again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from truearm.errors import refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import (
    command_argument,
    count_argument,
    folder_for,
    name_argument,
    progress_argument,
    python_call,
)
from truearm.studies import run_study
from truearm.studies.study import Study


def study(
    name: str,
    *,
    seeds: int = 10,
    data: str | Path | None = None,
    out: str | Path | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Study:
    """Make a published experiment again and set our figures beside the printed ones.

    Parameters
    ----------
    name
        One of :data:`truearm.studies.STUDIES` by name.
    seeds
        How often to do it anew, with seeds 0, 1, 2 and so on.
    data
        Folder of measured data, for a study that needs them.
    out
        Folder for report.html and study.json; None writes nothing.
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If there is no such study, or its data are missing, or it needs none.
    """
    progress_argument(progress)
    name = name_argument(name, "name")
    seeds = count_argument(seeds, "seeds")
    source = None if data is None else path_argument(data, "data")
    folder = None if out is None else folder_for((), out)
    invocation = command_argument(command) or python_call("study", name, seeds=seeds, data=data)
    with refusals_of("data"):
        finished = replace(run_study(name, seeds, source, progress), command=invocation)
    if folder is not None:
        progress("writing the report")
        with refusals_of("out"):
            finished.save(folder)
    return finished
