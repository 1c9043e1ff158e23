"""The IRB 120 as chapter 2 drives it, and a twin of it whose gears run out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from papers import regions
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import PERFECT

#: Sine a turn of each joint, amplitude and phase [deg]: the smallest that with the compliances of Table 2.7 leaves the
#: angular errors of Table 2.3 (study irb120-axes).
_RUN_OUT: Final = {1: (0.004, 150), 2: (0.032, 0), 3: (0.028, 195), 4: (0.044, 315), 5: (0.049, 270), 6: (0.061, 210)}
#: The least that Table 2.3 allows, by compliances between those that the document's three set-ups found: the same sines
#: [deg], and these compliances [rad/(N m)] (study irb120-axes).
_LEAST: Final = {1: (0.004, 150), 2: (0.024, 0), 3: (0.017, 180), 4: (0.010, 315), 5: (0.009, 240), 6: (0.024, 210)}
_BETWEEN: Final = {2: 37e-6, 3: 112e-6, 4: 462e-6, 5: 301e-6, 6: 243e-6}


@dataclass(frozen=True, eq=False)
class Truth:
    """Where a twin truly is at configurations that no calibration has seen."""

    joints: Array  #: ``(n, joints)``.
    flange: Array  #: ``T_world_flange``, ``(n, 4, 4)``.

    @classmethod
    def of(cls, twin: Twin, joints: Array) -> Truth:
        """Ask the twin."""
        bare = replace(twin, robot=twin.robot.with_frames(twin.robot.base, {"flange": (0.0, 0.0, 0.0)}))
        return cls(joints, np.asarray(bare.frames(joints)["flange"]))

    def places(self, point: tuple[float, ...]) -> Array:
        """Return where a point of the flange frame is in the world [m], ``(n, 3)``."""
        return np.asarray(self.flange[:, :3, 3] + self.flange[:, :3, :3] @ np.array(point))


@cache
def driven() -> Robot:
    """Return the nominal IRB 120 with the limits within which the document drives it."""
    robot = load_robot("irb120")
    low, high = (limits.tolist() for limits in regions.IRB120.limits)
    joints = zip(robot.joints, low, high, strict=True)
    return replace(robot, joints=tuple(replace(joint, limits=(a, b)) for joint, a, b in joints))


def running_out(twin: Twin, *, least: bool = False) -> Twin:
    """Return the twin with gears that run out as Table 2.3 needs it, or no more than it allows."""
    sines = _LEAST if least else _RUN_OUT
    joints = {
        number: replace(twin.joints.get(number, PERFECT), gear=((1, math.radians(amplitude), math.radians(phase)),))
        for number, (amplitude, phase) in sines.items()
    }
    if least:
        joints |= {number: replace(joints[number], compliance=of_joint) for number, of_joint in _BETWEEN.items()}
    return replace(twin, joints=joints)
