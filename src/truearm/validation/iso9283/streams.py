"""Dwells and motions in a stream of samples, and the cycles of a path in it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.validation.iso9283.commanded import CommandedPath
from truearm.validation.iso9283.smoothing import local_lines

#: Half the window over which speed is taken [s], and at least so many samples in it.
_HALF_WINDOW = 0.04
_LEAST_SAMPLES = 5
#: The tip moves where it is faster than this share of the commanded velocity, and stands below half of it.
_MOVES = 0.04
#: So many standard deviations of the speed of noise alone are no motion.
_NOISE = 6.0
#: A dwell or a motion is seen at least so long [s], or it belongs to what is around it. A dwell is seen less long than
#: it takes, by the window of the speed.
_SHORTEST = {False: 0.03, True: 0.1}
#: Within this share of the length of a path from one of its ends the tip is said to be there; of its extent at most.
_AT_END, _AT_END_OF_EXTENT = 0.05, 0.1
#: A robot whose path is off comes no nearer than so; it is at the end within this many times that.
_NEAREST = 1.5
#: A cycle is no further from the path than this share of its extent.
_NEAR = 0.2
#: In so many places between its ends it is seen whether a path was run, and in which direction.
_CHECKED = (0.25, 0.5, 0.75)

Span = tuple[int, int]


@dataclass(frozen=True, eq=False)
class FoundStream:
    """What was found in a stream."""

    test: str  #: test, path: whose stream it is.
    path: str
    time: Array  #: time, speed: [s], [m/s], ``(n,)``; the speed is that of a straight line through a short window.
    speed: Array
    threshold: float  #: Faster is motion [m/s].
    dwells: tuple[Span, ...]  #: dwells, motions, cycles: indices of the first and of the last sample of each.
    motions: tuple[Span, ...]
    cycles: tuple[Span, ...]


def noise_of(position: Array) -> float:
    """Return the standard deviation of the noise of each coordinate [m], from third differences where it is quietest.

    A motion whose acceleration changes little leaves none of itself in third differences.
    """
    if len(position) < 8:
        return 0.0
    differences = np.diff(position, n=3, axis=0)
    length = min(50, len(differences))
    blocks = differences[: len(differences) // length * length].reshape(-1, length * 3)
    return float(np.quantile(np.sqrt((blocks**2).mean(axis=1)), 0.2) / np.sqrt(20.0))


def speeds(time: Array, position: Array) -> tuple[Array, float]:
    """Return the speed at each sample [m/s], ``(n,)``, and the standard deviation that noise alone gives it."""
    step = float(np.median(np.diff(time)))
    half = max(_HALF_WINDOW, _LEAST_SAMPLES / 2 * step)
    _, rate, _ = local_lines(time, position, time, half)
    count = max(2 * half / step, _LEAST_SAMPLES)
    return np.asarray(np.linalg.norm(rate, axis=1)), float(noise_of(position) * np.sqrt(12.0 / count) / (2 * half))


def spans_of(moving: NDArray[np.bool_]) -> list[Span]:
    """Return first and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def motion(time: Array, position: Array, velocity: float) -> tuple[Array, float, NDArray[np.bool_]]:
    """Return the speed [m/s], the threshold, and at which samples the tip moves.

    It begins to move where it gets faster than the threshold and stands where it gets slower than half of it.

    Args:
        velocity: Commanded [m/s].
    """
    speed, noise = speeds(time, position)
    threshold = max(_MOVES * velocity, _NOISE * noise)
    above, below = speed > threshold, speed < 0.5 * threshold
    decided = np.where(above, 1, np.where(below, -1, 0))
    last = np.maximum.accumulate(np.where(decided != 0, np.arange(len(speed)), 0))
    moving = decided[last] > 0
    for state in (False, True):  # short dwells first: a motion broken by noise is one
        for first, final in spans_of(moving == state):
            inner = first > 0 and final < len(moving) - 1
            if inner and time[final] - time[first] < _SHORTEST[state]:
                moving[first : final + 1] = not state
    return speed, threshold, moving


def found_in(test: str, path: CommandedPath, time: Array, position: Array, velocity: float) -> FoundStream:
    """Return dwells, motions and cycles in a stream.

    A cycle goes from the begin of the path to its end and passes a quarter, the middle and three quarters of it on its
    way, near the plan; so a way back, and a path run backwards, are none. It begins with the dwell before it, where
    there is one, and ends with the one behind it.

    Args:
        time, position: [s], [m in the base frame], ``(n,)`` and ``(n, 3)``.
        velocity: Commanded [m/s].
    """
    speed, threshold, moving = motion(time, position, velocity)
    dwells, motions = spans_of(~moving), spans_of(moving)
    cycles = tuple(_cycles(path, position, speed, moving))
    return FoundStream(test, path.path.name, time, speed, threshold, tuple(dwells), tuple(motions), cycles)


def _cycles(path: CommandedPath, position: Array, speed: Array, moving: NDArray[np.bool_]) -> list[Span]:
    radius = min(_AT_END * path.length, _AT_END_OF_EXTENT * path.extent)
    begin, end = path.points(np.array([0.0])), path.points(np.array([path.length]))
    at_begin, at_end = (np.linalg.norm(position - point, axis=1) for point in (begin, end))
    most = _NEAR * path.extent
    around = [min(max(radius, _NEAREST * float(distance.min())), most) for distance in (at_begin, at_end)]
    visits = [(*span, "begin") for span in spans_of(at_begin < around[0])]
    visits += [] if path.closed else [(*span, "end") for span in spans_of(at_end < around[1])]
    visits.sort()
    cycles: list[Span] = []
    for before, after in itertools.pairwise(visits):
        if before[2] != "begin" or after[2] != ("begin" if path.closed else "end"):
            continue
        if not _runs(path, position[before[1] : after[0] + 1]):
            continue
        first = _bound(before[:2], at_begin, moving, speed, last=False)
        final = _bound(after[:2], at_end, moving, speed, last=True)
        cycles.append((first, final))
    return cycles


def _runs(path: CommandedPath, way: Array) -> bool:
    """Return whether samples between the two ends of a path run along it, in its direction."""
    if len(way) < 8:
        return False
    near = _NEAR * path.extent + path.path.stroke
    places = path.points(np.array(_CHECKED) * path.length)
    distance = np.linalg.norm(way[:, None] - places[None], axis=2)
    when = distance.argmin(axis=0)
    return bool((distance.min(axis=0) < near).all() and (np.diff(when) > 0).all())


def _bound(visit: Span, distance: Array, moving: NDArray[np.bool_], speed: Array, *, last: bool) -> int:
    """Return where a cycle begins (or ends, `last`) in the samples that are near its end of the path."""
    first, final = visit
    standing = spans_of(~moving[first : final + 1])
    if standing:  # a cycle begins with the end of the last dwell, and ends with the begin of the first
        return first + standing[0][0] if last else first + standing[-1][1]
    return first + int(distance[first : final + 1].argmin())
