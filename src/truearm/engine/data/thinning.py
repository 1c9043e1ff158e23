"""Copies and repeated postures in a campaign, and a small part of it that still tells as much."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.dataset_fields import drawn_from

#: Readings at the same joint positions agree within this, whatever loads the arm and from wherever it came [m].
_LARGEST_CHANGE: Final = 5e-3

JUDGED_IN_PART: Final = Rule(
    "judged-in-part",
    "note",
    "the data are large: a part of them, evenly spaced, was compared with the robot, or is what the fit was judged by; "
    "the [limit](data.md#limits) of derivatives says how large",
)
DUPLICATES: Final = Rule("duplicates", "warning", "readings that repeat another one to the last digit", gravity=2)


def check_duplicates(data: Dataset) -> list[Notice]:
    """Say which readings repeat another one to the last digit."""
    pairs, at = [], list[tuple[str, str]]()
    for part in [data] if data.references is None else [data, data.references]:
        first: dict[tuple[int, bytes], int] = {}
        for reading in np.flatnonzero(part.has_position).tolist():
            key = (int(part.target[reading]), part.position[reading].tobytes())
            other = first.setdefault(key, reading)
            a, b = (part.labels[part.configuration[r]] for r in (other, reading))
            # A configuration that was drawn twice for a bootstrap counts twice because it shall.
            if other != reading and (a == b or drawn_from(a) != drawn_from(b)):
                pairs.append(f"{part.targets[key[0]]} at {a} and {b}")
                at += [(a, part.targets[key[0]]), (b, part.targets[key[0]])]
    if not pairs:
        return []
    return [
        DUPLICATES(
            f"{counted(len(pairs), 'reading')} repeat{'s' if len(pairs) == 1 else ''} another one to the last digit "
            f"(target at configurations): {listed(pairs)}. Rows were copied, or the instrument stood still: remove "
            f"{'it, it counts' if len(pairs) == 1 else 'them, they count'} twice.",
            at=tuple(dict.fromkeys(at)),
        )
    ]


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


def repeated_joints(data: Dataset) -> list[tuple[str, str]]:
    """Return the labels of configurations with the same joint positions to the last digit, and readings far apart.

    Each reading is compared with the first one of its target at these joint positions, so the time grows with the
    readings and not with their pairs. A configuration is named once, with the first one that it is far from.
    """
    posture = np.unique(data.joints, axis=0, return_inverse=True)[1].reshape(-1)
    readings = np.flatnonzero(data.has_position)
    readings = readings[np.argsort(data.configuration[readings], kind="stable")]
    of = data.configuration[readings]
    keys = np.column_stack([posture[of], data.target[readings]])
    _, first, key_of_row = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    other = first[key_of_row.reshape(-1)]
    place = data.position[readings]
    apart = (of != of[other]) & (np.linalg.norm(place - place[other], axis=1) > _LARGEST_CHANGE)
    pairs: dict[int, int] = {}
    for b, a in zip(of[apart].tolist(), of[other][apart].tolist(), strict=True):
        pairs[b] = min(a, pairs.get(b, a))
    return [(data.labels[a], data.labels[b]) for b, a in pairs.items()]


JOINTS_REPEATED: Final = Rule(
    "joints-repeated",
    "warning",
    "joint positions that repeat those of another configuration to the last digit, with readings more than 5 mm apart",
)


def repeated_joints_notices(data: Dataset, pairs: list[tuple[str, str]]) -> list[Notice]:
    """Say which joint positions were copied from another configuration."""
    if not pairs:
        return []
    words = [f"{b} (those of {a})" for a, b in pairs]
    return [
        JOINTS_REPEATED(
            f"{counted(len(pairs), 'configuration')} of {data.source} {'has' if len(pairs) == 1 else 'have'} the joint "
            f"positions of another one to the last digit, and readings more than {_LARGEST_CHANGE * 1e3:g} mm from "
            f"its readings: {listed(words)}. The joint positions were copied: fix them, or leave these configurations "
            "out.",
            at=tuple((label, "") for pair in pairs for label in pair),
        )
    ]


#: Parameters of a target or a fixture, at most.
PARAMETERS_OF_A_PLACE: Final = 6
#: A target that was read at fewer configurations tells nothing: its own place takes up what it says.
_FEWEST_CONFIGURATIONS: Final = 4
#: More targets tell nothing new of a robot.
_MOST_TARGETS: Final = 30


def thinned(data: Dataset, parameters: int, most: int) -> Dataset | None:
    """Return data whose derivatives are no more than `most`: those given if they are, else a part of them.

    The targets that were read at most configurations are kept, and of the configurations that read them so many, evenly
    spaced, as there is room for.

    Args:
        parameters: How many the robot has, without base, targets and fixtures.
        most: Largest number of equations times parameters.

    Returns:
        Dataset or None: None if the data are too large and no target was read at four configurations or more.
    """
    beside = parameters + PARAMETERS_OF_A_PLACE * (1 + len(data.fixtures))
    if equations_of(data) * (beside + PARAMETERS_OF_A_PLACE * len(data.targets)) <= most:
        return data
    present = data.has_reading
    of, _ = np.divmod(
        np.unique(data.target[present] * data.configurations + data.configuration[present]), data.configurations
    )
    times = np.bincount(of, minlength=len(data.targets))
    often = np.argsort(-times, kind="stable")[:_MOST_TARGETS]
    often = np.sort(often[times[often] >= _FEWEST_CONFIGURATIONS])
    if not len(often):
        return None
    number = np.full(len(data.targets), -1, dtype=np.intp)
    number[often] = np.arange(len(often))
    some = data.of_readings(present & (number[data.target] >= 0))
    some = replace(some, target=number[some.target], targets=tuple(data.targets[t] for t in often.tolist()))
    seen = np.unique(some.configuration)
    each = equations_of(some) * (beside + PARAMETERS_OF_A_PLACE * len(often)) / len(seen)
    largest = max(int(most / each), _FEWEST_CONFIGURATIONS)
    if largest >= len(seen):
        return some.of_configurations(seen)
    return some.of_configurations(seen[np.linspace(0, len(seen) - 1, largest).astype(np.intp)])


def evenly(data: Dataset, parameters: int, most: int) -> Dataset:
    """Return data of no more than `most` equations times parameters: those given, or configurations evenly spaced."""
    n = size = data.configurations
    part = data
    while size > 1 and (count := equations_of(part) * parameters) > most:
        size = max(1, min(size - 1, size * most // count))
        part = data.of_configurations(np.linspace(0, n - 1, size).round().astype(np.intp))
    return part


def equations_of(data: Dataset) -> int:
    """Return how many numbers were read that say something of the robot."""
    lengths = sum(int(np.isfinite(v).sum()) for v in (data.distance, data.height) if v is not None)
    return 3 * int(np.isfinite(data.position).all(axis=1).sum()) + 3 * int(data.has_orientation.sum()) + lengths
