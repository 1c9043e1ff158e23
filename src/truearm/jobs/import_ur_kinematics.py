"""A robot with the kinematics that its controller computes with."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import new_file_for, robot_argument
from truearm.library import library, load_robot
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.formats.ur_kinematics import (
    MOST_APART,
    FactoryKinematics,
    mean_distance,
    read_kinematics,
    refuse_far,
    with_kinematics,
)
from truearm.modeling.robot import Robot
from truearm.results.imported_kinematics import ImportedKinematics, largest_zero
from truearm.writing import write_new_text


def import_ur_kinematics(
    file: str | Path, robot: Robot | str | Path, *, out: str | Path | None = None
) -> ImportedKinematics:
    """Read the kinematics that the controller of a Universal Robots arm computes with, as a robot.

    Parameters
    ----------
    file
        ``calibration.conf`` of the controller, or the kinematics file of the ROS driver.
    robot
        The arm's type: a robot with the maker's table, or what :func:`truearm.load_robot` takes.
    out
        Robot file to write, which must not exist yet; None writes nothing.

    Returns
    -------
    imported
        The robot: its values are what the controller computes with. Its nominal values, masses, limits and tools are
        those of the type, in frames beside the type's.

    Raises
    ------
    InputError
        If the file is no such file, is not whole, or is of an arm of another type; if the type is no arm of this kind;
        or if `out` exists.
    """
    path = path_argument(file, "file")
    target = None if out is None else new_file_for(out)
    type_ = robot_argument(robot)
    with refusals_of("file"):
        found = read_kinematics(path)
    with refusals_of("robot"):
        made = with_kinematics(type_, found)
    fitting = _fitting(found, type_)
    try:
        refuse_far(made, type_, str(path))
    except InputError as error:
        if fitting:
            words = f"Of the library, {' and '.join(fitting)} {'fits' if len(fitting) == 1 else 'fit'}."
            error = InputError(
                error.what, where=error.where, came=error.came, allowed=error.allowed, cure=f"{error.cure} {words}"
            )
        error.parameter = "robot"
        raise error from None
    if target is not None:
        write_new_text(target, robot_text(made))
    return ImportedKinematics(made, type_, mean_distance(made, type_), fitting, target)


def _fitting(found: FactoryKinematics, type_: Robot) -> dict[str, float]:
    """Return the other types of the library that a file fits as well, with their largest joint zero [rad]."""
    names = {}
    for name in library():
        other = load_robot(name)
        if name == type_.name:
            continue
        try:
            made = with_kinematics(other, found)
            if mean_distance(made, other) <= MOST_APART:
                names[name] = largest_zero(made)
        except InputError:  # no arm of this kind
            continue
    return names
