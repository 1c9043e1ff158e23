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

    Parameters
    ----------
    p1, q1, p2, q2
        ``(..., 3, n)``, broadcast against each other.
    """
    u, v, w = q1 - p1, q2 - p2, p1 - p2
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e = _dot(u, w), _dot(v, w)
    square = a * c - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (b * e - c * d) / square, (a * e - b * d) / square
        inside = (square > 1e-12 * a * c) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
        between = np.linalg.norm(w + s[..., None, :] * u - t[..., None, :] * v, axis=-2)
    ends = [
        _to_segment(p1, p2, v, c),
        _to_segment(q1, p2, v, c),
        _to_segment(p2, p1, u, a),
        _to_segment(q2, p1, u, a),
    ]
    return np.asarray(np.minimum(np.min(np.broadcast_arrays(*ends), axis=0), np.where(inside, between, np.inf)))


def box_distance(p: Array, q: Array, low: Array, high: Array) -> Array:
    """Return the distance of segments ``p q``, each end ``(..., 3, n)``, from a box along the axes, ``(..., n)``.

    The square of the distance of a point from a box is convex along a line, so the nearest one is found by halving: to
    1/4096 of the segment's length, and never too near.

    Parameters
    ----------
    low, high
        Corners of the box, ``(3,)``; infinite where it does not end.
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


def _to_segment(point: Array, start: Array, along: Array, square: Array) -> Array:
    way = point - start
    part = np.clip(_dot(way, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(way - part[..., None, :] * along, axis=-2))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-2))
