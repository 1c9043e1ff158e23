"""Whether an arm touches itself, with a capsule along the line from each joint to the next."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.planning.constraints.segments import segment_distance

_LENGTH: Final = 1e-3  # m: what is shorter is no link of its own


def skeleton(robot: Robot, q: Array | Postures) -> list[Array]:
    """Return the base's origin, the origins of the joints and of the flange in the world, each ``(n, 3)`` [m].

    What is shorter than 1 mm between two of them is left out.
    """
    kinematics = robot.forward_kinematics(q)
    start = np.broadcast_to(np.array(robot.base.translation)[:, None], kinematics.position.shape)
    points = [start, *(kinematics.origin(i) for i in robot.moving[: len(robot.joints)]), kinematics.position]
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
        segments.append((links[-1], robot.world_poses(q, target.name)[0]))
    lengths = [float(np.linalg.norm(b - a, axis=1).max(initial=0.0)) for a, b in segments]
    smallest = np.full(len(links[0]), np.inf)
    for i, j in combinations(range(len(segments)), 2):
        between = range(i + 1, min(j, flange))
        if i < flange and between and sum(lengths[k] for k in between) >= near:
            np.minimum(smallest, segment_distance(*(end.T for end in (*segments[i], *segments[j]))), out=smallest)
    return smallest
