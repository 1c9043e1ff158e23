"""A part of a fleet, as a worker does it: what it is given, and the text that it returns."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.base.errors import InputError
from truearm.engine.base.version import __version__
from truearm.fleets.series import Experiment, Series, part_text

if TYPE_CHECKING:  # with all that a calibration needs
    from truearm.fleets.entries import RobotEntry


@dataclass(frozen=True)
class Task:
    """A part that somebody shall do."""

    part: int  #: Its number, counted from 0.
    version: str  #: Of truearm that asks.
    experiment: bytes | None = None  #: The pickled experiment of simulated robots; None of measured ones.
    numbers: tuple[int, ...] = ()  #: Which simulated robots, counted from 0.
    robots: tuple[RobotEntry, ...] = ()  #: Or which measured ones.
    folder: Path | None = None  #: Of the fleet, for what is written of each robot that was measured.


@dataclass(frozen=True)
class Finished:
    """A part that is done."""

    text: str  #: Its robots, as the file of the part holds them.
    failed: int  #: How many of them could not be calibrated.


def finished(task: Task) -> Finished:
    """Do a part.

    Raises:
        InputError: If this process has another version of truearm than the one that asks.
    """
    if task.version != __version__:
        raise InputError(
            "a worker has another version of truearm", parameter="scheduler", came=__version__, allowed=task.version
        )
    if task.experiment is not None:
        series = _series(task.experiment)
        rows = series.rows(task.numbers)
        text = part_text(rows, series.shared)
    else:
        from truearm.fleets.robots import calibrated_robot  # with all that a calibration needs, only for these

        calibrated = [calibrated_robot(entry, task.folder) for entry in task.robots]
        rows = [robot.row for robot in calibrated]
        written = [name for robot in calibrated for name in robot.written]
        text = part_text(rows, {}, written, [robot.row.name for robot in calibrated if robot.changed])
    return Finished(text, sum(row.status == "failed" for row in rows))


@lru_cache(maxsize=2)
def _series(pickled: bytes) -> Series:
    """Return a series that this process has made already, for the parts that follow."""
    asked = pickle.loads(pickled)
    assert isinstance(asked, Experiment)
    return Series(asked)
