"""What loads robots and measurements; no command does that alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.command.groups import Measured, OfRobot
from truearm.engine.command.request import as_in, job

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.robot.robot import Robot


class LoadRobot(OfRobot):
    """Return a robot: of a library id, of a robot file, or of a URDF.

    An id is one of the library, ``irb120``; a robot file is ``my.yaml``; a URDF is ``my.urdf``, or ``my.urdf#tool0`` to
    name the link at the end of the chain. A robot is returned as it is.
    """

    job = "load_robot"
    refuses = "If there is no such robot, or its file cannot be used; the message names the entry."

    def run(self) -> Robot:
        """Load it."""
        from truearm.engine.command.arguments import robot_argument

        return robot_argument(self.robot)


class LoadData(Measured):
    """Return the measurements in a canonical CSV file; a dataset is returned as it is."""

    job = "load_data"
    refuses = "If the file cannot be used; the message names the line and the column."
    robot: Robot | str | Path | None = as_in(
        OfRobot,
        "robot",
        default=None,
        shown="leaves joint positions as they are",
        more="The one that was measured: joint positions that its controller shows become its model's.",
        kw_only=False,
        word="",
    )

    def run(self) -> Dataset:
        """Load them."""
        from truearm.engine.command.arguments import data_argument, readings_argument, robot_argument

        if self.robot is None:
            return data_argument(self.data)
        return readings_argument(robot_argument(self.robot), self.data)


load_robot = job(LoadRobot)
load_data = job(LoadData)
