"""A robot's axes from circles, and with them its frames, parameters and joint errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final, Literal

from truearm.errors import refusals_of
from truearm.identification.axes.analysis import analyse
from truearm.jobs.arguments import (
    choice_argument,
    files_of,
    folder_for,
    progress_argument,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.measurement.dataset import Dataset
from truearm.modeling.robot import Robot
from truearm.results.axis_calibration import AXIS_FILES, AxisCalibration

#: What the data may be given in, and whether that is the robot's base frame.
_FRAMES: Final = {"instrument": False, "robot": True}


def axes(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    out: str | Path | None = None,
    frame: Literal["instrument", "robot"] = "instrument",
    progress: Callable[[str], None] = lambda _: None,
) -> AxisCalibration:
    """Find a robot's axes from measurements in which one joint moves at a time.

    Parameters
    ----------
    robot
        The nominal robot, or what :func:`truearm.load_robot` takes. Joint effects are kept, and deflect the axes.
    data
        Readings, or a canonical CSV file, with runs of every joint; see :func:`truearm.measurement.turns.find_runs`.
    out
        Folder for calibrated.yaml, joint-errors.yaml and axes.json; None writes nothing, see
        :meth:`~truearm.results.axis_calibration.AxisCalibration.save`.
    frame
        What the data are given in: the ``instrument``'s frame, or the base frame of the ``robot``, set up before.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If the robot or the data cannot be used, a joint has no run, or its axis cannot be found.
    """
    progress_argument(progress)
    in_robot_frame = choice_argument(frame, "frame", _FRAMES)
    refuse_swapped(robot, data, "axes")
    folder = None if out is None else folder_for(AXIS_FILES, out, robot, data, ours=True)
    nominal = robot_argument(robot)
    readings = readings_argument(nominal, data)
    progress("fitting circles and axes")
    with refusals_of("data"):
        found = AxisCalibration(analyse(nominal, readings, in_robot_frame=in_robot_frame), files_of(robot, data))
    if folder is not None:
        progress("writing the files")
        found.save(folder)
    return found
