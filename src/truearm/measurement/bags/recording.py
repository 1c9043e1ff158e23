"""A bag as measurements: one configuration a standstill, one reading a target."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.bags.standstills import (
    Sighting,
    Standstill,
    find_standstills,
    lost_messages,
    missed_pauses,
    seen_at,
)
from truearm.measurement.bags.streams import JointStream, TargetStream
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.rows import Configurations, Readings, dataset_of
from truearm.modeling.controller import JointsOf
from truearm.shown import counted, listed

#: A smaller deviation is none: all samples are the same [m or rad].
_EXACT: Final = 1e-8


@dataclass(frozen=True, eq=False)
class Recording:
    """What was found in a bag."""

    joints: JointStream  #: joints, targets: its topics.
    targets: tuple[TargetStream, ...]
    standstills: tuple[Standstill, ...]  #: In order, one a configuration.
    missed: tuple[float, ...]  #: When the robot paused, or may have, without a standstill that can be used [s].
    lost: int  #: How many messages of the joints are missing between others.
    sightings: tuple[tuple[Sighting, ...], ...]  #: Of each target in each standstill.
    data: Dataset  #: The measurements.

    @property
    def declares_sigma(self) -> bool:
        """Whether the scatter at standstill could be told everywhere, so that the readings have deviations."""
        return self.data.sigma is not None


def found_in(
    bag: Path,
    joints: JointStream,
    targets: Sequence[TargetStream],
    *,
    references: Collection[str],
    prismatic: Collection[str],
    joints_are: JointsOf,
    still: float,
    hold: float,
    settle: float,
) -> Recording:
    """Return the standstills of a bag as measurements, numbered in the order of measurement.

    A pause that is no standstill takes a number too: where the robot came from is not known after it.

    Args:
        bag: The file, for messages.
        joints, targets: Its topics.
        references: Which targets stand beside the robot.
        prismatic: Which joints slide.
        joints_are: Whose joint positions they are.
        still, hold, settle: See :func:`~truearm.measurement.bags.standstills.find_standstills` and
            :func:`~truearm.measurement.bags.standstills.seen_at`.
    """
    stills = find_standstills(joints, still, hold)
    missed = missed_pauses(joints, stills)
    if len(missed) > len(stills):
        raise InputError(
            "most pauses of the robot are no standstills",
            parameter="hold",
            where=f"{bag}, topic {joints.topic}",
            came=f"{counted(len(stills), 'standstill')} and {counted(len(missed), 'other pause')}, at "
            f"{listed([f'{at:.1f} s' for at in missed])}",
            cure="They are shorter than `hold`, a joint moves more than `still` in them, or the joints were not "
            "recorded. Allow more if these were the stops, or wait longer.",
        )
    sightings = tuple(seen_at(stills, target, settle) for target in targets)
    rows = [
        (place, target, row[place])
        for place in range(len(stills))
        for target, row in zip(targets, sightings, strict=True)
    ]
    seen = [one for _, _, one in rows]
    exact = any(one.sigma < _EXACT or (one.sigma_rot or _EXACT) < _EXACT for one in seen)
    turned = any(one.quaternion is not None for one in seen)
    nothing = np.full(4, np.nan)
    readings = Readings(
        source=str(bag),
        lines=range(1, len(rows) + 1),
        configuration=np.array([place for place, _, _ in rows], dtype=np.intp),
        targets=[target.target for _, target, _ in rows],
        reference=np.array([target.target in references for _, target, _ in rows]),
        position=np.array([one.position for one in seen]),
        quaternion=np.array([nothing if one.quaternion is None else one.quaternion for one in seen])
        if turned
        else None,
        sigma=None if exact else np.array([one.sigma for one in seen]),
        sigma_rot=np.array([np.nan if one.sigma_rot is None else one.sigma_rot for one in seen])
        if turned and not exact
        else None,
    )
    kinds = tuple("prismatic" if name in prismatic else "revolute" for name in joints.names)
    labels = tuple(str(n + sum(at < s.start for at in missed)) for n, s in enumerate(stills, 1))
    positions = np.array([still.joints for still in stills])
    data = dataset_of(readings, Configurations(labels, positions, kinds, readings.configuration, joints_are))
    return Recording(joints, tuple(targets), stills, missed, lost_messages(joints), sightings, data)
