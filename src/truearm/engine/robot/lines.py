"""Joint axes as lines in space, and the frames that are laid on them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.parts import Joint

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot

#: Below this angle [rad] two axes are parallel: they part by less than 1 nm over the reach of a robot.
PARALLEL: Final = 1e-9
#: Below this angle [rad] two axes fix no frame that is worth it: where it stands would be uncertain.
_LEAST_ANGLE: Final = 0.1
#: Two opposite normals are as near to a direction if they are this square to it [cosine]: 10 deg, so that the small
#: errors of a real robot do not turn its frames round.
_UNDECIDED: Final = math.sin(math.radians(10.0))
#: Below this distance [m] two parallel axes are one line.
ONE_LINE: Final = 1e-12


@dataclass(frozen=True)
class JointAxis:
    """A joint's axis in the world: unit direction ``(3,)`` and a point on it [m] ``(3,)``."""

    joint: Joint
    along: Array
    point: Array

    def nearest(self, point: Array) -> Array:
        """Return the point of the line that is nearest to `point`."""
        return self.point + ((point - self.point) @ self.along) * self.along

    def angle(self, other: JointAxis) -> float:
        """Return the angle between two lines [rad], 0 to 90 deg."""
        return math.atan2(
            float(np.linalg.norm(np.cross(self.along, other.along))), abs(float(self.along @ other.along))
        )


def joint_axes(robot: Robot) -> list[JointAxis]:
    """Return the joint axes of a robot as it is now, joint positions at zero."""
    kinematics = robot.rigid.forward_kinematics(np.zeros((1, len(robot.joints))))
    places = {e.variable: i for i, e in enumerate(kinematics.elements) if e.variable is not None}
    return [
        JointAxis(joint, kinematics.axis(places[i])[:, 0], kinematics.origin(places[i])[:, 0])
        for i, joint in enumerate(robot.joints)
    ]


def at_zero(robot: Robot, elements: Iterable[Element]) -> Array:
    """Return the product of some of a robot's elements, joint variables at zero, ``(4, 4)``."""
    kinematics = Chain(tuple(elements)).forward_kinematics(np.zeros((len(robot.joints), 1)), robot.values)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = kinematics.matrix()[0], kinematics.position[:, 0]
    return matrix


def base_and_flange(robot: Robot) -> tuple[Array, Array]:
    """Return the base and the flange frame in the world, joint variables at zero, each ``(4, 4)``."""
    return at_zero(robot, robot.base_elements), at_zero(robot, robot.rigid.trunk.elements)


def first_frame(base: Array, axis: JointAxis) -> Array:
    """Return the frame on an axis, z along it, that is nearest to the base frame, ``(4, 4)``."""
    return frame(across(base[:3, :3], axis.along), axis.along, axis.nearest(base[:3, 3]))


def frame_between(axis: JointAxis, other: JointAxis) -> Array:
    """Return the frame that two axes fix: z along `axis`, x along ``axis x other``, on their common normal ``(4, 4)``.

    Raises:
        InputError: If the axes are parallel: then nothing says where along them the frame stands.
    """
    normal = np.cross(axis.along, other.along)
    sine = float(np.linalg.norm(normal))
    if sine < _LEAST_ANGLE:
        raise InputError(
            "two parallel axes do not define a frame",
            where=f"{axis.joint.name} and {other.joint.name}",
            came=f"{math.degrees(axis.angle(other)):.3g} deg apart",
            allowed=f"{math.degrees(_LEAST_ANGLE):.3g} deg or more",
        )
    apart = other.point - axis.point
    foot = axis.point + float(np.cross(apart, other.along) @ normal) / sine**2 * axis.along
    return frame(normal / sine, axis.along, foot)


def common_normal(axis: JointAxis, following: JointAxis, before: Array, origin: Array) -> tuple[Array, Array, Array]:
    """Return direction, start and end of a common normal of two axes.

    Args:
        before: The x direction of the frame on `axis`: of two opposite normals the one nearer to it is taken, so that
            joint zeros stay what they were; where both are as near, the one that points to `following`.
        origin: Origin of that frame, on `axis`.
    """
    normal = np.cross(axis.along, following.along)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL:
        foot, landing = origin, following.nearest(origin)
        distance = float(np.linalg.norm(landing - foot))
        if distance < ONE_LINE:
            return before, foot, landing
        normal = (landing - foot) / distance
    else:
        normal = normal / sine
        apart = following.point - axis.point
        foot = axis.point + float(np.cross(apart, following.along) @ normal) / sine * axis.along
        landing = following.point + float(np.cross(apart, axis.along) @ normal) / sine * following.along
    return nearer_sense(normal, before, landing - foot), foot, landing


def nearer_sense(normal: Array, before: Array, gap: Array) -> Array:
    """Return `normal` or its opposite: the one nearer to `before`, where both are as near the one along `gap`."""
    along = float(normal @ before)
    if abs(along) < _UNDECIDED:
        distance = float(gap @ normal)
        along = distance if abs(distance) > ONE_LINE else 1.0
    return normal if along > 0 else -normal


def across(rotation: Array, along: Array) -> Array:
    """Return the direction across `along` nearest to a frame's x axis, or its y axis if x lies along it."""
    for column in (0, 1):
        side = rotation[:, column] - (rotation[:, column] @ along) * along
        length = float(np.linalg.norm(side))
        if length > 0.5:
            break
    return np.asarray(side / length)


def turn(start: Array, end: Array, axis: Array) -> float:
    """Return the angle [rad] from one direction to another about an axis across both."""
    return math.atan2(float(np.cross(start, end) @ axis), float(start @ end))


def frame(x: Array, z: Array, origin: Array) -> Array:
    """Return the frame of these axes, ``(4, 4)``."""
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = x, np.cross(z, x), z, origin
    return matrix
