"""Do the readings of each target fit another target of the robot: names that were exchanged between two campaigns."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.robot import Robot
from truearm.notices import Notice

#: Targets that are off by less need no explanation [m].
_PLACED_WITHIN: Final = 1e-3
#: Another assignment of the names explains the readings if they fit so many times better.
_LEAST_IMPROVEMENT: Final = 4.0
#: Targets among which names are looked for.
_MOST_TARGETS: Final = 20


def check_names(robot: Robot, data: Dataset, errors: Errors) -> list[Notice]:
    """Return a notice if positions of targets fit other targets of the robot far better.

    Args:
        robot: With base and targets.
        data: Readings of those.
        errors: Of the robot on them.
    """
    if errors.position is None or errors.position.mean < _PLACED_WITHIN:
        return []
    known = [target.name for target in robot.targets][:_MOST_TARGETS]
    read = data.has_position
    if len(known) < 2:
        return []
    places = {name: robot.world_poses(data.postures, name)[0] for name in known}
    meant = {}
    for t, name in enumerate(data.targets):
        mine = np.flatnonzero(read & (data.target == t))
        if not len(mine):
            continue
        off = {
            other: float(
                np.median(np.linalg.norm(places[other][data.configuration[mine]] - data.position[mine], axis=1))
            )
            for other in known
        }
        own = off.get(name, np.inf)
        best = min(off, key=lambda other: off[other])
        if best != name and off[best] * _LEAST_IMPROVEMENT < own:
            meant[name] = best
    if not meant:
        return []
    words = ", ".join(f"{name} is {other}" for name, other in meant.items())
    return [
        Notice(
            "targets-renamed",
            f"The readings fit other targets of the robot better: {words}. Give the targets the names that they had in "
            "the calibration.",
            "error",
        )
    ]
