"""How near an arm comes to each thing on ways, as a distance that holds all the way."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.planning.driving.collisions import CollisionCheck

#: By how much the stated distances may be too small [m], and by which part of themselves.
_TOLERANCE: Final = 1e-4
_PART: Final = 0.002


def nearest_on(check: CollisionCheck, joints: Array) -> dict[str, float]:
    """Return how near an arm comes to each thing [m] where it is driven through configurations ``(n, joints)``.

    Each way is halved as long as a part of it could be nearer than the nearest found, by how fast rooms change at most.
    The distances hold all the way: somewhere the arm comes as near but for 0.1 mm or 0.2 % of them.

    Returns:
        distances: By the floor, each box and the links, the smallest first. Negative where they touch.
    """
    whats = list(dict.fromkeys(check.whats))
    thing = np.array([whats.index(what) for what in check.whats], dtype=np.intp)
    starts, ends = (joints[:-1], joints[1:]) if len(joints) > 1 else (joints, joints)
    at = check.rooms(joints)
    at_start, at_end = (at[:, :-1], at[:, 1:]) if len(joints) > 1 else (at, at)
    least = np.full(len(whats), np.inf)
    _lower(least, thing, at)
    tolerance = np.zeros(len(whats))
    while len(starts):
        tolerance = np.maximum(_TOLERANCE, _PART * least)
        could = (at_start + at_end - check.spread(starts, ends)) / 2.0
        left = np.flatnonzero((could < (least - tolerance)[thing][:, None]).any(axis=0))
        starts, ends = starts[left], ends[left]
        middle = (starts + ends) / 2.0
        at_middle = check.rooms(middle)
        _lower(least, thing, at_middle)
        at_start, at_end = (
            np.concatenate([at_start[:, left], at_middle], axis=1),
            np.concatenate([at_middle, at_end[:, left]], axis=1),
        )
        starts, ends = np.concatenate([starts, middle]), np.concatenate([middle, ends])
    found = {what: float(least[k] - max(_TOLERANCE, _PART * least[k])) for k, what in enumerate(whats)}
    return dict(sorted(found.items(), key=lambda item: item[1]))


def _lower(least: Array, thing: NDArray[np.intp], rooms: Array) -> None:
    if rooms.shape[1]:
        np.minimum.at(least, thing, rooms.min(axis=1))
