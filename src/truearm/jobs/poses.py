"""Poses of a named set: those of ISO 9283 in a cube, and those on a sphere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from truearm.errors import InputError, refusals_of
from truearm.jobs.arguments import (
    choice_argument,
    command_argument,
    files_of,
    joints_argument,
    length_argument,
    lengths_argument,
    numbers_argument,
    python_call,
    robot_argument,
    whole_argument,
)
from truearm.jobs.tip import tip_argument
from truearm.limits import limit
from truearm.measurement.readers.rows import QUATERNION_TOLERANCE
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_from_quaternion
from truearm.planning.poses.iso9283 import PLANES, Cube
from truearm.planning.poses.largest_cube import DIRECTIONS, Direction, largest_cube
from truearm.planning.poses.pose_sets import POSE_SETS, pose_set
from truearm.planning.poses.seven_lines import DOWN
from truearm.results.pose_set import PlannedPoses, places


def poses(
    robot: Robot | str | Path,
    set: str,
    *,
    centre: Sequence[float] | None = None,
    side: float | None = None,
    ahead: Direction = "+x",
    nearest: float = 0.0,
    floor: float = 0.0,
    plane: str = "C1-C2-C7-C8",
    count: int | None = None,
    target: str | None = None,
    tip: Sequence[float] | None = None,
    orientation: Literal["free", "down"] | Sequence[float] = "free",
    seed: int = 0,
    joints: JointsOf | None = None,
    out: str | Path | None = None,
    command: str | None = None,
) -> PlannedPoses:
    """Return the poses of a set, and the joint positions that reach them.

    Parameters
    ----------
    robot
        Nominal or calibrated, or what :func:`truearm.load_robot` takes.
    set
        ``p1-p5``, ``iso-cube``, ``diagonal``, ``118`` or ``sphere``.
    centre, side
        Of the cube in the robot's base frame [m]; None for the largest cube that the robot reaches. The sphere is
        about the centre, and its radius is half the side; it needs both.
    ahead
        Direction in which the largest cube is searched: ``+x``, ``-x``, ``+y`` or ``-y``.
    nearest, floor
        How far ahead of the base's origin, and how high above it, the largest cube begins [m].
    plane
        Which diagonal plane, for sets on one: ``C1-C2-C7-C8``, ``C2-C3-C8-C5``, ``C3-C4-C5-C6`` or ``C4-C1-C6-C7``.
    count
        How many poses, for ``diagonal``, ``118`` and ``sphere``; None for 25, 118 and 50.
    target
        Name of the target that goes to the poses; None for the flange, or `tip`.
    tip
        What goes to the poses, by its place in the flange frame [m].
    orientation
        ``free``, ``down`` (the tip's z axis against that of the base, its x axis along the base's), or a quaternion
        (w, x, y, z) of the tip in the base frame.
    seed
        Of the random configurations from which poses in any orientation are reached.
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    out
        CSV file for the configurations, with ``-poses.csv`` for the poses and a page beside it; None writes nothing.
    command
        How to run it again, for the page; None writes the call in Python.

    Raises
    ------
    InputError
        If there is no such set, the cube is given by halves, or the robot can go to none of the poses.
    """
    choice_argument(set, "set", dict.fromkeys(POSE_SETS), "set of poses")
    choice_argument(plane, "plane", dict.fromkeys(PLANES))
    choice_argument(ahead, "ahead", dict.fromkeys(DIRECTIONS))
    number = None if count is None else whole_argument(count, "count", 1, limit("poses"))
    seed = whole_argument(seed, "seed")
    inputs = files_of(robot)
    table = None if out is None else places(out, inputs, "out")[0]
    call = command_argument(command) or python_call(
        "poses",
        robot,
        set,
        centre=centre,
        side=side,
        ahead=ahead,
        nearest=nearest,
        floor=floor,
        plane=plane,
        count=count,
        target=target,
        tip=tip,
        orientation=orientation,
        seed=seed,
        joints=joints,
    )
    arm = robot_argument(robot)
    arm, target = tip_argument(arm, target, tip, "go to the poses")
    own = tip is None
    if not arm.targets:
        arm = arm.with_frames(arm.base, {"flange": (0.0, 0.0, 0.0)})
    turned = _rotation(orientation)
    joints_are = joints_argument(joints, arm)
    near, low = length_argument(nearest, "nearest"), length_argument(floor, "floor")
    cube = _cube(arm, set, centre, side, target, ahead, near, low)
    with refusals_of("count" if number is not None else "set"):
        made = pose_set(arm, set, cube, plane=plane, count=number, target=target, rotation=turned, seed=seed)
    found = PlannedPoses(arm, made, call, inputs, joints_are, own)
    if table is not None:
        found.save(table)
    return found


def _cube(
    arm: Robot,
    set: str,
    centre: Sequence[float] | None,
    side: float | None,
    target: str | None,
    ahead: Direction,
    nearest: float,
    floor: float,
) -> Cube:
    if (centre is None) != (side is None) or (set == "sphere" and centre is None):
        raise InputError(
            "the sphere needs its centre and its size"
            if set == "sphere"
            else "a cube needs its centre and its side, or neither of them",
            parameter="centre, side",
            came="only one of them" if (centre is None) != (side is None) else "neither",
            cure="Give both." if set == "sphere" else "Give both, or leave both out for the largest cube.",
        )
    if centre is None or side is None:
        with refusals_of("ahead"):
            return largest_cube(arm, target=target, ahead=ahead, nearest=nearest, floor=floor)
    middle = lengths_argument(centre, "centre", 3)
    with refusals_of("side"):
        return Cube(np.array(middle), length_argument(side, "side"))


def _rotation(orientation: object) -> Array | None:
    if isinstance(orientation, str):
        return choice_argument(orientation, "orientation", {"free": None, "down": DOWN})
    quaternion = np.array(numbers_argument(orientation, "orientation", 4, "free, down, or a quaternion w, x, y, z"))
    size = math.hypot(*quaternion)
    if abs(size - 1.0) > QUATERNION_TOLERANCE:
        raise InputError(
            "a quaternion (w, x, y, z) has length 1",
            parameter="orientation",
            came=f"length {size:.6g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
            cure="Divide its numbers by that length, or correct them.",
        )
    return np.asarray(rotation_from_quaternion(quaternion[None] / size)[0])
