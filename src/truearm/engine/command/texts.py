"""Numbers that a person writes as a text, in mm and deg: what options of commands and fields of pages hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from truearm.engine.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from truearm.engine.robot.chain import Array
    from truearm.engine.robot.controller import JointsOf
    from truearm.engine.robot.robot import Robot


def read_joints(text: str, robot: Robot, parameter: str) -> list[float]:
    """Return joint positions [rad or m] of a text in deg or mm, in the units of the robot's joints."""
    from truearm.engine.base.units import to_si

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            "numbers separated by commas belong here", parameter=parameter, came=text, allowed="0,-30,45, .."
        ) from None
    if len(numbers) != len(robot.joints):
        raise InputError(
            "there are not as many numbers as joints",
            parameter=parameter,
            came=f"{len(numbers)} number{'' if len(numbers) == 1 else 's'}",
            allowed=f"{len(robot.joints)}, one for each joint of {robot.name}",
        )
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    return [to_si(value, unit) for value, unit in zip(numbers, units, strict=True)]


def read_numbers(text: str, parameter: str, allowed: str) -> list[float]:
    """Return the numbers of a text in which commas separate them."""
    from truearm.engine.base.units import as_number

    numbers = [as_number(part.strip()) for part in text.split(",")]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        raise InputError("numbers separated by commas belong here", parameter=parameter, came=text, allowed=allowed)
    return known


def read_poses(text: str) -> int | Literal["auto"]:
    """Return how many poses a text names, or ``auto``.

    Raises:
        InputError: If it is neither, or there cannot be so many.
    """
    from truearm.engine.base.units import as_number
    from truearm.engine.command.arguments import count_argument

    if text.strip() == "auto":
        return "auto"
    number = as_number(text.strip())
    if number is None or not number.is_integer():
        raise InputError(
            "a number of poses belongs here", parameter="poses", came=text, allowed="a whole number, or auto"
        )
    return count_argument(int(number), "poses")


def positions_of(
    value: Array | Sequence[float] | str, robot: Robot, joints_are: JointsOf, parameter: str
) -> Array | Sequence[float]:
    """Return the model's joint positions [rad or m] of what a job was given: these, or a text in deg or mm."""
    if not isinstance(value, str):
        return value
    import numpy as np

    at = np.array([read_joints(value, robot, parameter)])
    if joints_are == "controller":
        at = robot.controller.to_model(at)
    return [float(value) for value in at[0]]


def read_speed(text: str | None) -> list[float] | None:
    """Return speed [m/s] and share of a text in mm/s and percent."""
    from truearm.engine.base.units import sized_si

    if text is None:
        return None
    speed, *shares = read_numbers(text, "speed", "mm/s, and percent of the joints' speed: 250,10")
    return [sized_si(speed, "mm", parameter="speed"), *(share / 100.0 for share in shares)]


def read_region(text: str | None) -> list[list[float]] | None:
    """Return lowest and highest x, y and z [m] of a text in mm."""
    from truearm.engine.base.units import as_number, sized_si

    if text is None:
        return None
    ranges = [[as_number(end.strip()) for end in part.split("..")] for part in text.split(",")]
    if len(ranges) != 3 or any(len(range_) != 2 or None in range_ for range_ in ranges):
        raise InputError(
            "three ranges in mm belong here",
            parameter="region",
            came=text,
            allowed="LOW..HIGH for x, y and z: 300..600,-200..200,100..400",
        )
    return [[sized_si(end, "mm", parameter="region") for end in range_ if end is not None] for range_ in ranges]
