"""How far apart two line segments are, the cores of capsules, and how far a segment is from a box."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.chain import Array

_HALVINGS: Final = 12


def segment_distance(p1: Array, q1: Array, p2: Array, q2: Array) -> Array:
    """Return the distance between segments ``p1 q1`` and ``p2 q2``.

    The least of the distance from each end to the other segment, and of that between the lines where their feet lie
    inside both.

    Args:
        p1, q1, p2, q2: ``(..., 3, n)``, broadcast against each other.
    """
    u, v, w = q1 - p1, q2 - p2, p1 - p2
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e, apart = _dot(u, w), _dot(v, w), _dot(w, w)

    def squared(s: Array | float, t: Array | float) -> Array:
        """Return the square of the distance between the points at the shares s of the one and t of the other."""
        return np.asarray(apart + s * (a * s - 2.0 * b * t + 2.0 * d) + t * (c * t - 2.0 * e))

    on_u, on_v = 1.0 / np.where(a > 0, a, 1.0), 1.0 / np.where(c > 0, c, 1.0)
    nearest = squared(0.0, np.clip(e * on_v, 0.0, 1.0))
    np.minimum(nearest, squared(1.0, np.clip((e + b) * on_v, 0.0, 1.0)), out=nearest)
    np.minimum(nearest, squared(np.clip(-d * on_u, 0.0, 1.0), 0.0), out=nearest)
    np.minimum(nearest, squared(np.clip((b - d) * on_u, 0.0, 1.0), 1.0), out=nearest)
    sine = a * c - b * b
    crossing = sine > 1e-12 * a * c
    sine = np.where(crossing, sine, 1.0)
    s, t = (b * e - c * d) / sine, (a * e - b * d) / sine
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    np.minimum(nearest, np.where(inside, squared(s, t), np.inf), out=nearest)
    return np.asarray(np.sqrt(np.maximum(nearest, 0.0)))


def box_distance(p: Array, q: Array, low: Array, high: Array) -> Array:
    """Return the distance of segments ``p q``, each end ``(..., 3, n)``, from a box along the axes, ``(..., n)``.

    The square of the distance of a point from a box is convex along a line, so the nearest one is found by halving: to
    1/4096 of the segment's length, and never too near.

    Args:
        low, high: Corners of the box, ``(3,)``; infinite where it does not end.
    """
    along = q - p
    shape = (*p.shape[:-2], p.shape[-1])
    first, last = np.zeros(shape), np.ones(shape)
    for _ in range(_HALVINGS):
        middle = (first + last) / 2.0
        point = p + middle[..., None, :] * along
        rising = _dot(along, point - np.clip(point, low[:, None], high[:, None])) > 0
        first, last = np.where(rising, first, middle), np.where(rising, middle, last)
    ends = (p, q, p + ((first + last) / 2.0)[..., None, :] * along)
    apart = [np.linalg.norm(point - np.clip(point, low[:, None], high[:, None]), axis=-2) for point in ends]
    return np.asarray(np.min(apart, axis=0))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :] + a[..., 2, :] * b[..., 2, :])
