"""What is known about a robot, and where it stands at joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from truearm.jobs.arguments import array_argument, joints_argument, robot_argument
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.robot import Robot
from truearm.results.robot_description import RobotDescription
from truearm.results.shown_pose import ShownPose


def show(
    robot: Robot | str | Path,
    *,
    joints: Array | Sequence[float] | None = None,
    joints_are: JointsOf | None = None,
) -> RobotDescription:
    """Say what is known about a robot, and where it stands at joint positions, to compare with its pendant.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes.
    joints
        Joint positions ``(joints,)`` [rad; m for prismatic joints]; None for the robot alone.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the ``controller`` shows them; None for the controller's
        where the robot file says that they differ.

    Raises
    ------
    InputError
        If the robot or the joints cannot be used.
    """
    arm = robot_argument(robot)
    whose = joints_argument(joints_are, arm, "joints_are")
    if joints is None:
        return RobotDescription(arm)
    count = len(arm.joints)
    given = array_argument(joints, "joints", (count,), f"{count} numbers, one for each joint of {arm.name}")
    at = np.array(given) if whose == "model" else arm.controller.to_model(given[None])[0]
    return RobotDescription(arm, ShownPose(arm, at))
