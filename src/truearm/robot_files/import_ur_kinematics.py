"""A robot with the kinematics that its controller computes with."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.errors import InputError, Notice, Rule, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import write_new_text
from truearm.engine.command.arguments import new_file_for, robot_argument
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.ur_kinematics import (
    FactoryKinematics,
    mean_distance,
    read_kinematics,
    refuse_far,
    with_kinematics,
)

if TYPE_CHECKING:
    from truearm.robot_files.jobs import ImportUrKinematics

#: Joint zeros that are so many times smaller speak for another type: of published files they are 8 times and more, or
#: less than twice.
_CLEARLY: Final = 5.0


TYPE_NOT_TOLD: Final = Rule(
    "type-not-told",
    "note",
    "the file fits other types of the library as well",
    cure="Read the type on the arm; with the wrong one lengths are off by what the data sheets differ.",
)
TYPE_DOUBTFUL: Final = Rule(
    "type-doubtful",
    "warning",
    "joint zeros are five times smaller for another type. The factory's are nearly nothing: of three published files "
    "they were up to 0.005, 0.0005 and 0.0003 deg for the right type and 0.04, 0.007 and 0.07 deg for its "
    "look-alike. In a fourth file, with 0.008 and 0.006 deg, they told nothing",
    cure="Read the type on the arm.",
)


@dataclass(frozen=True, eq=False, repr=False)
class ImportedKinematics(Record):
    """A robot with the kinematics that its controller computes with."""

    robot: Robot  #: Its values are the controller's, its nominal values the type's.
    type: Robot  #: The type of arm, as its maker publishes it.
    distance: float  #: How far the flange is from the type's on average, at random joint positions [m].
    #: Other types of the library that the file fits as well, with the largest joint zero that it has of them [rad].
    fitting: Mapping[str, float] = field(default_factory=dict)
    file: Path | None = None  #: The robot file; None if none was written.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about it: types that cannot be told apart by the file."""
        if not self.fitting:
            return ()
        best, zero = min(self.fitting.items(), key=lambda item: item[1])
        ours = largest_zero(self.robot)
        if zero < ours / _CLEARLY:
            return (
                TYPE_DOUBTFUL(
                    f"The file is rather of an arm of type {best}. The factory's joint zeros are nearly nothing, and "
                    f"they are up to {math.degrees(zero):.2g} deg for {best} and {math.degrees(ours):.2g} deg for "
                    f"{self.type.name}."
                ),
            )
        return (
            TYPE_NOT_TOLD(
                f"The file fits {' and '.join(self.fitting)} as well as {self.type.name}: it has differences to a "
                "table that it does not name."
            ),
        )

    def blocks(self) -> Iterator[Block]:
        """Give what was read, and how far it is from the type [mm]."""
        distance, identity = self.distance * 1e3, self.robot.controller.kinematics.identity
        text = (
            f"{self.robot.name} with the kinematics of its controller, flange {distance:.2f} mm from the type's on "
            "average"
        )
        yield say(
            text if self.file is None else f"{self.file}: {text}",
            file=None if self.file is None else str(self.file),
            robot=self.robot.name,
            mean_distance_from_type_mm=distance,
        )
        yield say(*(f"  {name}: {value}" for name, value in identity.items()), identity=dict(identity))


def largest_zero(robot: Robot) -> float:
    """Return the largest joint zero of a robot [rad]."""
    return max(abs(parameter.value) for parameter in robot.parameters.values() if parameter.group == "joint zero")


def imported_kinematics(asked: ImportUrKinematics) -> ImportedKinematics:
    """Read the kinematics of a controller, and write the robot that they are of."""
    path = path_argument(asked.file, "file")
    target = None if asked.out is None else new_file_for(asked.out)
    type_ = robot_argument(asked.robot)
    with refusals_of("file"):
        factory_kinematics = read_kinematics(path)
    with refusals_of("robot"):
        robot = with_kinematics(type_, factory_kinematics)
    fitting = _fitting(factory_kinematics, type_)
    try:
        refuse_far(robot, type_, str(path))
    except InputError as error:
        if fitting:
            words = f"Of the library, {' and '.join(fitting)} {'fits' if len(fitting) == 1 else 'fit'}."
            error = InputError(
                error.what, where=error.where, came=error.came, allowed=error.allowed, cure=f"{error.cure} {words}"
            )
        error.parameter = "robot"
        raise error from None
    if target is not None:
        write_new_text(target, robot_text(robot))
    return ImportedKinematics(robot, type_, mean_distance(robot, type_), fitting, target)


def _fitting(kinematics: FactoryKinematics, type_: Robot) -> dict[str, float]:
    """Return the other types of the library that a file fits as well, with their largest joint zero [rad]."""
    names = {}
    for name in library():
        other = load_robot(name)
        if name == type_.name:
            continue
        try:
            robot = with_kinematics(other, kinematics)
            refuse_far(robot, other, name)
        except InputError:  # no arm of this kind, or far from this one
            continue
        names[name] = largest_zero(robot)
    return names
