"""Rigid transforms as people write them: a translation and a unit quaternion (w, x, y, z)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from truearm.modeling.chain import Array, Element


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
    made = np.zeros((len(p), 4, 4))
    made[:, :3, :3], made[:, :3, 3], made[:, 3, 3] = R, p, 1.0
    return made


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
        made = np.eye(4)
        made[:3, :3], made[:3, 3] = self.rotation, self.translation
        return made


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
