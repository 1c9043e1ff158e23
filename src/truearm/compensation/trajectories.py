"""Joint positions changed so that the calibrated robot keeps to the wanted path (Patel, equation 5.22).

The calibrated robot predicts where the tip will be with the joint positions of the nominal motion. By how much it is
beside the path is turned into a change of the joint positions by the step of least norm, ``J^T (J J^T)^-1 (P_predicted
- P_desired)``. That is subtracted (the document does not say so; added, it would double the error), and the prediction
is made again until the tip is on the path. The norm counts rad, and m for sliding joints.

Joint positions are changed by fractions of a degree. The velocities and accelerations of the nominal motion are
therefore kept for the moments that bend the arm in motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.kinematics import NEAR_SINGULAR, reach
from truearm.modeling.inverse.pose_solver import Orientation
from truearm.modeling.inverse.redundancy_resolution import chosen_rows
from truearm.modeling.inverse.turns import beyond_limits
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_vector
from truearm.planning.paths.joint_motion import JointMotion
from truearm.planning.poses.tip import Tip

#: The tip is on the path within this [m].
AGREED: Final = 1e-9
_MOST_ROUNDS: Final = 20
#: A change of a joint this large corrects no calibration error [rad or m]: something else is wrong.
_LARGEST_CHANGE: Final = math.radians(10.0)


@dataclass(frozen=True, eq=False)
class JointCorrection:
    """Corrected joint positions, and what the calibrated robot predicts of them."""

    joints: Array  #: Joint positions to command [rad or m], ``(n, joints)``.
    change: Array  #: What was added to the joint positions of the nominal motion, ``(n, joints)``.
    #: before, after: predicted distance from the path without and with the correction [m], ``(n,)``. After is zero
    #: within 1e-9 unless an effect jumps (backlash where the moment changes its sign) and no joint position gives the
    #: point.
    before: Array
    after: Array
    rounds: int  #: How often the prediction was made again.


def path_error(robot: Robot, motion: JointMotion, desired: Array, target: str | None = None) -> Array:
    """Return where the robot will be beside the path (Patel, equation 5.21).

    Args:
        robot: Calibrated, or with the effects alone whose part is wanted.
        motion: What is commanded.
        desired: The path in the robot's base frame, ``(n, 3)`` [m].
        target: Name of the target that follows the path; the flange if None.

    Returns:
        error: Predicted less desired position, in the base frame, ``(n, 3)`` [m].
    """
    return Tip(robot, target).positions(motion.postures()) - _desired(motion, desired)


def corrected(
    robot: Robot,
    motion: JointMotion,
    desired: Array,
    target: str | None = None,
    *,
    orientation: Orientation = "free",
    rotation: Array | None = None,
) -> JointCorrection:
    """Return joint positions with which the calibrated robot keeps to the path.

    Args:
        robot: The calibrated robot, with its effects.
        motion: From :func:`truearm.planning.paths.joint_motion.joint_motion` of the nominal robot.
        desired: The path in the base frame, ``(n, 3)`` [m].
        target: Name of the target that follows the path; the flange if None.
        orientation, rotation: How much of the tip's orientation is kept beside its position, and which, ``(3, 3)``. The
            document corrects the position alone.

    Raises:
        InputError: If the arm is singular, has to turn by more than 10 deg, or beyond its limits: with time and joint.
    """
    tip, wanted = Tip(robot, target), _desired(motion, desired)
    length = reach(robot, target)
    kept = np.eye(3) if rotation is None else rotation
    rows = chosen_rows(orientation, kept, length)
    joints = best = motion.joints
    before = after = np.zeros(0)
    rounds = 0
    while True:
        state = tip.at(motion.postures(joints))
        error = state.position - wanted
        distance = np.linalg.norm(error, axis=1)
        if rounds == 0:
            before = after = distance
        nearer = distance < after
        best, after = np.where(nearer[:, None], joints, best), np.where(nearer, distance, after)
        turned = _turned(orientation, kept, state.rotation)
        missed = np.concatenate([error, turned], axis=1) @ rows.T
        if (np.linalg.norm(missed, axis=1) * length <= AGREED).all() or rounds == _MOST_ROUNDS:
            break
        joints = joints - _least_norm(rows @ state.jacobian, missed, motion)
        rounds += 1
        _check_change(joints - motion.joints, motion)
    _check_limits(robot, best, motion)
    return JointCorrection(best, best - motion.joints, before, after, rounds)


def _turned(orientation: Orientation, kept: Array, rotation: Array) -> Array:
    """Return by how much tips ``(n, 3, 3)`` are turned from the orientation to keep, ``(n, 3)`` [rad]."""
    if orientation == "full":
        return rotation_vector(rotation @ kept.T)
    if orientation == "axis":
        return np.asarray(np.cross(np.broadcast_to(kept[:, 2], (len(rotation), 3)), rotation[:, :, 2]))
    return np.zeros((len(rotation), 3))


def _least_norm(A: Array, missed: Array, motion: JointMotion) -> Array:
    """Return ``A^T (A A^T)^-1 missed``, ``(n, joints)``, for rows ``(n, rows, joints)`` in reach lengths."""
    weak = np.linalg.svd(A, compute_uv=False)[:, -1]
    if (weak < NEAR_SINGULAR).any():
        raise InputError(
            "the arm is in a singular posture, where positions cannot be corrected",
            where=_place(motion, int(np.argmax(weak < NEAR_SINGULAR))),
            cure="Move the path.",
        )
    normal = A @ A.swapaxes(1, 2)
    return np.asarray((A * np.linalg.solve(normal, missed[:, :, None])).sum(1))


def _check_change(change: Array, motion: JointMotion) -> None:
    far = np.argwhere(np.abs(change) > _LARGEST_CHANGE)
    if len(far):
        row, joint = far[0]
        raise InputError(
            "the joints would have to change by more than a calibration can account for",
            where=f"{_place(motion, int(row))}, {motion.joint_names[joint]}",
            allowed=f"{math.degrees(_LARGEST_CHANGE):g} deg",
            cure="Check that motion, path and target belong together.",
        )


def _check_limits(robot: Robot, joints: Array, motion: JointMotion) -> None:
    far = np.argwhere(beyond_limits(robot, joints))
    if len(far):
        row, joint = far[0]
        raise InputError(
            "the correction takes a joint beyond its limits",
            where=f"{_place(motion, int(row))}, {motion.joint_names[joint]}",
            cure="Move the path.",
        )


def _place(motion: JointMotion, row: int) -> str:
    return f"at {motion.time[row]:.4g} s (sample {row})"


def _desired(motion: JointMotion, desired: Array) -> Array:
    values = np.asarray(desired, float)
    if values.shape != (len(motion.time), 3) or not np.isfinite(values).all():
        raise InputError(
            "the path has to have a position for every sample of the motion",
            where="desired",
            came=f"an array of shape {values.shape}",
            allowed=f"({len(motion.time)}, 3), finite",
        )
    return values
