"""Single rows or blocks of positions in another unit of length, tried before any fit.

Rows in another unit pull a placement by all of them away. Sorted by how far from the instrument they were read, such
rows are the first or the last ones. So the robot is placed by each half of this order and by its middle, in each unit,
and that part counts from which most positions follow, in one unit or another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.identification.judging.slip_trials import Slip
from truearm.identification.start_values.frames import initial_frames
from truearm.measurement.dataset import Dataset
from truearm.measurement.mixed_lengths import FARTHEST, LENGTH_FACTORS, factors_of, lengths_noticed
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: Configurations that the robot is placed by at least, and among how many at most.
_FEWEST_PLACED: Final = 4
_MOST_PLACED: Final = 60
#: What makes positions right, in the unit that they came in first.
_UNITS: Final = (1.0, *(by for by, _ in LENGTH_FACTORS))
#: A position may be so many times as far off the placed nominal robot as half of all are.
_ALLOWED: Final = 20.0
#: Positions follow the robot where half of them are off by less than this share of how far half of those that it
#: predicts lie from their middle. Positions that are made so small that they are one point follow none.
_FOLLOWS: Final = 0.1
#: How often the robot is placed anew by all that it explains.
_ROUNDS: Final = 2


def mixed_length_slips(robot: Robot, data: Dataset) -> Iterator[Slip]:
    """Try another unit of length of those positions that it explains, where it explains no whole target.

    Args:
        robot: At the origin, with no targets.
    """
    some = data
    if data.configurations > _MOST_PLACED:
        some = data.of_configurations(np.linspace(0, data.configurations - 1, _MOST_PLACED).astype(np.intp))
    placed = _placed(robot, some)
    if placed is None:
        return
    predicted = _predicted(placed, data)
    factor = factors_of(data.position, predicted, _allowed(data, predicted))
    for t in range(len(data.targets)):
        mine = (data.target == t) & data.has_position
        if len(np.unique(factor[mine])) == 1:  # the unit of the target, not of rows
            factor[mine] = 1.0
    if (factor == 1.0).all():
        return
    words, at = lengths_noticed(data, factor)
    yield Slip("unit-length", words, replace(data, position=data.position * factor[:, None]), at)


def _placed(robot: Robot, data: Dataset) -> Robot | None:
    """Return the robot placed by the part of the data from which most positions follow; None without one."""
    read = np.flatnonzero(data.has_position)
    far = np.linalg.norm(data.position[read], axis=1)
    measured = np.unique(data.configuration[read])
    order = measured[np.argsort([np.median(far[data.configuration[read] == c]) for c in measured], kind="stable")]
    n = len(order)
    best, least = None, _FOLLOWS
    for part in (order[: n // 2], order[n - n // 2 :], order[n // 4 : n - n // 4]):
        if len(part) < _FEWEST_PLACED:
            return None
        mine = data.of_readings(data.has_position & np.isin(data.configuration, part))
        farthest = float(np.abs(mine.position).max())
        for by in (by for by in _UNITS if by * farthest <= FARTHEST or by <= 1.0):
            placed = initial_frames(robot, replace(mine, position=by * mine.position))
            predicted = _predicted(placed, data)[read]
            apart = np.nanmedian(np.linalg.norm(predicted - np.nanmedian(predicted, axis=0), axis=1))
            share = float(np.median(_gaps(data.position[read], predicted)) / apart) if apart > 0.0 else np.inf
            if share < least:
                best, least = placed, share
    if best is None:
        return None
    for _ in range(_ROUNDS):
        predicted = _predicted(best, data)
        factor = factors_of(data.position, predicted, _allowed(data, predicted))
        mended = replace(data, position=data.position * factor[:, None])
        near = np.linalg.norm(mended.position - predicted, axis=1) <= _allowed(data, predicted)
        best = initial_frames(robot, mended.of_readings(near & data.has_position))
    return best


def _predicted(placed: Robot, data: Dataset) -> Array:
    """Return where the placed robot has the target of each reading [m], ``(readings, 3)``; NaN if it has none."""
    predicted = np.full(data.position.shape, np.nan)
    for target in placed.targets:
        mine = data.target == data.targets.index(target.name)
        predicted[mine] = placed.world_poses(data.postures, target.name)[0][data.configuration[mine]]
    return predicted


def _gaps(position: Array, predicted: Array) -> Array:
    """Return how far off positions are in the unit that explains them best [m], ``(readings,)``."""
    gaps = [np.linalg.norm(by * position - predicted, axis=1) for by in _UNITS]
    return np.asarray(np.nan_to_num(np.min(gaps, axis=0), nan=np.inf))


def _allowed(data: Dataset, predicted: Array) -> float:
    read = data.has_position
    return _ALLOWED * float(np.median(_gaps(data.position[read], predicted[read])))
