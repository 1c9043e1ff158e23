"""Rigid transforms: a translation and a unit quaternion (w, x, y, z); and how controllers write orientations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array, Element


def dot(a: Array, b: Array) -> Array:
    """Return the dot product of vectors ``(3, ...)`` along the first axis."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors ``(3, ...)`` along the first axis."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def rotation_from_quaternion(q: Array) -> Array:
    """Return rotation matrices ``(..., 3, 3)`` of unit quaternions ``(..., 4)``, scalar first."""
    w, x, y, z = np.moveaxis(np.asarray(q, float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternion_from_rotation(R: Array) -> Array:
    """Return unit quaternions ``(..., 4)``, scalar first and not negative, of rotations ``(..., 3, 3)``.

    All four candidates are formed and the one with the largest leading entry is taken (Shepperd 1978).
    """
    R = np.asarray(R, float)
    d = np.diagonal(R, axis1=-2, axis2=-1)
    t = d.sum(-1)
    a, b, c = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    e, f, g = R[..., 1, 0] + R[..., 0, 1], R[..., 0, 2] + R[..., 2, 0], R[..., 2, 1] + R[..., 1, 2]
    candidates = np.stack(
        [
            np.stack([1 + t, a, b, c], -1),
            np.stack([a, 1 + 2 * d[..., 0] - t, e, f], -1),
            np.stack([b, e, 1 + 2 * d[..., 1] - t, g], -1),
            np.stack([c, f, g, 1 + 2 * d[..., 2] - t], -1),
        ],
        axis=-2,
    )
    best = np.argmax(np.concatenate([t[..., None], d], -1), -1)
    q = np.take_along_axis(candidates, best[..., None, None], -2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    positive: Array = np.where(q[..., :1] < 0, -q, q)
    return positive


def rotation_vector(R: Array) -> Array:
    """Return rotation vectors ``(..., 3)`` [rad] of rotations ``(..., 3, 3)``, norm at most pi."""
    q = quaternion_from_rotation(R)
    s = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(s, q[..., :1])
    return q[..., 1:] * np.where(s > 1e-12, angle / np.maximum(s, 1e-12), 2.0)


def rotation_from_vector(v: Array) -> Array:
    """Return rotation matrices ``(..., 3, 3)`` of rotation vectors ``(..., 3)`` [rad], of any norm."""
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    part = 0.5 * np.sinc(angle / (2 * np.pi)) * v
    return rotation_from_quaternion(np.concatenate([np.cos(angle / 2), part], axis=-1))


def homogeneous(R: Array, p: Array) -> Array:
    """Return matrices ``(n, 4, 4)`` of rotations ``(n, 3, 3)`` and positions ``(n, 3)`` [m]."""
    matrix = np.zeros((len(p), 4, 4))
    matrix[:, :3, :3], matrix[:, :3, 3], matrix[:, 3, 3] = R, p, 1.0
    return matrix


def fixed_rotation(quaternion: Sequence[float]) -> tuple[Element, ...]:
    """Return the elements of a constant rotation, none for the identity."""
    w, *v = (float(x) for x in quaternion)
    s = float(np.linalg.norm(v))
    if s == 0.0:
        return ()
    axis = (v[0] / s, v[1] / s, v[2] / s)
    return (Element("R", value=2 * float(np.arctan2(s, w)), axis=axis),)


@dataclass(frozen=True)
class Transform:
    """A rigid transform ``T_parent_child``."""

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: Child origin in the parent [m].
    #: Unit quaternion (w, x, y, z) that turns child vectors into the parent.
    quaternion: tuple[float, float, float, float] = field(default=(1.0, 0.0, 0.0, 0.0))

    @classmethod
    def from_matrix(cls, R: Array, p: Array) -> Transform:
        """Make the transform with rotation `R` ``(3, 3)`` and translation `p` ``(3,)`` [m]."""
        w, x, y, z = map(float, quaternion_from_rotation(R))
        return cls((float(p[0]), float(p[1]), float(p[2])), (w, x, y, z))

    @property
    def rotation(self) -> Array:
        """Rotation matrix ``(3, 3)``."""
        return rotation_from_quaternion(np.array(self.quaternion))

    @property
    def matrix(self) -> Array:
        """Homogeneous matrix ``(4, 4)`` [m]."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.translation
        return matrix


IDENTITY: Final = Transform()


def rigid_motion(points: Array, places: Array) -> tuple[Array, Array]:
    """Return rotation and translation that bring points nearest to their places, in the sum of squares (Kabsch 1976).

    Args:
        points: In the moved frame [m], ``(k, 3)``.
        places: Where they are [m], ``(..., k, 3)``.

    Returns:
        R, p: ``(..., 3, 3)`` and ``(..., 3)``.
    """
    centre, middle = points.mean(axis=0), places.mean(axis=-2)
    H = np.swapaxes(places - middle[..., None, :], -1, -2) @ (points - centre)
    U, _, Vt = np.linalg.svd(H)
    U[..., :, 2] *= np.linalg.det(U @ Vt)[..., None]
    R = U @ Vt
    return R, middle - R @ centre


#: Two rotations that differ by less [rad] are the same: the rounding of the arithmetic behind them.
_SAME_ROTATION: Final = 1e-8
#: Below this cosine of the middle angle the other two turn about one axis.
_GIMBAL_LOCK: Final = 1e-6
_TURN: Final = 2.0 * np.pi


# Orientations as the controllers of several makers write them: quaternions, three kinds of angles, rotation vectors.
#
# Numbers stand for one orientation; an orientation can be written with many numbers. Of those, the ones nearest to
# given numbers are returned: the sign of a quaternion, whole turns of angles and what is free in gimbal lock stay as
# they are.
#
# ==================== ======================================== ==================================================
# orientation          numbers                                  rotation matrix
# ==================== ======================================== ==================================================
# quaternion           w, x, y, z (RAPID: q1 to q4)             of the unit quaternion
# angles about z y x   A, B, C (KRL)                            Rz(A) Ry(B) Rx(C)
# angles about x y z,  W, P, R (FANUC), Rx, Ry, Rz (Yaskawa)    Rz(R) Ry(P) Rx(W)
# fixed axes
# angles about x y z,  rx, ry, rz (VAL3)                        Rx(rx) Ry(ry) Rz(rz)
# moving axes
# rotation vector      rx, ry, rz (URScript)                    exp of the vector
# ==================== ======================================== ==================================================
#
# Sources: ABB, Technical reference manual RAPID, data type orient; KUKA, System Software, operating and programming
# instructions, FRAME; FANUC, R-30iB operator's manual, "position data", and Yaskawa, DX200 operator's manual, "user
# coordinates", for rotations about fixed axes; Staubli, VAL3 reference manual, type trsf; Universal Robots, script
# manual, "poses". They are cited from memory; known postures of each maker's robots are in the tests.
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
    solution = np.stack([first, middle, last], axis=1)
    other = np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=1)
    solution, other = (angles + _TURN * np.round((near - angles) / _TURN) for angles in (solution, other))
    other_is_nearer = np.abs(other - near).sum(axis=1) < np.abs(solution - near).sum(axis=1)
    return np.where((other_is_nearer & ~locked)[:, None], other, solution)


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
