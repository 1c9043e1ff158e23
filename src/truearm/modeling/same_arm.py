"""Whether two robots are one arm, wherever both stand and whatever was found of one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.parameters import Parameter
from truearm.modeling.robot import Robot

#: At so many joint positions two arms are compared; drawn at random, so none is a special one.
_POSTURES: Final = 8
#: Flanges that are nearer to each other [m; of rotations: entries of the matrix] are at the same place.
_NEAR: Final = 1e-9


def fitted_from(calibrated: Robot, robot: Robot) -> bool:
    """Return whether a calibrated robot can be the fit of a robot.

    Both have the same table, and the values of the robot are those that the fit began with, or found, or those of the
    table. What counts is where the rigid arm has its flange, and how the controller counts the joints. Base, targets,
    fixtures, payload and masses do not.
    """
    if [joint.kind for joint in calibrated.joints] != [joint.kind for joint in robot.joints]:
        return False
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (_POSTURES, len(robot.joints)))
    if not _near(calibrated.controller.to_model(q), robot.controller.to_model(q)):
        return False
    table = _flange(calibrated, q, {})
    if not _near(table, _flange(robot, q, {})):
        return False
    began = {name: replace(p, value=p.nominal) for name, p in calibrated.known.items()}
    now = _flange(robot, q, robot.known)
    return any(
        _near(now, one) for one in (table, _flange(calibrated, q, began), _flange(calibrated, q, calibrated.known))
    )


def _flange(robot: Robot, joints: Array, known: Mapping[str, Parameter]) -> Array:
    """Return the flange of the rigid arm with some parameters in the base frame, ``(n, 3, 4)``."""
    arm = replace(robot, effect_names=(), wrench=None, known=known)
    position, rotation = arm.forward(joints)
    return np.concatenate([rotation, position[:, :, None]], axis=2)


def _near(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max(initial=0.0) < _NEAR)
