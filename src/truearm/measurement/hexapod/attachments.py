"""How well a tool changer repeats the cups: configurations measured again after the tool was attached anew.

A tool that is attached anew is shifted and turned on the flange by a little, the same in the frame of the tool wherever
the robot stands. What moved between two attachments is therefore counted in the frame of the cups. Each displacement is
the sum of what is of its configuration, what is of its attachment, and the rest, which is of the robot's repeatability
and of the ballbar. How much of the variance is of the attachments follows from sums of squares with and without them
(Henderson 1953, method 3), so that configurations need not all be measured equally often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from truearm.measurement.hexapod.world_frame import plain_frame
from truearm.modeling.chain import Array

#: Joint positions nearer than this are those of one configuration [rad or m].
_SAME: Final = 1e-6


@dataclass(frozen=True, eq=False)
class ChangerRepeatability:
    """What was found of a tool changer, for the cups T1, T2 and T3."""

    changer: Array  #: Standard deviation of a coordinate that is due to the attachment [m], ``(3,)``.
    #: The same of what does not repeat though the tool stays on, robot and ballbar together [m], ``(3,)``; None if
    #: nothing tells it: it is contained in `changer` then.
    rest: Array | None
    mean: Array  #: mean, largest: distance between where a cup is with two attachments, over all pairs [m], ``(3,)``.
    largest: Array
    pairs: int  #: How many pairs of readings of one configuration with two attachments there are.
    compared: int  #: How many attachments are in them.

    def declared(self, attachments: Sequence[str]) -> Array:
        """Return the standard deviation of a coordinate of each cup in each row [m], ``(rows, 3)``.

        What an attachment moves is the same in all its rows, and the place of the tool is found from all rows. So it
        counts as it differs from the mean over the rows: by nothing where there is one attachment only, in full where
        each row has its own. With the shares ``w`` of the attachments in the rows, the variance of an attachment ``a``
        less that mean is ``1 - 2 w_a + sum(w ** 2)`` times that of the changer. Where the rest is not known it is
        contained in `changer`, which then counts in full.

        Args:
            attachments: Of each row.
        """
        if self.rest is None:
            return np.tile(self.changer, (len(attachments), 1))
        rows = np.array(attachments)
        _, of_row, counts = np.unique(rows, return_inverse=True, return_counts=True)
        share = counts / len(rows)
        part = np.maximum(1.0 - 2.0 * share + (share**2).sum(), 0.0)[of_row]
        return np.asarray(np.sqrt(self.rest**2 + part[:, None] * self.changer**2))


@dataclass(frozen=True, eq=False)
class Attachments:
    """The attachments of the tool in a sheet, two or more."""

    count: int  #: How many there were.
    found: ChangerRepeatability | None  #: How well they repeat; None if no configuration was measured with two of them.


def compared(cups: Array, joints: Array, places: Sequence[str], attachments: Sequence[str]) -> Attachments:
    """Compare the attachments of a tool.

    Args:
        cups: T1, T2 and T3 of each row in the frame of the fixture [m], ``(rows, 3, 3)``.
        joints: Joint positions [rad or m], ``(rows, joints)``; where they are the same, the configuration is.
        places: Where the fixture stood at each row: only readings of one place are compared.
        attachments: Of each row, two different ones or more.
    """
    groups: dict[tuple[object, ...], list[int]] = {}
    for row, place in enumerate(places):
        key = (place, *np.round(joints[row] / _SAME).astype(int).tolist())
        groups.setdefault(key, []).append(row)
    again = [rows for rows in groups.values() if len({attachments[row] for row in rows}) > 1]
    count = len(set(attachments))
    if not again:
        return Attachments(count, None)
    of_pairs = len({attachments[row] for rows in again for row in rows})
    # Readings of one configuration with the same attachment say what else does not repeat.
    again += [rows for rows in groups.values() if len(rows) > 1 and len({attachments[row] for row in rows}) == 1]
    moved = np.concatenate([(cups[r] - cups[r[0]]) @ plain_frame(cups[r[0]]).rotation for r in again])
    names = [attachments[row] for rows in again for row in rows]
    known = sorted(set(names))
    of_configuration = np.repeat(np.eye(len(again)), [len(rows) for rows in again], axis=0)
    of_attachment = np.array([[name == one for one in known] for name in names], float)
    both = np.hstack([of_configuration, of_attachment])
    apart = of_attachment - of_configuration @ np.linalg.lstsq(of_configuration, of_attachment, rcond=None)[0]
    without, left = _left(of_configuration, moved), _left(both, moved)
    freedom = int(np.linalg.matrix_rank(both)) - len(again)
    free = len(moved) - len(again) - freedom
    rest = left / free if free else np.zeros(3)
    changer = np.sqrt(np.maximum(without - left - freedom * rest, 0.0) / (apart**2).sum())
    distances = np.array(
        [
            np.linalg.norm(cups[a] - cups[b], axis=1)
            for rows in again
            for a, b in combinations(rows, 2)
            if attachments[a] != attachments[b]
        ]
    )
    return Attachments(
        count,
        ChangerRepeatability(
            changer=changer,
            rest=np.sqrt(rest) if free else None,
            mean=distances.mean(axis=0),
            largest=distances.max(axis=0),
            pairs=len(distances),
            compared=of_pairs,
        ),
    )


def _left(columns: Array, moved: Array) -> Array:
    """Return the variance of a coordinate of each cup times its degrees of freedom that columns leave, ``(3,)``."""
    flat = moved.reshape(len(moved), -1)
    rest = flat - columns @ np.linalg.lstsq(columns, flat, rcond=None)[0]
    return np.asarray((rest.reshape(moved.shape) ** 2).sum(axis=(0, 2)) / 3.0)
