"""A part of a large campaign that is small enough to be compared with a robot, and still tells as much of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset

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
    there = data.has_reading
    of, _ = np.divmod(
        np.unique(data.target[there] * data.configurations + data.configuration[there]), data.configurations
    )
    times = np.bincount(of, minlength=len(data.targets))
    often = np.argsort(-times, kind="stable")[:_MOST_TARGETS]
    often = np.sort(often[times[often] >= _FEWEST_CONFIGURATIONS])
    if not len(often):
        return None
    number = np.full(len(data.targets), -1, dtype=np.intp)
    number[often] = np.arange(len(often))
    some = data.of_readings(there & (number[data.target] >= 0))
    some = replace(some, target=number[some.target], targets=tuple(data.targets[t] for t in often.tolist()))
    seen = np.unique(some.configuration)
    each = equations_of(some) * (beside + PARAMETERS_OF_A_PLACE * len(often)) / len(seen)
    room = max(int(most / each), _FEWEST_CONFIGURATIONS)
    if room >= len(seen):
        return some.of_configurations(seen)
    return some.of_configurations(seen[np.linspace(0, len(seen) - 1, room).astype(np.intp)])


def evenly(data: Dataset, parameters: int, most: int) -> Dataset:
    """Return data of no more than `most` equations times parameters: those given, or configurations evenly spaced."""
    n = room = data.configurations
    part = data
    while room > 1 and (count := equations_of(part) * parameters) > most:
        room = max(1, min(room - 1, room * most // count))
        part = data.of_configurations(np.linspace(0, n - 1, room).round().astype(np.intp))
    return part


def equations_of(data: Dataset) -> int:
    """Return how many numbers were read that say something of the robot."""
    lengths = sum(int(np.isfinite(v).sum()) for v in (data.distance, data.height) if v is not None)
    return 3 * int(np.isfinite(data.position).all(axis=1).sum()) + 3 * int(data.has_orientation.sum()) + lengths
