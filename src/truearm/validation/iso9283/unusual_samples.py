"""Samples that lie apart from those about them, as in no other cycle: perhaps the robot, perhaps the instrument."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.modeling.chain import Array
from truearm.validation.iso9283.streams import noise_of

#: A sample is unusual if it lies so many times further from what the samples about it say than is usual in a cycle
#: there, and so many standard deviations of noise besides.
_TIMES, _NOISE = 4.0, 7.0
#: What is usual there is seen in stretches of so many samples, and of so much of the way at least.
_STRETCH, _LEAST_STRETCH = 3.0, 0.0025
#: Beside a longer gap than this many usual steps, samples say too little of one another.
_GAP = 1.6
#: Fewer cycles do not show what is usual.
_LEAST_CYCLES = 3
#: Of samples so near to each other the one that lies furthest apart is named.
_NEAR = 3


@dataclass(frozen=True)
class Unusual:
    """A sample that lies apart.

    Attributes
    ----------
    cycle, sample
        Which, from 0.
    distance
        From where the two samples before and the two behind it say that it should be [m].
    """

    cycle: int
    sample: int
    distance: float


def unusual_samples(times: Sequence[Array], positions: Sequence[Array], places: Sequence[Array]) -> list[Unusual]:
    """Return samples that lie apart from those about them, as none does there in half of the cycles.

    Each sample is compared with a cubic through the two before it and the two behind it. Where the tip turns a corner
    or begins to move that is off in every cycle, and nothing is unusual.

    Parameters
    ----------
    times, positions
        Of each cycle [s], ``(n,)``, and [m], ``(n, 3)``.
    places
        What tells where in the cycle a sample is, such as the arc length of its foot, ``(n,)`` each.
    """
    if len(times) < _LEAST_CYCLES:
        return []
    away = [_apart(time, position) for time, position in zip(times, positions, strict=True)]
    low, high = min(float(place.min()) for place in places), max(float(place.max()) for place in places)
    steps = np.concatenate([np.abs(np.diff(place)) for place in places])
    moving = steps[steps > 0.1 * (high - low) / max(map(len, times))]
    width = max(_STRETCH * float(np.median(moving)) if len(moving) else 0.0, _LEAST_STRETCH * (high - low), 1e-12)
    count = int((high - low) / width) + 1
    most = np.zeros((len(times), count + 2))
    stretch = [1 + np.minimum(((place - low) / width).astype(np.intp), count - 1) for place in places]
    for cycle, where in enumerate(stretch):
        np.maximum.at(most[cycle], where, away[cycle])
    about = np.maximum(np.maximum(most[:, :-2], most[:, 2:]), most[:, 1:-1])
    usual = np.median(about, axis=0)
    noise = float(np.median([noise_of(position) for position in positions]))
    found = []
    for cycle, where in enumerate(stretch):
        beyond = away[cycle] > _TIMES * usual[where - 1] + _NOISE * noise
        if not beyond.any():
            continue
        rows = np.flatnonzero(beyond)
        for group in np.split(rows, np.flatnonzero(np.diff(rows) > _NEAR) + 1):
            worst = int(group[away[cycle][group].argmax()])
            found.append(Unusual(cycle, worst, float(away[cycle][worst])))
    return found


def _apart(time: Array, position: Array) -> Array:
    """Return how far each sample is from a cubic through its neighbours, over what noise makes of it, ``(n,)``.

    0 beside a gap, and of the two first and last samples.
    """
    n = len(time)
    away = np.zeros(n)
    if n < 8:
        return away
    step = np.diff(time)
    near = step <= _GAP * float(np.median(step))
    rows = 2 + np.flatnonzero(near[:-3] & near[1:-2] & near[2:-1] & near[3:])
    at = [time[rows + k] - time[rows] for k in (-2, -1, 1, 2)]
    expected, gain = np.zeros((len(rows), 3)), np.ones(len(rows))
    for k, shift in enumerate((-2, -1, 1, 2)):
        weight = np.ones(len(rows))
        for j in range(4):
            if j != k:
                weight *= at[j] / (at[j] - at[k])
        expected += weight[:, None] * position[rows + shift]
        gain += weight**2
    away[rows] = np.linalg.norm(position[rows] - expected, axis=1) / np.sqrt(gain)
    return away
