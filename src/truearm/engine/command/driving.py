"""What jobs are told of how an arm is driven: its cell, plans to be replaced, and what goes to the poses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, refusals_of
from truearm.engine.base.files import exists, path_argument
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.units import sized_si
from truearm.engine.command.arguments import (
    choice_argument,
    file_for,
    flag_argument,
    length_argument,
    lengths_argument,
    numbers_argument,
)
from truearm.engine.motion.cell import (
    CLEARANCE,
    FLOOR,
    LEAST_CLEARANCE,
    MOUNTING,
    Cell,
    boxes_of,
    refuse_floor_above_base,
    refuse_floor_elsewhere,
    stands,
)
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import Constraints, joint_window, keep_out, read_constraints
from truearm.engine.motion.home import checked_home, safe_configuration
from truearm.engine.motion.ways import WayFinder
from truearm.engine.robot.robot import Robot


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
    required = CLEARANCE if clearance is None else length_argument(clearance, "clearance", 0.0)
    if 0.0 < required < LEAST_CLEARANCE:
        raise InputError(
            "so little room is kept by no arm whose thickness is estimated",
            parameter="clearance",
            came=f"{required * 1e3:g} mm",
            allowed=f"0 mm, or {LEAST_CLEARANCE * 1e3:g} mm and more",
            cure="Check its unit.",
        )
    boxes = boxes_of({} if constraints is None else keep_out(constraints, where))
    return Cell(height, boxes, required, FLOOR if standing else MOUNTING)


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
    home_joints = None
    if home is not None:
        count = len(robot.joints)
        home_joints = np.array(numbers_argument(home, "home", count, f"{count}, one for each joint of {robot.name}"))
    check = CollisionCheck(robot, cell)
    at = safe_configuration(check, low, high) if home_joints is None else checked_home(check, home_joints, low, high)
    return WayFinder(check, at, low, high)


# Plans that stand where another shall be written: what truearm wrote may be replaced, and that is told.
def plan_files_for(names: Collection[str], out: Path, *read: object) -> None:
    """Refuse places of files beside each other that cannot be, that others wrote or changed, or of another result.

    Args:
        names: Of all files that a plan of this kind has.
        out: One of them: the others stand beside it.
        read: What the job was given: none of these, as far as they are files, may be overwritten.
    """
    for name in names:
        file_for(out.with_name(name), *read, ours=True)
    for file_set in sets_in(out.parent):
        others = [name for name in file_set.files if name not in names]
        if others and any(name in file_set.files for name in names):
            raise InputError(
                "files of these names belong to another result there",
                parameter="out",
                where=str(out),
                came=f"written together with {others[0]}",
                cure="Choose another name.",
            )


def refuse_ways_of_another(ways: Path) -> None:
    """Refuse a place where the ways of another plan would stay beside one that has none."""
    if exists(ways):
        raise InputError(
            "the ways of another plan are there, and would stay beside this one, which has none",
            parameter="out",
            where=str(ways),
            cure="Choose another name, or remove that plan with its ways.",
        )


PLAN_REPLACED: Final = Rule(
    "plan-replaced",
    "warning",
    "another plan of truearm stood in the folder and was replaced. Measurements and programs by that one do not "
    "belong to this one",
    gravity=2,
)


def replaced_notices(folder: Path, name: str, text: str) -> tuple[Notice, ...]:
    """Return what to know of a plan that truearm wrote earlier, nobody changed, and another is written over.

    Args:
        folder: In which it stands.
        name: Of the file that holds the plan itself.
        text: What that file will hold.
    """
    for file_set in sets_in(folder):
        if name in file_set.files and exists(folder / name) and file_set.files[name] != hash_of(text.encode()):
            again = f", written by '{file_set.command}'" if file_set.command else ""
            return (
                PLAN_REPLACED(
                    f"Another plan stood in {folder / name}{again}, and was replaced. What was measured or programmed "
                    "by that plan does not belong to this one. To keep both, write them to different places."
                ),
            )
    return ()


#: What the tip of a robot is called whose target is given by its place alone.
TIP: Final = "tip"


def tip_argument(arm: Robot, target: str | None, tip: Sequence[float] | None, what: str) -> tuple[Robot, str | None]:
    """Return the robot with what goes to poses, and its name; None for the flange.

    Args:
        target, tip: As the job was given them: the name of a target, or a place in the flange frame [m]; None for
            neither.
        what: What one of them alone can do, for the refusal.

    Raises:
        InputError: If both are given, or there is no such target.
    """
    if target is not None and tip is not None:
        raise InputError(f"only one of them can {what}", parameter="target, tip", came=target, cure="Leave one out.")
    if target is not None:
        choice_argument(target, "target", {known.name: known for known in arm.targets})
    if tip is None:
        return arm, target
    return arm.with_frames(arm.base, {TIP: lengths_argument(tip, "tip", 3)}), TIP
