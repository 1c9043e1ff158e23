"""Are new readings in the frames of the calibration, and of this robot at all."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.identification.judging.implausible import LARGEST_SHARE_LEFT
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.notices import Notice

#: Readings that are off by less need no explanation [m].
_NEAR: Final = 1e-4
#: Another frame explains the errors if so many times less is left in it.
_LEAST_IMPROVEMENT: Final = 4.0
#: Configurations below which a frame can be found for anything.
_FEWEST: Final = 6
#: Share of the extent of the readings that they must have in a second direction: a line has no orientation.
_LEAST_WIDTH: Final = 1e-3


def check_frames(robot: Robot, data: Dataset, errors: Errors) -> list[Notice]:
    """Return a notice if readings agree with the robot only in another frame, or hardly in any.

    The frame is found by the closed form of Kabsch (1976).

    Parameters
    ----------
    robot
        With base and targets.
    data
        Readings of those.
    errors
        Of the robot on them.
    """
    off = np.linalg.norm(errors.position_errors, axis=1)
    read = np.flatnonzero(np.isfinite(off) & (data.against < 0))
    if len(read) == 0 or float(off[read].mean()) <= _NEAR:
        return []
    reach = float(np.linalg.norm(robot.with_frames(Transform(), {}).world_poses(data.postures)[0], axis=1).max())
    beyond = float(np.median(off[read])) > LARGEST_SHARE_LEFT * reach
    measured, error = data.position[read], errors.position_errors[read]
    if len(np.unique(data.configuration[read])) >= _FEWEST:
        found = _moved(measured, measured + error)
        if found is not None:
            left, shift, turn = found
            if left * _LEAST_IMPROVEMENT < float(off[read].mean()) and left <= LARGEST_SHARE_LEFT * reach:
                return [_other_frame(float(off[read].mean()), left, shift, turn, beyond=beyond)]
    if not beyond:
        return []
    return [
        Notice(
            "implausible",
            f"Half of the readings are off by more than {float(np.median(off[read])) * 1e3:.3g} mm, where the arm "
            f"reaches {reach * 1e3:.0f} mm (allowed: {LARGEST_SHARE_LEFT:g} of that): these are not readings of this "
            "robot, or their units, joints or targets are mistaken. Look at them with 'truearm check'.",
            "error",
        )
    ]


def _other_frame(mean: float, left: float, shift: float, turn: float, *, beyond: bool) -> Notice:
    alike = "" if beyond else ", or the poses are so near each other that the robot errs alike at all of them"
    return Notice(
        "frames-differ",
        f"The readings agree with the robot in another frame: moved by {shift * 1e3:.3g} mm at their middle and turned "
        f"by {math.degrees(turn):.2g} deg as a whole, they are off by {left * 1e3:.3g} mm instead of {mean * 1e3:.3g}. "
        f"The instrument or the robot's base was moved since the calibration{alike}. Find the new frames with "
        "'truearm calibrate' and `model=frames`, or compare distances with 'truearm distances'.",
        "error" if beyond else "warning",
    )


def _moved(points: Array, onto: Array) -> tuple[float, float, float] | None:
    """Return the mean distance [m] left after the best motion of points onto others, its shift and its angle.

    None where the points lie on a line, which can turn about itself.
    """
    middle, there = points.mean(axis=0), onto.mean(axis=0)
    if np.linalg.svd(points - middle, compute_uv=False)[1] < _LEAST_WIDTH * float(np.abs(points - middle).max()):
        return None
    U, _, Vt = np.linalg.svd((points - middle).T @ (onto - there))
    proper = np.diag([1.0, 1.0, math.copysign(1.0, np.linalg.det(U @ Vt))])
    R = Vt.T @ proper @ U.T
    left = np.linalg.norm((points - middle) @ R.T + there - onto, axis=1)
    angle = math.acos(float(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)))
    return float(left.mean()), float(np.linalg.norm(there - middle)), angle
