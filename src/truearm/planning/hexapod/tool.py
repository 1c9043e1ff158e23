"""The tool of a robot for the device: three cups, calibrated or as its file has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truearm.errors import InputError, did_you_mean
from truearm.modeling.chain import Array
from truearm.modeling.parts import NO_PAYLOAD, Payload
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.shown import counted


def with_cups(robot: Robot, tool: str | None = None) -> tuple[Robot, Array]:
    """Return a robot that has the three cups as its targets, and their places on the flange.

    A calibrated robot has them already. Any other robot takes them from a tool of its file, with the tool's mass if it
    carries nothing yet, and stands in the origin.

    Args:
        robot: The arm.
        tool: Name of the tool; the first one if None.

    Returns:
        robot, cups: Cups T1, T2, T3 in the flange frame [m], ``(3, 3)``.

    Raises:
        InputError: If the robot has no such tool, or it has not three targets.
    """
    if tool is not None or not robot.targets:
        if tool is not None and tool not in robot.tools:
            raise InputError(
                "the robot has no such tool",
                where=robot.name,
                came=tool,
                allowed=", ".join(robot.tools) or "none",
                cure=did_you_mean(tool, robot.tools),
            )
        if robot.tools:
            chosen = robot.tools[tool] if tool is not None else next(iter(robot.tools.values()))
            robot = robot.with_frames(IDENTITY, chosen.targets)
            if robot.payload == NO_PAYLOAD:
                robot = replace(robot, payload=Payload(chosen.mass, chosen.cog))
    if len(robot.targets) != 3:
        raise InputError(
            "the device needs a tool with three cups",
            where=robot.name,
            came=counted(len(robot.targets), "target"),
            cure="Describe the tool under 'tools' in the robot file, its cups as three targets.",
        )
    values = robot.values
    cups = [[values[target.parameter(axis)] for axis in "xyz"] for target in robot.targets]
    return robot, np.array(cups)
