"""A robot by library id or from a file."""

from __future__ import annotations

from pathlib import Path

from truearm.jobs.arguments import robot_argument
from truearm.modeling.robot import Robot


def load_robot(robot: Robot | str | Path) -> Robot:
    """Return a robot.

    Parameters
    ----------
    robot
        The id of a library robot (``irb120``), a robot file (``my.yaml``), or a URDF (``my.urdf``, or
        ``my.urdf#tool0`` to name the link at the end of the chain). A robot is returned as it is.

    Raises
    ------
    InputError
        If there is no such robot, or its file cannot be used; the message names the entry.
    """
    return robot_argument(robot)
