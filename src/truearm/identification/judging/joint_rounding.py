"""Were the joint positions rounded: all of them multiples of a coarse step, and what is left as large as that makes it.

A plan in whole degrees is honest, and its joint positions are multiples too: so the joints must also err as a rounding
to that step makes them, by the step over the square root of 12, evenly spread.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.identification.judging.arrival_likelihood import ArrivalLikelihood, joints_as_far_off
from truearm.identification.judging.left_over import LeftOver
from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.notices import Notice

#: Steps that positions are rounded to, by the unit of the file, the largest first; smaller ones do nothing to a fit.
_STEPS: Final = {"deg": (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05), "rad": (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)}
#: Share of a step within which a position is a multiple of it.
_EXACT: Final = 1e-4
#: Share of the positions that are multiples, at least.
_MOST: Final = 0.99
#: Turning joints that move, and positions, without which nothing is said.
_LEAST_JOINTS: Final = 2
_LEAST_POSITIONS: Final = 30
#: What the joints seem to err by, over what rounding to the step makes them.
_ALIKE: Final = (0.6, 1.6)
#: Twice the gain in likelihood by errors of that size.
_LEAST_GAIN: Final = 20.0


def step_of(data: Dataset) -> tuple[float, str] | None:
    """Return the coarsest step, and its unit, that the positions of all turning joints are multiples of; None if fine.

    Joints that stand still say nothing.
    """
    moving = [i for i, kind in enumerate(data.joint_kinds) if kind == "revolute" and np.ptp(data.joints[:, i]) > 0.0]
    joints = data.joints[:, moving]
    if len(moving) < _LEAST_JOINTS or joints.size < _LEAST_POSITIONS:
        return None
    for unit, steps in _STEPS.items():
        shown = np.degrees(joints) if unit == "deg" else joints
        for step in steps:
            many = shown / step
            if np.mean(np.abs(many - np.round(many)) <= _EXACT) >= _MOST:
                return step, unit
    return None


def check_rounding(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if joint positions are multiples of a step and are off as rounding to it makes them.

    Args:
        fit: Of the data, or of a part of them.
    """
    found = step_of(data)
    if found is None or not data.has_position.any():
        return []
    step, unit = found
    by_rounding = (math.radians(step) if unit == "deg" else step) / math.sqrt(12.0)
    left = LeftOver.of(fit, data)
    seeming = joints_as_far_off(left)
    if not _ALIKE[0] * by_rounding <= seeming <= _ALIKE[1] * by_rounding:
        return []
    readings = ArrivalLikelihood.of(left)
    turning = np.array([joint.kind == "revolute" for joint in fit.robot.joints], dtype=float)
    rounded = readings.largest(joints=by_rounding**2 * turning)[1]
    if 2.0 * (rounded - readings.largest(joints=0.0 * turning)[1]) < _LEAST_GAIN:
        return []
    return [
        Notice(
            "joints-rounded",
            f"The joint positions are multiples of {step:g} {unit}, and the joints seem to err by "
            f"{math.degrees(seeming):.2g} deg, where rounding to that step makes {math.degrees(by_rounding):.2g} deg. "
            "Give them with all digits that the controller shows. If they were commanded like that, something else "
            "errs by as much.",
        )
    ]
