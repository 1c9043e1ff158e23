"""Room between the arm and what stands around the device, with capsules.

The arm is a row of capsules from joint to joint as its model has them, all of one radius; the bars and the edges of
the base fixture are thin ones. Whether the arm hits itself, the table or a cable is not looked at.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.constraints.segments import segment_distance

#: Radius of a ballbar, and of an edge of the base fixture [m].
BAR_RADIUS: Final = 0.010
#: Radius of an arm the size of those in the document [m].
ARM_RADIUS: Final = 0.050


def arm_links(robot: Robot, joints: Array) -> tuple[Array, Array]:
    """Return both ends of the arm's links in the world [m], each ``(links, 3, n)``, from the base to the flange."""
    kinematics = robot.forward_kinematics(joints)
    origins = [
        np.broadcast_to(kinematics.origin(place), kinematics.position.shape)
        for place in robot.moving[: len(robot.joints)]
    ]
    points = np.array([*origins, kinematics.position])
    return points[:-1], points[1:]


def clearance(robot: Robot, joints: Array, starts: Array, ends: Array, arm_radius: float = ARM_RADIUS) -> Array:
    """Return the smallest room between the arm and bars [m], ``(n,)``; below zero they touch.

    Args:
        robot: The arm; its world is the frame of the bars.
        joints: Joint positions ``(n, joints)`` [rad or m].
        starts, ends: Both ends of every bar at each configuration [m], ``(bars, 3, n)``.
        arm_radius: Of the arm's links [m].
    """
    first, last = arm_links(robot, joints)
    apart = segment_distance(first[:, None], last[:, None], starts[None], ends[None])
    return np.asarray(apart.min(axis=(0, 1)) - arm_radius - BAR_RADIUS)
