"""What jobs are told of where an arm is driven: a floor, boxes, room to keep, and a safe configuration."""

from __future__ import annotations

import numpy as np

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import flag_argument, length_argument, numbers_argument
from truearm.modeling.robot import Robot
from truearm.planning.constraints.clearance import LEAST_CLEARANCE
from truearm.planning.constraints.constraints import Constraints, keep_out, read_constraints
from truearm.planning.driving.cell import (
    CLEARANCE,
    FLOOR,
    MOUNTING,
    Cell,
    boxes_of,
    refuse_floor_above_base,
    refuse_floor_elsewhere,
    stands,
)
from truearm.planning.driving.collisions import CollisionCheck
from truearm.planning.driving.home import checked_home, safe_configuration
from truearm.planning.driving.joint_window import joint_window
from truearm.planning.driving.ways import WayFinder
from truearm.units import sized_si


def constraints_argument(constraints: object) -> Constraints | None:
    """Return the constraints that were given, or that a file holds; None for None."""
    if constraints is None or isinstance(constraints, Constraints):
        return constraints
    with refusals_of("constraints"):
        return read_constraints(path_argument(constraints, "constraints"))


def cell_argument(
    robot: Robot,
    constraints: Constraints | None,
    where: str,
    floor: object = None,
    no_floor: object = False,
    clearance: object = None,
) -> Cell:
    """Return what stands around an arm.

    Args:
        robot: Whether it stands, hangs or is on a wall follows from its gravity.
        constraints, where: With boxes to keep out of, and the file that says so, for messages. Its floor, if it has one
            below the base, is the floor unless `floor` says another.
        floor: Height in the base frame [m]; None for 0: where the robot hangs or is on a wall, that is the surface on
            which it is mounted, and no other height is one of a floor.
        no_floor: Whether there is no floor and no mounting surface to keep clear of.
        clearance: Room to keep [m]; None for 50 mm.

    Raises:
        InputError: If the floor is above the base, or is none, as the robot does not stand, or both given and denied,
            or a length is none, or the clearance above 0 and below 1 mm.
    """
    without = flag_argument(no_floor, "no_floor")
    height = None if floor is None else length_argument(floor, "floor")
    if without and height is not None:
        raise InputError(
            "a floor is given and denied",
            parameter="floor, no_floor",
            came=f"{1e3 * float(height):g} mm",
            cure="Leave one of them out.",
        )
    standing = stands(robot)
    if height is not None and not standing:
        refuse_floor_elsewhere(height)
    elif height is not None:
        refuse_floor_above_base(height)
    elif not without and not standing:
        height = 0.0
    elif not without:
        height = 0.0
        if constraints is not None and constraints.floor is not None:
            height = min(0.0, sized_si(constraints.floor, constraints.units.length, f"{where}, floor"))
    room = CLEARANCE if clearance is None else length_argument(clearance, "clearance", 0.0)
    if 0.0 < room < LEAST_CLEARANCE:
        raise InputError(
            "so little room is kept by no arm whose thickness is estimated",
            parameter="clearance",
            came=f"{room * 1e3:g} mm",
            allowed=f"0 mm, or {LEAST_CLEARANCE * 1e3:g} mm and more",
            cure="Check its unit.",
        )
    boxes = boxes_of({} if constraints is None else keep_out(constraints, where))
    return Cell(height, boxes, room, FLOOR if standing else MOUNTING)


def finder_argument(
    robot: Robot, constraints: Constraints | None, where: str, cell: Cell, home: object = None
) -> WayFinder:
    """Return what finds the ways of an arm in a cell.

    Args:
        robot: With its targets.
        constraints, where: With limits, and the file that says so, for messages.
        cell: What is kept clear.
        home: The safe configuration by the model [rad or m]; None to find one.

    Raises:
        InputError: If a box holds the base or the safe configuration, that has not as many numbers as joints or lies
            beyond the limits, or none was found.
    """
    low, high = joint_window(robot, constraints, where)
    given = None
    if home is not None:
        count = len(robot.joints)
        given = np.array(numbers_argument(home, "home", count, f"{count}, one for each joint of {robot.name}"))
    check = CollisionCheck(robot, cell)
    at = safe_configuration(check, low, high) if given is None else checked_home(check, given, low, high)
    return WayFinder(check, at, low, high)
