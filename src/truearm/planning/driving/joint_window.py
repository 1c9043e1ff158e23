"""Where joints are drawn: within their limits, on their principal turn unless limits force another."""

from __future__ import annotations

import math

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.constraints.constraints import Constraints, limits_of


def joint_window(
    robot: Robot, constraints: Constraints | None = None, where: str = "constraints"
) -> tuple[Array, Array]:
    """Return lowest and highest joint positions to draw from [rad or m], each ``(joints,)``.

    A joint that can turn further than once is kept to one turn, from -180 to 180 deg where its limits have that: the
    arm reaches the same poses, and cables and hoses are not wound up.

    Raises:
        InputError: If the constraints leave a joint nothing, or name one that the robot does not have.
    """
    first, last = limits_of(robot, constraints, where)
    low, high = np.empty_like(first), np.empty_like(last)
    for k, joint in enumerate(robot.joints):
        lowest, highest = joint.range
        low[k], high[k] = max(lowest, first[k]), min(highest, last[k])
        if low[k] > high[k]:
            assert constraints is not None
            unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
            given = constraints.limits[k + 1]
            as_given = constraints.units.angle if joint.kind == "revolute" else constraints.units.length
            raise InputError(
                f"the limits of joint {k + 1} leave nothing of what the robot has",
                parameter="constraints",
                where=f"{where}, limits",
                came=f"{given[0]:g} to {given[1]:g} {as_given}",
                allowed=f"within {size * lowest:.6g} to {size * highest:.6g} {unit}",
                cure="Check the number of the joint, and the sign and the unit of its limits.",
            )
        if joint.kind == "revolute":
            low[k] = float(np.clip(-math.pi, low[k], max(low[k], high[k] - 2.0 * math.pi)))
            high[k] = min(high[k], low[k] + 2.0 * math.pi)
    return low, high


def on_principal_turn(robot: Robot, joints: Array) -> Array:
    """Return joint positions ``(n, joints)`` with every joint that turns on its turn of :func:`joint_window`."""
    low, high = joint_window(robot)
    turned = low + np.mod(joints - low, 2.0 * math.pi)
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    return np.where(turns & (turned <= high) & ((joints < low) | (joints > high)), turned, joints)
