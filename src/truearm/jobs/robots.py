"""The robots of the library."""

from __future__ import annotations

from truearm.library import library, load_robot
from truearm.results.library import RobotList


def robots() -> RobotList:
    """List the robots of the library: maker, joints, reach, and whether their controllers are known."""
    return RobotList(tuple(load_robot(robot_id) for robot_id in library()))
