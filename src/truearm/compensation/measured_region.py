"""Which targets are reached with joint positions that calibration has not seen."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: How far beyond the measured range of a joint nothing new is to be expected, as a share of that range.
_MARGIN: Final = 0.1


def beyond_measured(robot: Robot, joints: Array) -> NDArray[np.bool_]:
    """Return which joints are well beyond the range in which they were measured, ``(n, joints)``; none if unknown.

    A turn more or less is the same posture.

    Args:
        joints: Joint positions of the model, ``(n, joints)`` [rad or m].
    """
    region = () if robot.proof is None else robot.proof.region
    if len(region) != len(robot.joints):
        return np.zeros(joints.shape, dtype=bool)
    low, high = np.array(region).T
    turn = np.where([joint.kind == "revolute" for joint in robot.joints], 2.0 * np.pi, 0.0)
    turned = joints + turn * np.arange(-2, 3)[:, None, None]
    away = np.maximum(np.maximum(low - turned, turned - high), 0.0).min(axis=0)
    return np.asarray(away > _MARGIN * (high - low))
