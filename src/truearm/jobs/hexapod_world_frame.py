"""Where the base fixture of the hexapod device stands, from the joint positions at its cups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from truearm.errors import refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import array_argument, length_argument, lengths_argument, name_argument, robot_argument
from truearm.measurement.hexapod.geometry import DEVICE, side_names
from truearm.measurement.hexapod.touches import read_touches
from truearm.measurement.hexapod.world_frame import world_frame
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.hexapod.tool import with_cups
from truearm.results.hexapod import HexapodFrame


def hexapod_world_frame(
    robot: Robot | str | Path,
    touches: ArrayLike | str | Path,
    base: Sequence[float],
    *,
    target: str | None = None,
    tool: str | None = None,
    reach: float = DEVICE.reach,
) -> HexapodFrame:
    """Find the base fixture from the joint positions at its cups and the distances between them.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes.
    touches
        Joint positions at B1, B2 and B3 [rad or m], ``(3, joints)``, or a CSV file of them.
    base
        Measured distances B1-B2, B2-B3, B3-B1 [m].
    target
        The cup of the tool that touched; the first if None.
    tool
        Name of a tool of the robot file, with the three cups as its targets; its first if None.
    reach
        How far a distance may be from its nominal one to be measured [m].

    Raises
    ------
    InputError
        If the robot has no such tool or target, or a distance is beyond the ballbar's range or of no triangle.
    """
    device = replace(DEVICE, reach=length_argument(reach, "reach", 0.0))
    sides = np.array(lengths_argument(base, "base", 3))
    with refusals_of("base"):
        for name, side in zip(side_names("B"), sides.tolist(), strict=True):
            device.check(device.base, side, name, None)
    cup = None if target is None else name_argument(target, "target")
    fixture = None if tool is None else name_argument(tool, "tool")
    loaded = robot_argument(robot)
    with refusals_of("tool"):
        arm, _ = with_cups(loaded, fixture)
    joints = _touches_argument(touches, arm)
    with refusals_of("target"):
        position, _ = arm.world_poses(joints, arm.targets[0].name if cup is None else cup)
    stand = arm.base
    points = (position - np.array(stand.translation)) @ stand.rotation
    with refusals_of("touches"):
        return HexapodFrame(world_frame(points, sides), loaded.simulated_from)


def _touches_argument(touches: object, robot: Robot) -> Array:
    if isinstance(touches, str | Path):
        with refusals_of("touches"):
            return read_touches(path_argument(touches, "touches"), robot)
    allowed = f"joint positions at B1, B2 and B3, or a CSV file: shape (3, {len(robot.joints)})"
    return array_argument(touches, "touches", (3, len(robot.joints)), allowed)
