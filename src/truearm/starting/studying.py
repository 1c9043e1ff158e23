"""A published experiment made again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.base.errors import refusals_of
from truearm.engine.base.workers import Given, ThisProcess, processes, with_workers
from truearm.engine.command.arguments import folder_for
from truearm.engine.document.records import Record
from truearm.starting.published import find_papers

if TYPE_CHECKING:
    from truearm.starting.study import MakeStudy


def made_again(asked: MakeStudy) -> Record:
    """Do the seeds, and write what was found."""
    find_papers()
    from papers import run_study
    from papers.seeds import seeds_done_by

    source = None if asked.data is None else Path(asked.data)
    folder = None if asked.out is None else folder_for((), asked.out)
    several = processes(min(asked.workers, asked.seeds)) if asked.executor is None else Given(asked.executor)
    doing = None if isinstance(several, ThisProcess) else several
    with with_workers(several), seeds_done_by(doing), refusals_of("data"):
        finished = replace(run_study(asked.study, asked.seeds, source, asked.progress), command=asked.again)
    if folder is not None:
        asked.progress("writing the report")
        with refusals_of("out"):
            finished.save(folder)
    return finished
