"""Whether an arm touches itself, with a capsule along the line from each joint to the next."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot

_LENGTH: Final = 1e-3  # m: what is shorter is no link of its own


def skeleton(robot: Robot, q: Array | Postures) -> list[Array]:
    """Return the base's origin, the origins of the joints and of the flange in the world, each ``(n, 3)`` [m].

    What is shorter than 1 mm between two of them is left out.
    """
    sweep = robot.sweep(q)
    start = np.broadcast_to(np.array(robot.base.translation)[:, None], sweep.position.shape)
    points = [start, *(sweep.origin(i) for i in robot.moving[: len(robot.joints)]), sweep.position]
    kept = [points[0].T]
    for point in points[1:]:
        if np.linalg.norm(point.T - kept[-1], axis=1).max(initial=0.0) > _LENGTH:
            kept.append(point.T)
    return kept


def smallest_clearance(robot: Robot, q: Array | Postures, near: float) -> Array:
    """Return the smallest distance between links that are not neighbours [m], ``(n,)``; infinite if there are none.

    Parameters
    ----------
    near
        Links that hang together by links shorter than this in all count as neighbours [m].
    """
    links = skeleton(robot, q)
    segments = [(links[i], links[i + 1]) for i in range(len(links) - 1)]
    flange = len(segments)
    for target in robot.targets:
        segments.append((links[-1], robot.poses(q, target.name)[0]))
    lengths = [float(np.linalg.norm(b - a, axis=1).max(initial=0.0)) for a, b in segments]
    smallest = np.full(len(links[0]), np.inf)
    for i, j in combinations(range(len(segments)), 2):
        between = range(i + 1, min(j, flange))
        if i < flange and between and sum(lengths[k] for k in between) >= near:
            np.minimum(smallest, _apart(*segments[i], *segments[j]), out=smallest)
    return smallest


def _apart(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return the distance between segments a-b and c-d, ``(n,)`` (Ericson 2004, section 5.1.9)."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (np.einsum("ni,ni->n", x, y) for x, y in ((u, u), (v, v), (u, v)))
    uw, vw = (np.einsum("ni,ni->n", x, w) for x in (u, v))
    cross = uu * vv - uv**2
    uu, vv = (np.maximum(x, 1e-18) for x in (uu, vv))
    along = np.where(cross > 1e-12 * uu * vv, (uv * vw - vv * uw) / np.maximum(cross, 1e-30), 0.0)
    s = np.clip(along, 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return np.asarray(np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1))
