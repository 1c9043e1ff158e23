"""Which configurations stand alike, and the two parts of a campaign: what is trained on, and what judges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

#: A joint comes back to a posture within this [rad or m]: a hundredth of a degree or of a millimetre.
_SAME_ANGLE: Final = math.radians(0.01)
_SAME_LENGTH: Final = 1e-5


def postures_of(joints: NDArray[np.float64], kinds: Sequence[str]) -> NDArray[np.intp]:
    """Return for each configuration the index of the first one at which the joints stand alike, ``(n,)``.

    What stands like another one stands like all that stand like that.

    Args:
        joints: Joint positions [rad or m], ``(n, joints)``.
        kinds: Of the joints.
    """
    same = np.array([_SAME_ANGLE if kind == "revolute" else _SAME_LENGTH for kind in kinds])
    different, of_each = np.unique(joints / same, axis=0, return_inverse=True)
    # Those that are alike are near each other in any sum of the joints: only these are compared.
    weights = np.sqrt(np.arange(1.0, len(same) + 1.0))
    order = np.argsort(different @ weights)
    sorted_ = different[order]
    along, number = sorted_ @ weights, np.arange(len(sorted_))
    while True:
        before = number.copy()
        for lag in range(1, len(sorted_)):
            near = np.flatnonzero(along[lag:] - along[:-lag] <= weights.sum())
            if not len(near):
                break
            near = near[(np.abs(sorted_[near + lag] - sorted_[near]) <= 1.0).all(axis=1)]
            lower = np.minimum(number[near], number[near + lag])
            np.minimum.at(number, near, lower)
            np.minimum.at(number, near + lag, lower)
        if np.array_equal(number, before):
            number = number[np.argsort(order)][of_each.reshape(-1)]
            _, first, alike = np.unique(number, return_index=True, return_inverse=True)
            return np.asarray(first[alike.reshape(-1)])


def parted(
    joints: NDArray[np.float64], kinds: Sequence[str], count: int, seed: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which configurations are trained on, and which judge.

    Configurations at which the joints stand alike are in one part: a fit that has seen one has seen the others. So
    training may have some more or fewer than were asked for.

    Args:
        joints: Joint positions [rad or m], ``(n, joints)``.
        kinds: Of the joints.
        count: How many are trained on: all, or at most all but one.
        seed: Of the order in which they are taken.
    """
    order = np.random.default_rng(seed).permutation(len(joints))
    posture = postures_of(joints, kinds)[order]
    _, first, of_each = np.unique(posture, return_index=True, return_inverse=True)
    together = np.argsort(first[of_each.reshape(-1)], kind="stable")
    order, posture = order[together], posture[together]
    ends = np.flatnonzero(posture[1:] != posture[:-1]) + 1
    if count < len(order) and len(ends):
        count = int(ends[np.argmin(np.abs(ends - count))])
    return order[:count], order[count:]
