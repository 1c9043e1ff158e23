"""What long actions do: each calls one job, as the command of its name does in the project's folder.

They read files of the project alone, and run in a process of their own (:mod:`truearm.studio.work`), whose working
folder is the project's. So what they write is, to the byte, what the command writes there.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.files import confined_reads
from truearm.engine.command.request import Request

Progress = Callable[[str], None]
#: What to do where a sound result stays, as the page Calibrate has it.
_KEPT: Final = "To replace the sound result all the same, tick 'Replace a sound result' and calibrate again."


@dataclass(frozen=True)
class Outcome:
    """What a job said."""

    lines: tuple[str, ...]  #: What its command prints.
    notices: tuple[Notice, ...] = ()  #: What to know about it.
    files: tuple[str, ...] = ()  #: What it wrote, by their names in the project.
    finished: bool = True  #: Whether its figures can be believed.
    refused: InputError | None = None  #: Why nothing was written although there is a result; None where it was.


def calibrate(
    folder: Path, robot: str, data: str, out: str, progress: Progress, *, replace: bool = False, **options: Any
) -> Outcome:
    """Calibrate and write the result: :func:`truearm.calibrate`.

    Parameters
    ----------
    replace
        Whether a sound result is replaced by one that is not; it is no part of the command that the report shows.
    options
        Of the job, by its names of parameters; None where nothing is said.
    """
    from truearm.calibration.calibrate import Calibrate
    from truearm.calibration.parts import ResultKeptError

    os.chdir(folder)
    with confined_reads(folder):
        try:
            found = done(Calibrate(robot, data, out=out, replace=replace, progress=progress, **given(options)))
        except ResultKeptError as kept:
            found = kept.result
            refused = InputError(kept.what, where=out, came=kept.came, cure=_KEPT)
            return Outcome(tuple(found.lines()), found.warnings, finished=False, refused=refused)
    return Outcome(tuple(found.lines()), found.warnings, found.written, found.finished)


def given(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of options."""
    return {name: value for name, value in options.items() if value is not None}


def done(asked: Request) -> Any:
    """Do what is asked for; the result names the command that does the same in the project's folder."""
    return dataclasses.replace(asked, command=asked.as_command()).run()
