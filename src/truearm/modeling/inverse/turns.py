"""Turns: which of the joint positions a whole turn apart a joint shall have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

_TURN: Final = 2 * np.pi
#: A joint this far beyond a limit still lies on it [rad or m].
_ON_LIMIT: Final = 1e-9


def limits(robot: Robot) -> tuple[Array, Array]:
    """Return lowest and highest position of each joint, ``(joints,)`` each; infinite where not known."""
    pairs = [joint.limits or (-np.inf, np.inf) for joint in robot.joints]
    low, high = np.array(pairs, float).T
    return low, high


def beyond_limits(robot: Robot, joints: Array, slack: float = _ON_LIMIT) -> NDArray[np.bool_]:
    """Return which joint positions ``(..., joints)`` lie beyond the limits by more than `slack` [rad or m]."""
    low, high = limits(robot)
    beyond: NDArray[np.bool_] = (joints < low - slack) | (joints > high + slack)
    return beyond


def nearest_turns(robot: Robot, joints: Array, seed: Array) -> Array:
    """Return the joint positions ``(n, joints)`` with every joint in the turn nearest to the seed within its limits.

    Where no turn lies within the limits, the one that passes them least is taken.

    Args:
        seed: ``(joints,)`` or ``(n, joints)`` [rad or m].
    """
    low, high = limits(robot)
    nearest = np.round((seed - joints) / _TURN)
    fewest = np.ceil((low - _ON_LIMIT - joints) / _TURN)
    most = np.floor((high + _ON_LIMIT - joints) / _TURN)
    # Without a turn within the limits, `most` ends below the lower and `fewest` above the upper limit.
    under, over = low - (joints + most * _TURN), joints + fewest * _TURN - high
    with np.errstate(invalid="ignore"):
        outside = np.where(under < over, most, fewest)
    turns = np.where(fewest <= most, np.clip(nearest, fewest, np.maximum(most, fewest)), outside)
    turning = np.array([joint.kind == "revolute" for joint in robot.joints])
    turned: Array = np.where(turning, joints + _TURN * turns, joints)
    return turned
