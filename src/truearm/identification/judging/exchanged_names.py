"""Targets whose names were exchanged at some configurations, however many.

Where names are exchanged, the line from one target to the other points the opposite way on the flange. Nothing else
turns it round: neither noise nor an error of the robot does. So no majority is needed, as it is where readings are
compared with a fit or with the usual distances, which half of the configurations pull half the way.
"""

from __future__ import annotations

from itertools import combinations
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.measurement.places import places_of
from truearm.measurement.rigid_tool import Suspect
from truearm.modeling.chain import Array

#: Among so many targets exchanged names are looked for.
_MOST: Final = 6
#: Fewer configurations with both targets tell nothing.
_LEAST: Final = 4
#: Lines are alike whose directions differ by a cosine of at least so much, and whose lengths by at most such a share.
_PARALLEL: Final = 0.95
_SAME_LENGTH: Final = 0.1
#: Share of the lines that must be alike: else they are no lines of a rigid tool.
_ALIKE: Final = 0.9


def exchanged_names(fit: Fit, data: Dataset) -> list[Suspect]:
    """Doubt readings of two targets that lie the other way round than at most configurations.

    Args:
        fit: Of the robot; it need not be a good one.
    """
    names = data.targets
    if not 2 <= len(names) <= _MOST:
        return []
    places = places_of(data)
    at = np.full((data.configurations, len(names), 3), np.nan)
    at[places.configuration, places.target] = places.position
    turned = fit.robot.world_poses(data.postures, names[0])[1]
    on_flange = np.einsum("cji,ctj->cti", turned, at)  # but for one shift at each configuration
    lines = {pair: on_flange[:, pair[1]] - on_flange[:, pair[0]] for pair in combinations(range(len(names)), 2)}
    suspects: dict[tuple[int, int], Suspect] = {}
    for (a, b), line in sorted(lines.items(), key=lambda one: -_length(one[1])):
        for c in _turned_round(line):
            if (c, a) not in suspects and (c, b) not in suspects:
                for one, other in ((a, b), (b, a)):
                    word = f"is target {names[other]}"
                    suspects[c, one] = Suspect("targets-swapped", data.labels[c], names[one], word)
    return [*suspects.values()]


def _length(line: Array) -> float:
    """Return the usual length of a line [m], 0 if it was never read."""
    read = np.isfinite(line).all(axis=1)
    return float(np.median(np.linalg.norm(line[read], axis=1))) if read.any() else 0.0


def _turned_round(line: Array) -> list[int]:
    """Return the configurations at which a line from one target to another points the opposite way.

    Args:
        line: In axes of the flange [m], ``(configurations, 3)``, NaN where one of the targets was not read.
    """
    read = np.flatnonzero(np.isfinite(line).all(axis=1))
    if len(read) < _LEAST:
        return []
    there, usual = line[read], _length(line)
    along = there @ np.linalg.svd(there, full_matrices=False)[2][0]
    length = np.linalg.norm(there, axis=1)
    alike = (np.abs(along) >= _PARALLEL * length) & (np.abs(length - usual) <= _SAME_LENGTH * usual)
    if alike.mean() < _ALIKE:
        return []
    mostly = 1.0 if np.sum(along[alike] > 0.0) > alike.sum() / 2.0 else -1.0
    return [int(c) for c in read[alike & (mostly * along < 0.0)]]
