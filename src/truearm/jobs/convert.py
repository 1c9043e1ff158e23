"""A robot in another kinematic convention."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import refusals_of
from truearm.jobs.arguments import choice_argument, new_file_for, robot_argument
from truearm.modeling.conversion import CONVERSIONS, converted
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.robot import Robot
from truearm.results.converted_robot import ConvertedRobot
from truearm.writing import write_new_text


def convert(robot: Robot | str | Path, convention: str, *, out: str | Path | None = None) -> ConvertedRobot:
    """Write a robot in another kinematic convention, every pose the same.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes. Its values become the nominal ones.
    convention
        One of :data:`truearm.modeling.conversion.CONVERSIONS` by name.
    out
        Robot file to write, which must not exist yet; None writes nothing.

    Raises
    ------
    InputError
        If there is no such convention, or it cannot describe the robot, or the file exists.
    """
    choice_argument(convention, "convention", CONVERSIONS)
    file = None if out is None else new_file_for(out)
    with refusals_of("robot"):
        made = converted(robot_argument(robot), convention)
    if file is not None:
        write_new_text(file, robot_text(made))
    return ConvertedRobot(made, file)
