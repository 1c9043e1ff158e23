"""Samples that lie apart from those about them, as in no other cycle: perhaps the robot, perhaps the instrument."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.validation.iso9283.wild_samples import scatter_of

#: A sample is unusual if it lies so many times further from what the samples about it say than is usual in a cycle
#: there, and so many standard deviations of noise further.
_TIMES, _NOISE = 4.0, 7.0
#: With what is the same in all cycles taken away it is besides so many times further than is usual with it.
_OF_WHOLE = 3.0
#: Of so few cycles not each may have a sample in a corner: there it is besides further than this share of how much the
#: steps before and behind it differ, of which a sharp corner makes a quarter.
_FEW, _OF_TURN = 5, 0.3
#: What is usual there is seen in stretches of so many samples, and of so much of the way at least.
_STRETCH, _LEAST_STRETCH = 3.0, 0.0025
#: Beside a longer gap than this many usual steps, samples say too little of one another.
_GAP = 1.6
#: Fewer cycles do not show what is usual.
_LEAST_CYCLES = 3
#: The place jumps by a step so many times as long as the usual one of so many before and behind it, and by so many
#: standard deviations of noise besides.
_JUMP, _ABOUT, _OF_STEP = 1.8, 4, 6.0
#: What is the same in all cycles is seen at so many places at most.
_GRID = 4000
#: Of samples so near to each other the one that lies furthest apart is named.
_NEAR = 3


@dataclass(frozen=True)
class Unusual:
    """A sample that lies apart."""

    cycle: int  #: cycle, sample: which, from 0.
    sample: int
    distance: float  #: From where the two samples before and the two behind it say that it should be [m].


def unusual_samples(
    times: Sequence[Array], positions: Sequence[Array], places: Sequence[Array], rounding: float = 0.0
) -> list[Unusual]:
    """Return samples that lie apart from those about them, as none does there in half of the cycles.

    Each sample is compared with a cubic through the two before it and the two behind it: as it is, and with what is the
    same in all cycles taken away. Where the tip turns a corner or begins to move that is off in every cycle, and
    nothing is unusual.

    Args:
        times, positions: Of each cycle [s], ``(n,)``, and [m], ``(n, 3)``.
        places: What tells where in the cycle a sample is, such as the arc length of its foot, ``(n,)`` each.
        rounding: What rounding in the file leaves open of each coordinate, as a standard deviation [m]: the noise is no
            less.
    """
    if len(times) < _LEAST_CYCLES:
        return []
    low, high = min(float(place.min()) for place in places), max(float(place.max()) for place in places)
    if high <= low:
        return []
    stretches = _stretches(places, low, high)
    noise = max(float(np.median([scatter_of(position) for position in positions])), rounding)
    away, usual = _apart_in_all(times, positions, stretches)
    less, compared = _without_common(positions, places, low, high, noise)
    other, usual_of_other = _apart_in_all(times, less, stretches, compared)
    beyond = [one > np.maximum(_TIMES * there, there + _NOISE * noise) for one, there in zip(away, usual, strict=True)]
    for cycle, (one, there) in enumerate(zip(other, usual_of_other, strict=True)):
        least = np.maximum(_TIMES * there, there + _NOISE * noise)
        beyond[cycle] |= one > np.maximum(least, _OF_WHOLE * usual[cycle])
        if len(positions) < _FEW:
            beyond[cycle] &= np.maximum(away[cycle], one) > _OF_TURN * _turns(positions[cycle])
    found = []
    for cycle, rows in enumerate(np.flatnonzero(mask) for mask in beyond):
        if not len(rows):
            continue
        size = np.maximum(away[cycle], other[cycle])
        for group in np.split(rows, np.flatnonzero(np.diff(rows) > _NEAR) + 1):
            worst = int(group[size[group].argmax()])
            found.append(Unusual(cycle, worst, float(size[worst])))
    return found


def _stretches(places: Sequence[Array], low: float, high: float) -> list[NDArray[np.intp]]:
    """Return in which stretch of the way each sample is, from 1, ``(n,)`` of each cycle."""
    steps = np.concatenate([np.abs(np.diff(place)) for place in places])
    moving = steps[steps > 0.1 * (high - low) / max(map(len, places))]
    width = max(_STRETCH * float(np.median(moving)) if len(moving) else 0.0, _LEAST_STRETCH * (high - low))
    return [1 + ((place - low) / width).astype(np.intp) for place in places]


def _apart_in_all(
    times: Sequence[Array],
    values: Sequence[Array],
    stretches: Sequence[NDArray[np.intp]],
    compared: Sequence[NDArray[np.bool_]] | None = None,
) -> tuple[list[Array], list[Array]]:
    """Return how far each sample is apart, and what half of the cycles do not exceed there, ``(n,)`` of each cycle.

    Those that are not `compared` are not apart.
    """
    away = [_apart(time, value) for time, value in zip(times, values, strict=True)]
    if compared is not None:
        away = [np.where(one, far, 0.0) for one, far in zip(compared, away, strict=True)]
    most = np.zeros((len(times), 2 + max(int(stretch.max()) for stretch in stretches)))
    for cycle, stretch in enumerate(stretches):
        np.maximum.at(most[cycle], stretch, away[cycle])
    usual = np.zeros(most.shape[1])
    usual[1:-1] = np.median(np.maximum(np.maximum(most[:, :-2], most[:, 2:]), most[:, 1:-1]), axis=0)
    return away, [usual[stretch] for stretch in stretches]


def _without_common(
    positions: Sequence[Array], places: Sequence[Array], low: float, high: float, noise: float
) -> tuple[list[Array], list[NDArray[np.bool_]]]:
    """Return positions less what half of the cycles have at the same place, ``(n, 3)``, and where that says something.

    Where the place jumps, as that of the foot does when the tip passes the bisector of a corner on an arc, what is
    common to the cycles is not known: a sample tells nothing from which the cubic of its neighbours passes a jump of
    any cycle.
    """
    grid = np.linspace(low, high, int(np.clip(2 * max(map(len, places)), 100, _GRID)))
    drawn = []
    for position, place in zip(positions, places, strict=True):
        order = np.argsort(place, kind="stable")
        drawn.append([np.interp(grid, place[order], position[order, axis]) for axis in range(3)])
    common = np.median(np.array(drawn), axis=0)
    jumps = np.concatenate([_jumps(place, noise) for place in places])
    compared = [_beside(place, jumps) for place in places]
    less = [
        position - np.column_stack([np.interp(place, grid, common[axis]) for axis in range(3)])
        for position, place in zip(positions, places, strict=True)
    ]
    return less, compared


def _jumps(place: Array, noise: float) -> Array:
    """Return between which places a step along the way is much longer than those about it, ``(k, 2)``."""
    steps = np.abs(np.diff(place))
    if len(steps) <= 2 * _ABOUT:
        return np.empty((0, 2))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, _ABOUT, mode="edge"), 2 * _ABOUT + 1)
    usual = np.maximum(np.median(windows, axis=1), 0.1 * float(np.quantile(steps, 0.9)))
    long = np.flatnonzero(steps > _JUMP * usual + _OF_STEP * noise)
    return np.sort(np.column_stack([place[long], place[long + 1]]), axis=1)


def _beside(place: Array, jumps: Array) -> NDArray[np.bool_]:
    """Return which samples have neighbours none of which lies in a jump, or behind one, ``(n,)``."""
    if not len(jumps):
        return np.ones(len(place), dtype=bool)
    # how many jumps begin before each sample, and how many end: in a jump there are more of the former
    begun, ended = (np.searchsorted(np.sort(jumps[:, k]), place, side="right") for k in (0, 1))
    first = np.searchsorted(np.sort(jumps[:, 0]), place, side="left")
    inside = first > ended
    near = np.pad(inside, 2)
    n = len(place)
    beside = np.any([near[k : k + n] for k in range(5)], axis=0)
    far = np.pad(begun + ended, 2, mode="edge")
    passed = np.ptp(np.array([far[k : k + n] for k in range(5)]), axis=0) > 0
    return np.asarray(~(beside | passed))


def _turns(position: Array) -> Array:
    """Return by how much the last step before the neighbours of a sample and the first behind them differ, ``(n,)``."""
    turns = np.zeros(len(position))
    step = np.diff(position, axis=0)
    turns[3:-3] = np.linalg.norm(step[5:] - step[:-5], axis=1)
    return turns


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
