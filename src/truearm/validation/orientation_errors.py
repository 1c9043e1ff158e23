"""Orientation errors in numbers that people know: a rotation vector, and ZXZ angles.

A rotation vector is one turn about one axis. ZXZ angles (Phi, Theta, Psi), ``R = Rz(Phi) Rx(Theta) Rz(Psi)``, are those
of Patel, sections 2.1.2 and 3.7, and of the Katana's controller; the document's formulas need arctangents of two
arguments. Where Theta is nearly 0 or 180 deg, Phi and Psi turn about one axis, and only their sum or difference means
anything: their errors are left out there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_from_quaternion, rotation_from_vector

#: Theta within this of 0 or 180 deg leaves Phi and Psi undetermined: an error is 20 times larger in them.
NEAR_LOCK: Final = math.radians(3.0)


@dataclass(frozen=True, eq=False)
class OrientationErrors:
    """Errors of orientations by their parts, predicted minus measured, in the robot's base frame."""

    reading: NDArray[np.intp]  #: Indices of the readings, ``(n,)``: those in the instrument's own frame.
    #: Rotation vector from the measured to the predicted orientation, about the axes of the robot's base [rad], ``(n,
    #: 3)``.
    vector: Array
    #: Errors of Phi, Theta and Psi [rad], within half a turn, ``(n, 3)``; Phi and Psi are NaN near 0 and 180 deg of
    #: Theta.
    zxz: Array

    @property
    def locked(self) -> int:
        """At how many readings Phi and Psi mean nothing."""
        return int(np.isnan(self.zxz[:, 0]).sum())


def orientation_errors(robot: Robot, data: Dataset, errors: Errors) -> OrientationErrors | None:
    """Return the orientation errors of readings by their parts; None if no orientation was read.

    Args:
        errors: Of the robot on the data.
    """
    if errors.orientation_errors is None or data.quaternion is None:
        return None
    reading = np.flatnonzero(np.isfinite(errors.orientation_errors).all(axis=1) & (data.against < 0))
    if not len(reading):
        return None
    to_base = robot.base.rotation.T
    vector = errors.orientation_errors[reading]
    measured = to_base @ rotation_from_quaternion(data.quaternion[reading])
    predicted = to_base @ rotation_from_vector(vector) @ rotation_from_quaternion(data.quaternion[reading])
    before, after = zxz_angles(measured), zxz_angles(predicted)
    apart = (after - before + np.pi) % (2.0 * np.pi) - np.pi
    locked = np.minimum(np.sin(before[:, 1]), np.sin(after[:, 1])) < math.sin(NEAR_LOCK)
    apart[locked, ::2] = np.nan
    return OrientationErrors(reading, vector @ to_base.T, apart)


def zxz_angles(R: Array) -> Array:
    """Return Phi, Theta and Psi of rotations ``(n, 3, 3)`` with ``R = Rz(Phi) Rx(Theta) Rz(Psi)`` [rad], ``(n, 3)``.

    Theta is between 0 and pi. Where it is 0 or pi, Psi is 0.
    """
    sine = np.hypot(R[:, 2, 0], R[:, 2, 1])
    lock = sine < 1e-12
    theta = np.arctan2(sine, R[:, 2, 2])
    phi = np.where(lock, np.arctan2(R[:, 1, 0], R[:, 0, 0]), np.arctan2(R[:, 0, 2], -R[:, 1, 2]))
    psi = np.where(lock, 0.0, np.arctan2(R[:, 2, 0], R[:, 2, 1]))
    return np.stack([phi, theta, psi], axis=1)
