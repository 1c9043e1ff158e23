"""The tip of a robot, seen from the robot's own base frame, in which paths and poses are planned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot


@dataclass(frozen=True, eq=False)
class TipState:
    """Where the tip is at some configurations, in the robot's base frame."""

    position: Array  #: [m], ``(n, 3)``.
    rotation: Array  #: ``(n, 3, 3)``.
    #: Linear and then angular velocity by the true joint variables [m, rad per rad or m], ``(n, 6, joints)``.
    jacobian: Array


class Tip:
    """The flange of a robot, or a target on it.

    Args:
        robot: With the parameter values and effects that shall hold.
        target: Name of the target; the flange if None.
    """

    def __init__(self, robot: Robot, target: str | None = None) -> None:
        if target is not None:
            robot.target(target)  # refuses an unknown one
        self.robot, self.target = robot, target
        base = robot.base
        self._rotation, self._origin = base.rotation, np.array(base.translation)

    def at(self, q: Array | Postures) -> TipState:
        """Return where the tip is with joint positions ``(n, joints)`` [rad or m], or in postures."""
        kinematics = self.robot.forward_kinematics(q, self.target)
        linear, angular = kinematics.jacobians(self.robot.moving[: len(self.robot.joints)])  # (joints, 3, n)
        to_base = self._rotation.T
        return TipState(
            (kinematics.position.T - self._origin) @ self._rotation,
            to_base @ kinematics.matrix(),
            np.concatenate([to_base @ part.transpose(2, 1, 0) for part in (linear, angular)], axis=1),
        )

    def moved(self, q: Array) -> tuple[Array, Array]:
        """Return positions ``(n, 3)`` [m] and their derivatives by the joint positions ``(n, 3, joints)`` alone."""
        position, linear = self.robot.moved_point(q, self.target)
        return (position - self._origin) @ self._rotation, self._rotation.T @ linear

    def positions(self, q: Array | Postures) -> Array:
        """Return positions alone, ``(n, 3)`` [m]."""
        position = self.robot.forward_kinematics(q, self.target).position
        return np.asarray((position.T - self._origin) @ self._rotation)
