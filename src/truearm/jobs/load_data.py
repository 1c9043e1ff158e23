"""Measurements from a canonical CSV file."""

from __future__ import annotations

from pathlib import Path

from truearm.jobs.arguments import data_argument, readings_argument, robot_argument
from truearm.measurement.dataset import Dataset
from truearm.modeling.robot import Robot


def load_data(data: Dataset | str | Path, robot: Robot | str | Path | None = None) -> Dataset:
    """Return the measurements in a canonical CSV file.

    Parameters
    ----------
    data
        The file. A dataset is returned as it is.
    robot
        The robot that was measured, or what :func:`truearm.load_robot` takes: joint positions that its controller
        shows become its model's. None leaves them as they are.

    Raises
    ------
    InputError
        If the file cannot be used; the message names the line and the column.
    """
    return data_argument(data) if robot is None else readings_argument(robot_argument(robot), data)
