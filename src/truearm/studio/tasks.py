"""What long actions do: each calls one job, as the command of its name does in the project's folder.

They read files of the project alone, and run in a process of their own (:mod:`truearm.studio.work`), whose working
folder is the project's. So what they write is, to the byte, what the command writes there.
"""

from __future__ import annotations

import dataclasses
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.files import confined_reads
from truearm.engine.command.request import Request
from truearm.studio.corrected import CellPart

Progress = Callable[[str], None]
#: Options of `compensate` that have other names than the parameters.
_PLACES: Final = {"tools": "tool", "frames": "frame"}
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


def option_words(options: Mapping[str, Any]) -> list[str]:
    """Return parameters of a job as the words of its command; what is true is a flag."""
    words: list[str] = []
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])]
    return words


def compensate_command(
    robot: str,
    program: str,
    places: Mapping[CellPart, str],
    wrench: str | None,
    wrench_frame: str | None,
    taught: Sequence[str] | None,
    controller_kinematics: str | None,
    accept: Sequence[str],
    accept_correction: str | None,
) -> str:
    """Return the command that does the same in the project's folder, as the report shows it.

    Args:
        places: The files that say where tools and frames are.
        wrench, wrench_frame, taught, controller_kinematics, accept, accept_correction: As the job takes them.
    """
    words = ["truearm", "compensate", robot, program]
    for part, file in places.items():
        words += [f"--{_PLACES[part]}", file]
    words += [] if wrench is None else ["--wrench", wrench]
    words += [] if wrench_frame is None else ["--wrench-frame", wrench_frame]
    words += [] if controller_kinematics is None else ["--controller-kinematics", controller_kinematics]
    words += [] if taught is None else ["--taught", ",".join(taught)]
    words += [word for name in accept for word in ("--accept", name)]
    words += [] if accept_correction is None else ["--accept-correction", accept_correction]
    return shlex.join([*words, "--out", "DIR"])
