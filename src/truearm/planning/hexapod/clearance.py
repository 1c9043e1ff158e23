"""Room between the arm and what stands around the device, with capsules.

The arm is a row of capsules from joint to joint as its model has them, all of one radius; the bars and the edges of
the base fixture are thin ones. Whether the arm hits itself, the table or a cable is not looked at.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: Radius of a ballbar, and of an edge of the base fixture [m].
BAR_RADIUS: Final = 0.010
#: Radius of an arm the size of those in the document [m].
ARM_RADIUS: Final = 0.050


def arm_links(robot: Robot, joints: Array) -> tuple[Array, Array]:
    """Return both ends of the arm's links in the world [m], each ``(links, 3, n)``, from the base to the flange."""
    sweep = robot.sweep(joints)
    origins = [
        np.broadcast_to(sweep.origin(place), sweep.position.shape) for place in robot.moving[: len(robot.joints)]
    ]
    points = np.array([*origins, sweep.position])
    return points[:-1], points[1:]


def clearance(robot: Robot, joints: Array, starts: Array, ends: Array, arm_radius: float = ARM_RADIUS) -> Array:
    """Return the smallest room between the arm and bars [m], ``(n,)``; below zero they touch.

    Parameters
    ----------
    robot
        The arm; its world is the frame of the bars.
    joints
        Readings ``(n, joints)`` [rad or m].
    starts, ends
        Both ends of every bar at each configuration [m], ``(bars, 3, n)``.
    arm_radius
        Of the arm's links [m].
    """
    first, last = arm_links(robot, joints)
    apart = segment_distance(first[:, None], last[:, None], starts[None], ends[None])
    return np.asarray(apart.min(axis=(0, 1)) - arm_radius - BAR_RADIUS)


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


def _to_segment(point: Array, start: Array, along: Array, square: Array) -> Array:
    way = point - start
    part = np.clip(_dot(way, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(way - part[..., None, :] * along, axis=-2))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-2))
