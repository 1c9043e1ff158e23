"""An order of configurations on a short way, in which all joints move from one to the next if that is wanted.

Nearest neighbour first, then 2-opt: a stretch of the order is reversed wherever that shortens the way (Croes, "A method
for solving traveling-salesman problems", Operations Research 6, 1958). The way between two configurations is the
largest move of a joint, because joints move at the same time; where a joint moves too little, a penalty larger than the
whole way is added, so that such neighbours disappear if the exchanges can part them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array


def smallest_moves(joints: Array) -> Array:
    """Return the smallest move of a joint from each configuration ``(n, joints)`` to the next, ``(n - 1,)``."""
    return np.asarray(np.abs(np.diff(joints, axis=0)).min(axis=1, initial=np.inf))


def all_moving_order(joints: Array, least_move: float) -> NDArray[np.intp]:
    """Return an order of configurations, in which all joints move if one was found.

    Args:
        joints: ``(n, joints)``, one or more; the first stays the first.
        least_move: What every joint shall move at least from one to the next [rad, or m].

    Returns:
        order: Indices, ``(n,)``. Whether all joints move is for :func:`smallest_moves` of ``joints[order]`` to say.
    """
    cost = _costs(joints, least_move)
    return _exchanged(_nearest_neighbours(cost), cost)


def short_order(joints: Array) -> NDArray[np.intp]:
    """Return an order of configurations ``(n, joints)`` on a short way; the first stays the first."""
    return all_moving_order(joints, 0.0)


def _costs(joints: Array, least_move: float) -> Array:
    count = len(joints)
    longest, shortest = np.zeros((count, count)), np.full((count, count), np.inf)
    for reading in joints.T:
        move = np.abs(reading[:, None] - reading)
        np.maximum(longest, move, out=longest)
        np.minimum(shortest, move, out=shortest)
    return np.asarray(longest + (shortest < least_move) * (count * longest.max() + 1.0))


def _nearest_neighbours(cost: Array) -> NDArray[np.intp]:
    left = np.ones(len(cost), dtype=bool)
    order = np.zeros(len(cost), dtype=np.intp)
    for place in range(1, len(cost)):
        left[order[place - 1]] = False
        order[place] = int(np.argmin(np.where(left, cost[order[place - 1]], np.inf)))
    return order


def _exchanged(order: NDArray[np.intp], cost: Array) -> NDArray[np.intp]:
    """Reverse stretches of an open way while that makes it shorter."""
    count, improved = len(order), True
    while improved:
        improved = False
        for i in range(1, count - 1):
            before, first = order[i - 1], order[i]
            last, after = order[i + 1 :], order[i + 2 :]
            gain = cost[before, first] - cost[before, last]
            gain[:-1] += cost[last[:-1], after] - cost[first, after]
            j = int(np.argmax(gain))
            if gain[j] > 1e-9:
                order[i : i + j + 2] = order[i : i + j + 2][::-1]
                improved = True
    return order
