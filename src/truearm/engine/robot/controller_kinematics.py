"""With what a controller computes, in a word or as the name of a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.files import exists
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import ALLOWED, STATED
from truearm.engine.robot.ur_kinematics import controller_robot, read_kinematics, refuse_far, with_kinematics


def with_controller_kinematics(robot: Robot, stated: str, folder: Path) -> Robot:
    """Return a robot with what its controller computes with.

    Args:
        stated: ``nominal``, ``proprietary``, ``unknown`` or the name of a file.
        folder: Where such a file lies if its name is no whole path.

    Raises:
        InputError: If it is none of the words and there is no such file, or the file is of another type of robot.
    """
    kinematics = STATED.get(stated)
    if kinematics is None:
        path = folder / stated
        if not exists(path):
            raise InputError(
                "nobody can read these kinematics: it is no word that is known, and there is no such file",
                where=str(path),
                came=stated,
                allowed=ALLOWED,
                cure=did_you_mean(stated, STATED) or "Copy the file there, or state what the controller computes with.",
            )
        controller_arm = with_kinematics(robot, read_kinematics(path))
        refuse_far(controller_arm, robot, str(path))
        kinematics = controller_arm.controller.kinematics
    return replace(robot, controller=replace(robot.controller, kinematics=kinematics))


def refuse_rows_of_another_type(robot: Robot, where: str) -> None:
    """Refuse rows of a controller that no arm of the robot's type has, as those of a file are refused.

    Args:
        where: Names the rows in messages.

    Raises:
        InputError: With how far the flange or a link is from the nominal one; or if the robot is of another kind.
    """
    refuse_far(controller_robot(robot), robot, where)
