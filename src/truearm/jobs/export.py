"""A robot for other programs."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import refusals_of
from truearm.jobs.arguments import choice_argument, new_file_for, robot_argument
from truearm.jobs.proof import told_of
from truearm.modeling.formats.export import FORMATS
from truearm.modeling.robot import Robot
from truearm.modeling.wrench import refuse_pushed
from truearm.results.exported_robot import ExportedRobot
from truearm.writing import write_new_text


def export(robot: Robot | str | Path, format: str, *, out: str | Path | None = None) -> ExportedRobot:
    """Write a robot, nominal or calibrated, for other programs, and say what the format cannot hold.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes.
    format
        ``dh`` (standard DH table), ``mdh`` (modified DH table), ``hayati`` (standard DH table with beta between nearly
        parallel axes), ``urdf``, ``json`` (everything, schema ``truearm-model/1``), ``python`` (a module for forward
        and inverse kinematics that needs only NumPy) or ``ur-kinematics`` (the kinematics file of the ROS driver of
        Universal Robots).
    out
        File to write, which must not exist yet; None writes nothing.

    Raises
    ------
    InputError
        If there is no such format, or it cannot describe the robot, or the file exists.
    """
    exported = choice_argument(format, "format", FORMATS)
    file = None if out is None else new_file_for(out)
    loaded = robot_argument(robot)
    refuse_pushed(loaded)
    with refusals_of("robot"):
        made = exported(loaded)
    if file is not None:
        write_new_text(file, made.text)
    return ExportedRobot(loaded, format, made.text, made.frames, made.left_out, file, tuple(told_of(loaded)))
