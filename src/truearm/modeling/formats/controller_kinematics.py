"""With what a controller computes, in a word or as the name of a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.errors import InputError, did_you_mean
from truearm.files import exists
from truearm.modeling.formats.controller_entry import STATED
from truearm.modeling.formats.ur_kinematics import read_kinematics, refuse_far, with_kinematics
from truearm.modeling.robot import Robot

#: What may be said of a controller's kinematics.
ALLOWED: Final = f"{', '.join(STATED)}, or a kinematics file: calibration.conf, or that of the ROS driver"


def with_controller_kinematics(robot: Robot, said: str, folder: Path) -> Robot:
    """Return a robot with what its controller computes with.

    Parameters
    ----------
    said
        ``nominal``, ``proprietary``, ``unknown`` or the name of a file.
    folder
        Where such a file lies if its name is no whole path.

    Raises
    ------
    InputError
        If it is none of the words and there is no such file, or the file is of another type of robot.
    """
    kinematics = STATED.get(said)
    if kinematics is None:
        path = folder / said
        if not exists(path):
            raise InputError(
                "nobody can read these kinematics: it is no word that is known, and there is no such file",
                where=str(path),
                came=said,
                allowed=ALLOWED,
                cure=did_you_mean(said, STATED) or "Copy the file there, or state what the controller computes with.",
            )
        made = with_kinematics(robot, read_kinematics(path))
        refuse_far(made, robot, str(path))
        kinematics = made.controller.kinematics
    return replace(robot, controller=replace(robot.controller, kinematics=kinematics))
