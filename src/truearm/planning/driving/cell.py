"""What an arm must keep clear of where it is driven: a floor, boxes and its own links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: Room that is kept between the arm and everything else, unless told [m].
CLEARANCE: Final = 0.05
#: What carries an arm that stands, and one that hangs or is on a wall.
FLOOR: Final = "floor"
MOUNTING: Final = "mounting surface"
#: A robot stands on a floor if free fall points this near to the base's -z.
_STANDING: Final = np.cos(np.deg2rad(30.0))


@dataclass(frozen=True, eq=False)
class KeepOut:
    """A box that the arm stays out of, its faces along the axes of the base frame."""

    name: str  #: In messages.
    low: Array  #: low, high: two corners [m], ``(3,)``; infinite where it does not end.
    high: Array


@dataclass(frozen=True, eq=False)
class Cell:
    """What stands around an arm, in its base frame."""

    floor: float | None = 0.0  #: Height of the floor [m]; None if there is none to keep clear of.
    boxes: tuple[KeepOut, ...] = field(default=())  #: What the arm stays out of.
    clearance: float = CLEARANCE  #: Room to keep to each of them, and between links that are not neighbours [m].
    #: What the plane at the height `floor` is called: the mounting surface of an arm that does not stand on a floor.
    surface: str = FLOOR


def stands(robot: Robot) -> bool:
    """Return whether a robot stands on a floor: on a wall or a ceiling free fall points another way."""
    fall = np.array(robot.gravity)
    size = float(np.linalg.norm(fall))
    return bool(size > 0.0 and -fall[2] >= _STANDING * size)


def refuse_floor_above_base(floor: float) -> None:
    """Refuse a floor that the base of the robot would stand in."""
    if floor > 0.0:
        raise InputError(
            "the floor is above the base of the robot",
            parameter="floor",
            came=f"{floor * 1e3:g} mm",
            allowed="0 mm or less: its height in the base frame",
            cure="A robot on a pedestal has its floor below 0. Something higher than the base is a box to keep out of.",
        )


def refuse_floor_elsewhere(floor: float) -> None:
    """Refuse a floor that is not the mounting surface of a robot that hangs or is on a wall.

    Heights are along the z-axis of the base, which is not upright there: a plane at one of them is no floor.
    """
    if floor != 0.0:
        raise InputError(
            "the robot does not stand by its gravity, so no height in its base frame is that of a floor",
            parameter="floor",
            came=f"{floor * 1e3:g} mm",
            allowed="0 mm: the surface on which it is mounted, kept clear without saying so",
            cure="State the true floor as a box of the constraints (`keep_out`), in the base frame.",
        )


def boxes_of(given: Mapping[str, tuple[Array, Array]]) -> tuple[KeepOut, ...]:
    """Return boxes by their names, with their lowest and highest corners [m]."""
    return tuple(KeepOut(name, low, high) for name, (low, high) in given.items())
