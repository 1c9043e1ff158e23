"""Orientations as the controllers of several makers write them: quaternions, three kinds of angles, rotation vectors.

Numbers stand for one orientation; an orientation can be written with many numbers. Of those, the ones nearest to given
numbers are returned: the sign of a quaternion, whole turns of angles and what is free in gimbal lock stay as they are.

==================== ======================================== ==================================================
orientation          numbers                                  rotation matrix
==================== ======================================== ==================================================
quaternion           w, x, y, z (RAPID: q1 to q4)             of the unit quaternion
angles about z y x   A, B, C (KRL)                            Rz(A) Ry(B) Rx(C)
angles about x y z,  W, P, R (FANUC), Rx, Ry, Rz (Yaskawa)    Rz(R) Ry(P) Rx(W)
fixed axes
angles about x y z,  rx, ry, rz (VAL3)                        Rx(rx) Ry(ry) Rz(rz)
moving axes
rotation vector      rx, ry, rz (URScript)                    exp of the vector
==================== ======================================== ==================================================

Sources: ABB, Technical reference manual RAPID, data type orient; KUKA, System Software, operating and programming
instructions, FRAME; FANUC, R-30iB operator's manual, "position data", and Yaskawa, DX200 operator's manual, "user
coordinates", for rotations about fixed axes; Staubli, VAL3 reference manual, type trsf; Universal Robots, script
manual, "poses". They are cited from memory; known postures of each maker's robots are in the tests.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.transform import (
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
)

#: Two rotations that differ by less [rad] are the same: the rounding of the arithmetic behind them.
_SAME_ROTATION: Final = 1e-8
#: Below this cosine of the middle angle the other two turn about one axis.
_GIMBAL_LOCK: Final = 1e-6
_TURN: Final = 2.0 * np.pi


@dataclass(frozen=True)
class Orientation:
    """A way to write orientations."""

    name: str  #: Of the way.
    count: int  #: How many numbers it takes.
    #: Numbers ``(n, count)`` [rad, or the parts of unit quaternions] to rotation matrices ``(n, 3, 3)``.
    matrices: Callable[[Array], Array]
    #: Rotation matrices to those numbers that are nearest to others, ``(n, count)`` each.
    nearest: Callable[[Array, Array], Array]

    def numbers(self, R: Array, near: Array) -> Array:
        """Return the numbers ``(n, count)`` of rotations ``(n, 3, 3)``.

        Args:
            near: Numbers ``(n, count)`` to stay near to. Where they mean the same rotation they are returned as they
                are.
        """
        turned = np.linalg.norm(rotation_vector(self.matrices(near).swapaxes(1, 2) @ R), axis=1)
        return np.where(turned[:, None] < _SAME_ROTATION, near, self.nearest(R, near))


def _matrices_of_quaternions(numbers: Array) -> Array:
    return rotation_from_quaternion(numbers / np.linalg.norm(numbers, axis=1, keepdims=True))


def _nearest_quaternions(R: Array, near: Array) -> Array:
    q = quaternion_from_rotation(R)
    return np.where((q * near).sum(axis=1, keepdims=True) < 0.0, -q, q)


def turned_about(axis: int, angle: Array) -> Array:
    """Return the rotations ``(n, 3, 3)`` about axis 0, 1 or 2 by angles ``(n,)`` [rad]."""
    R = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[:, axis, axis] = 1.0
    R[:, i, i] = R[:, j, j] = np.cos(angle)
    R[:, j, i] = np.sin(angle)
    R[:, i, j] = -R[:, j, i]
    return R


def _matrices_of_zyx(numbers: Array) -> Array:
    return np.asarray(turned_about(2, numbers[:, 0]) @ turned_about(1, numbers[:, 1]) @ turned_about(0, numbers[:, 2]))


def _nearest_zyx(R: Array, near: Array) -> Array:
    upright = np.hypot(R[:, 0, 0], R[:, 1, 0])
    middle = np.arctan2(-R[:, 2, 0], upright)
    first = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    last = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    locked = upright < _GIMBAL_LOCK
    first = np.where(locked, near[:, 0], first)
    # With the first turn undone the rest is Ry(B) Rx(C), whose second row is 0, cos C, -sin C.
    undone = turned_about(2, -first) @ R
    last = np.where(locked, np.arctan2(-undone[:, 1, 2], undone[:, 1, 1]), last)
    one = np.stack([first, middle, last], axis=1)
    other = np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=1)
    one, other = (angles + _TURN * np.round((near - angles) / _TURN) for angles in (one, other))
    other_is_nearer = np.abs(other - near).sum(axis=1) < np.abs(one - near).sum(axis=1)
    return np.where((other_is_nearer & ~locked)[:, None], other, one)


def _matrices_of_fixed_xyz(numbers: Array) -> Array:
    return _matrices_of_zyx(numbers[:, ::-1])


def _nearest_fixed_xyz(R: Array, near: Array) -> Array:
    return _nearest_zyx(R, near[:, ::-1])[:, ::-1]


def _matrices_of_moving_xyz(numbers: Array) -> Array:
    # Rx(a) Ry(b) Rz(c) is the transpose of Rz(-c) Ry(-b) Rx(-a).
    return _matrices_of_zyx(-numbers[:, ::-1]).swapaxes(1, 2)


def _nearest_moving_xyz(R: Array, near: Array) -> Array:
    return np.asarray(-_nearest_zyx(R.swapaxes(1, 2), -near[:, ::-1])[:, ::-1])


def _nearest_vectors(R: Array, near: Array) -> Array:
    v = rotation_vector(R)
    angle, size = (np.linalg.norm(u, axis=1, keepdims=True) for u in (v, near))
    # No turn at all, or whole turns, about any axis: that of the given numbers.
    along_near = near / np.where(size > 0.0, size, 1.0)
    axis = np.where(angle > _SAME_ROTATION, v / np.where(angle > 0.0, angle, 1.0), along_near)
    turns = np.round(((near * axis).sum(axis=1, keepdims=True) - angle) / _TURN)
    return np.asarray(v + _TURN * turns * axis)


QUATERNION: Final = Orientation("quaternion", 4, _matrices_of_quaternions, _nearest_quaternions)
ZYX_ANGLES: Final = Orientation("angles about z y x", 3, _matrices_of_zyx, _nearest_zyx)
FIXED_XYZ_ANGLES: Final = Orientation("angles about x y z, fixed axes", 3, _matrices_of_fixed_xyz, _nearest_fixed_xyz)
MOVING_XYZ_ANGLES: Final = Orientation(
    "angles about x y z, moving axes", 3, _matrices_of_moving_xyz, _nearest_moving_xyz
)
ROTATION_VECTOR: Final = Orientation("rotation vector", 3, rotation_from_vector, _nearest_vectors)
