"""A published experiment made again."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.workers import Given, ThisProcess, processes, with_workers
from truearm.engine.command.arguments import (
    command_argument,
    count_argument,
    executor_argument,
    folder_for,
    name_argument,
    progress_argument,
    python_call,
)
from truearm.engine.document.records import Record
from truearm.starting.published import find_papers


def study(
    name: str,
    *,
    seeds: int = 10,
    data: str | Path | None = None,
    out: str | Path | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Record:
    """Make a published experiment again and set our figures beside the printed ones.

    Parameters
    ----------
    name
        One of :data:`papers.STUDIES` by name.
    seeds
        How often to do it anew, with seeds 0, 1, 2 and so on.
    data
        Folder of measured data, for a study that needs them.
    out
        Folder for report.html and study.json; None writes nothing.
    workers
        Processes of this machine that do the seeds; one is this process itself. The figures do not depend on it.
    executor
        Or an executor that does them, which stays open.
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If there is no such study, or its data are missing, or it needs none.
    """
    find_papers()
    from papers import run_study
    from papers.seeds import seeds_done_by

    progress_argument(progress)
    name = name_argument(name, "name")
    seeds = count_argument(seeds, "seeds")
    count = count_argument(workers, "workers")
    executor_argument(executor)
    if executor is not None and count != 1:
        raise InputError("one of them does the seeds", parameter="workers, executor", cure="Leave one out.")
    source = None if data is None else path_argument(data, "data")
    folder = None if out is None else folder_for((), out)
    invocation = command_argument(command) or python_call("study", name, seeds=seeds, data=data)
    several = processes(min(count, seeds)) if executor is None else Given(executor)
    doing = None if isinstance(several, ThisProcess) else several
    with with_workers(several), seeds_done_by(doing), refusals_of("data"):
        finished = replace(run_study(name, seeds, source, progress), command=invocation)
    if folder is not None:
        progress("writing the report")
        with refusals_of("out"):
            finished.save(folder)
    return finished
