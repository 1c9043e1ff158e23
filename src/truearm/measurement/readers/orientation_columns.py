"""Orientations in the columns of a table: quaternions, rotation vectors, and three angles about any axes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from truearm.measurement.readers.mapping_entries import AnglesEntry
from truearm.modeling.chain import Array
from truearm.modeling.orientations import turned_about
from truearm.modeling.transform import quaternion_from_rotation, rotation_from_vector


def quaternions_of_angles(angles: Array, entry: AnglesEntry) -> Array:
    """Return the quaternions (w, x, y, z) of angles ``(rows, 3)`` [rad], NaN where one is missing.

    Turns about axes that move along are multiplied from the left to the right, about fixed ones from the right to the
    left.
    """

    def rotations(whole: Array) -> Array:
        first, second, third = (
            turned_about("xyz".index(axis), column) for axis, column in zip(entry.about, whole.T, strict=True)
        )
        return np.asarray(first @ second @ third if entry.axes == "moving" else third @ second @ first)

    return _where_whole(angles, rotations)


def quaternions_of_vectors(vectors: Array) -> Array:
    """Return the quaternions (w, x, y, z) of rotation vectors ``(rows, 3)`` [rad], NaN where one is missing."""
    return _where_whole(vectors, rotation_from_vector)


def _where_whole(numbers: Array, rotations: Callable[[Array], Array]) -> Array:
    whole = np.isfinite(numbers).all(axis=1)
    made = np.full((len(numbers), 4), np.nan)
    if whole.any():
        made[whole] = quaternion_from_rotation(rotations(numbers[whole]))
    return made
