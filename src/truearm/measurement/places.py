"""Where targets were read, configuration by configuration: as many places as readings, and no table of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.limits import refuse_beyond
from truearm.measurement.dataset import Dataset, IntArray
from truearm.modeling.chain import Array


@dataclass(frozen=True, eq=False)
class Places:
    """Positions in the order of their configurations, and in each of them in that of their targets."""

    configuration: IntArray  #: configuration, target: index of both, ``(places,)``; no two places have both alike.
    target: IntArray
    position: Array  #: Of a target that was read more than once at a configuration, the mean [m], ``(places, 3)``.
    targets: int  #: How many targets there are, read or not.

    def at(self, configuration: int) -> slice:
        """Return which places are of a configuration."""
        first, end = np.searchsorted(self.configuration, (configuration, configuration + 1)).tolist()
        return slice(first, end)

    def of(self, configuration: int, target: int) -> Array | None:
        """Return the position of a target at a configuration [m], ``(3,)``; None where it was not read."""
        here = self.at(configuration)
        found = here.start + int(np.searchsorted(self.target[here], target))
        return self.position[found] if found < here.stop and self.target[found] == target else None

    def usual(self) -> Array:
        """Return the median place of each target [m], ``(targets, 3)``; NaN where it was not read."""
        found = np.full((self.targets, 3), np.nan)
        for axis in range(3):
            names, medians = grouped_medians(self.target, self.position[:, axis])
            found[names, axis] = medians
        return found


def places_of(data: Dataset) -> Places:
    """Return where the targets of a dataset were read in the instrument's own frame."""
    there = np.flatnonzero(data.has_position)
    both = data.configuration[there] * max(len(data.targets), 1) + data.target[there]
    each, place, count = np.unique(both, return_inverse=True, return_counts=True)
    position = np.empty((len(each), 3))
    for axis in range(3):
        position[:, axis] = np.bincount(place, data.position[there, axis], len(each)) / count
    configuration, target = np.divmod(each, max(len(data.targets), 1))
    return Places(configuration, target, position, len(data.targets))


def constellation(data: Dataset) -> Array:
    """Return positions by configuration and target, ``(configurations, targets, 3)``; NaN where there is none.

    Of a target that was read more than once at a configuration, the mean.

    Raises:
        InputError: If there are too many of both: they are a table, however few of its cells are read.
    """
    refuse_beyond("places", data.configurations * len(data.targets), where=data.source)
    places = places_of(data)
    table = np.full((data.configurations, len(data.targets), 3), np.nan)
    table[places.configuration, places.target] = places.position
    return table


def grouped_medians(groups: IntArray, values: Array) -> tuple[IntArray, Array]:
    """Return each group that there is, in order, and the median of its values."""
    order = np.lexsort((values, groups))
    names, first, count = np.unique(groups[order], return_index=True, return_counts=True)
    ordered = values[order]
    return names, (ordered[first + (count - 1) // 2] + ordered[first + count // 2]) / 2
