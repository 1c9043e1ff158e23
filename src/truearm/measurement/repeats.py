"""What stands twice in a campaign: readings and joint positions that were copied, postures that were visited again."""

from __future__ import annotations

import hashlib
import math
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.dataset_fields import drawn_from
from truearm.notices import Notice
from truearm.shown import counted, listed

#: Readings at the same joint positions agree within this, whatever loads the arm and from wherever it came [m].
_LARGEST_CHANGE: Final = 5e-3
#: A joint comes back to a posture within this [rad or m]: a hundredth of a degree or of a millimetre.
_SAME_ANGLE: Final = math.radians(0.01)
_SAME_LENGTH: Final = 1e-5


def check_duplicates(data: Dataset) -> list[Notice]:
    """Say which readings repeat another one to the last digit."""
    found, where = [], list[tuple[str, str]]()
    for part in [data] if data.references is None else [data, data.references]:
        first: dict[tuple[int, bytes], int] = {}
        for reading in np.flatnonzero(part.has_position).tolist():
            key = (int(part.target[reading]), part.position[reading].tobytes())
            other = first.setdefault(key, reading)
            a, b = (part.labels[part.configuration[r]] for r in (other, reading))
            # A configuration that was drawn twice for a bootstrap counts twice because it shall.
            if other != reading and (a == b or drawn_from(a) != drawn_from(b)):
                found.append(f"{part.targets[key[0]]} at {a} and {b}")
                where += [(a, part.targets[key[0]]), (b, part.targets[key[0]])]
    if not found:
        return []
    return [
        Notice(
            "duplicates",
            f"{counted(len(found), 'reading')} repeat{'s' if len(found) == 1 else ''} another one to the last digit "
            f"(target at configurations): {listed(found)}. Rows were copied, or the instrument stood still: remove "
            f"{'it, it counts' if len(found) == 1 else 'them, they count'} twice.",
            at=tuple(dict.fromkeys(where)),
        )
    ]


def copies(data: Dataset, some: IntArray, others: IntArray) -> list[str]:
    """Return the labels of those of `some` configurations that are copies of one of the `others`.

    Copies have the same joint positions and the same readings, all to the last digit.
    """
    values = [data.target[:, None], data.against[:, None], data.position]
    values += [v.reshape(len(v), -1) for v in (data.quaternion, data.distance, data.height) if v is not None]
    read: list[list[bytes]] = [[] for _ in data.labels]
    for reading, row in zip(np.flatnonzero(data.has_reading), np.hstack(values)[data.has_reading], strict=True):
        read[data.configuration[reading]].append(row.tobytes())
    content = [(joints.tobytes(), *sorted(rows)) for joints, rows in zip(data.joints, read, strict=True)]
    known = {content[c] for c in others if read[c]}
    return [data.labels[c] for c in some if content[c] in known]


def readings_digest(data: Dataset) -> str:
    """Return a SHA-256 of joint positions and readings, whatever their order, units, names and file.

    Values are rounded to a ten-thousandth of a millimetre and a hundred-thousandth of a degree, so that the same file
    written again is the same.
    """
    turning = np.array([kind == "revolute" for kind in data.joint_kinds])
    joints = np.where(turning, np.degrees(data.joints) * 10.0, data.joints * 1e3)
    values = [joints[data.configuration], data.position * 1e3]
    values += [v.reshape(len(v), -1) * 1e3 for v in (data.quaternion, data.distance, data.height) if v is not None]
    rows = np.round(np.hstack(values)[data.has_reading], 4) + 0.0
    return hashlib.sha256(b"".join(sorted(row.tobytes() for row in rows))).hexdigest()


def revisits(data: Dataset, some: IntArray, others: IntArray) -> list[str]:
    """Return the labels of those of `some` configurations at which the joints stand as at one of the `others`."""
    if len(some) == 0 or len(others) == 0:
        return []
    same = np.array([_SAME_ANGLE if kind == "revolute" else _SAME_LENGTH for kind in data.joint_kinds])
    scaled = data.joints / same
    return [data.labels[c] for c in some.tolist() if (np.abs(scaled[others] - scaled[c]).max(axis=1) <= 1.0).any()]


def repeated_joints(data: Dataset) -> list[tuple[str, str]]:
    """Return the labels of configurations with the same joint positions to the last digit, and readings far apart.

    Each reading is compared with the first one of its target at these joint positions, so the time grows with the
    readings and not with their pairs. A configuration is named once, with the first one that it is far from.
    """
    posture = np.unique(data.joints, axis=0, return_inverse=True)[1].reshape(-1)
    readings = np.flatnonzero(data.has_position)
    readings = readings[np.argsort(data.configuration[readings], kind="stable")]
    of = data.configuration[readings]
    what = np.column_stack([posture[of], data.target[readings]])
    _, first, which = np.unique(what, axis=0, return_index=True, return_inverse=True)
    other = first[which.reshape(-1)]
    place = data.position[readings]
    apart = (of != of[other]) & (np.linalg.norm(place - place[other], axis=1) > _LARGEST_CHANGE)
    pairs: dict[int, int] = {}
    for b, a in zip(of[apart].tolist(), of[other][apart].tolist(), strict=True):
        pairs[b] = min(a, pairs.get(b, a))
    return [(data.labels[a], data.labels[b]) for b, a in pairs.items()]


def repeated_joints_notices(data: Dataset, pairs: list[tuple[str, str]]) -> list[Notice]:
    """Say which joint positions were copied from another configuration."""
    if not pairs:
        return []
    words = [f"{b} (those of {a})" for a, b in pairs]
    return [
        Notice(
            "joints-repeated",
            f"{counted(len(pairs), 'configuration')} of {data.source} {'has' if len(pairs) == 1 else 'have'} the joint "
            f"positions of another one to the last digit, and readings more than {_LARGEST_CHANGE * 1e3:g} mm from "
            f"its readings: {listed(words)}. The joint positions were copied: mend them, or leave these configurations "
            "out.",
            at=tuple((label, "") for pair in pairs for label in pair),
        )
    ]
