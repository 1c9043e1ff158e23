"""Orientations that no robot attains: quaternions in another order, or frames that were taken for others.

A robot that is worth a test misses its orientation by tenths of a degree. What is off by more than ten degrees was
written, or tied to the base, in another way than it was read.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.transform import quaternion_from_rotation, rotation_from_quaternion

#: Further from its command than this no robot comes to rest [rad].
LIMIT: Final = math.radians(10.0)
#: So many rows tell whether another reading of the columns fits.
_TRIED: Final = 500


def refuse_far_orientations(
    attained: Array,
    commanded: Array,
    turn: Array,
    line: NDArray[np.intp],
    source: str,
    limit: float = LIMIT,
) -> None:
    """Refuse orientations that are further from their command than a limit.

    Args:
        attained: In the base frame, ``(n, 3, 3)``.
        commanded: ``(n, 3, 3)``, or one for all, ``(3, 3)``.
        turn: Rotation of the instrument's frame in the base frame, ``(3, 3)``: the attained are this one times what was
            read.
        line: Of each in the file, ``(n,)``.
        source: The file.
        limit: [rad].

    Raises:
        InputError: That names the first row, how many there are, and what was probably written instead, if that fits.
    """
    commanded = np.broadcast_to(commanded, attained.shape)
    off = _angle(attained, commanded)
    far = np.flatnonzero(off > limit)
    if not len(far):
        return
    row = int(far[0])
    few = far[:: max(1, len(far) // _TRIED)]
    raise InputError(
        f"{len(far)} of {len(off)} orientations further from the command than robots are",
        where=f"{source}, line {int(line[row])}, columns qw to qz",
        came=f"{math.degrees(off[row]):.1f} deg off",
        allowed=f"up to {math.degrees(limit):g} deg",
        cure=_cure(attained[few], commanded[few], turn, limit, 2 * len(far) > len(off)),
    )


def _angle(one: Array, other: Array) -> Array:
    """Return by how much rotations differ [rad], ``(n,)``."""
    trace = np.einsum("nij,nij->n", one, other)
    return np.asarray(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))


def _cure(attained: Array, commanded: Array, turn: Array, limit: float, most: bool) -> str:
    """Return what was probably written instead of what was read."""
    read = turn.T @ attained
    w, x, y, z = quaternion_from_rotation(read).T

    def fits(rotation: Array) -> bool:
        return bool((_angle(turn @ rotation, commanded) < limit).mean() > 0.9)

    if fits(rotation_from_quaternion(np.stack([z, w, x, y], axis=1))):
        return "The numbers seem to be in the order x, y, z, w: name the columns qx, qy, qz, qw."
    if fits(read.swapaxes(1, 2)):
        return "The inverse rotations fit: write the tip's orientation in the instrument's frame, not the other way."
    if not most:
        return "Look at the record of these rows: correct them, or measure the poses again."
    apart = commanded.swapaxes(1, 2) @ attained
    if (_angle(apart, np.broadcast_to(apart[0], apart.shape)) < limit).all():
        return (
            "All are turned alike: give the orientation of the plan's tip, not of the reflector or probe, and check "
            "the rotation of the alignment."
        )
    return "Check that the columns are the quaternion's w, x, y, z, the frame of the tip, and the alignment."
