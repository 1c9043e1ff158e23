"""Poses and Jacobians of a robot as its users ask for them: in a frame by name, of checked joint positions."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from truearm.arrays import axes, number_array
from truearm.errors import InputError, did_you_mean
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

#: ``base``, the robot's base frame as it was identified; ``world``, the instrument's frame.
Frame = Literal["base", "world"]
FRAMES: Final[tuple[str, ...]] = ("base", "world")
#: By which joints are moved to find how deflections follow them [rad, m].
_DIFFERENCE: Final = 1e-5


def checked_frame(frame: object) -> None:
    """Refuse what is no name of a frame."""
    if isinstance(frame, str) and frame in FRAMES:
        return
    raise InputError(
        "there is no frame of this name",
        parameter="frame",
        came=frame,
        allowed=", ".join(FRAMES),
        cure=did_you_mean(frame, FRAMES) if isinstance(frame, str) else None,
    )


def checked_joints(robot: Robot, joints: ArrayLike, parameter: str = "joints") -> Array:
    """Return joint positions ``(n, joints)``, also of one configuration ``(joints,)``."""
    return number_array([joints] if axes(joints) == 1 else joints, parameter, ("n", len(robot.joints)))


def forward(robot: Robot, joints: ArrayLike | Postures, frame: Frame, target: str | None) -> tuple[Array, Array]:
    """Return poses as :meth:`truearm.Robot.forward` does."""
    checked_frame(frame)
    position, rotation = robot.world_poses(_postures(robot, joints), target)
    if frame == "world":
        return position, rotation
    base = robot.base
    return (position - np.array(base.translation)) @ base.rotation, base.rotation.T @ rotation


def jacobian(robot: Robot, joints: ArrayLike | Postures, frame: Frame, target: str | None) -> Array:
    """Return Jacobians as :meth:`truearm.Robot.jacobian` does."""
    checked_frame(frame)
    at = robot.loaded(_postures(robot, joints))
    kinematics = robot.forward_kinematics(at, target)
    if not robot.effects:
        found = robot.joint_jacobian(at, target)
    else:
        rates = _rates(robot, at)
        moved = np.flatnonzero(rates.any(axis=(1, 2)))
        by_variable = np.concatenate(kinematics.jacobians([robot.moving[i] for i in moved]), axis=1)
        found = np.einsum("vcn,vjn->ncj", by_variable, rates[moved])
    if frame == "world":
        return found
    turned = robot.base.rotation.T @ found.reshape(len(found), 2, 3, found.shape[2])
    return turned.reshape(found.shape)


def _postures(robot: Robot, joints: ArrayLike | Postures) -> Postures:
    if isinstance(joints, Postures):
        return replace(joints, joints=checked_joints(robot, joints.joints))
    return Postures(checked_joints(robot, joints))


def _rates(robot: Robot, at: Postures) -> Array:
    """Return how the variables of the trunk follow the joint positions, ``(variables, joints, n)``, loads included."""
    n, count = at.joints.shape
    rates = np.zeros((len(robot.moving), count, n))
    for joint in range(count):
        ahead, behind = (
            robot.variables(replace(at, joints=at.joints + way, loads=None), robot.values)
            for way in _DIFFERENCE * np.array([[1.0], [-1.0]]) * np.eye(count)[joint]
        )
        rates[:, joint] = (ahead - behind) / (2 * _DIFFERENCE)
    return rates
