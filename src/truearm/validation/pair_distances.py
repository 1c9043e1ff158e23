"""Errors of the distances between all pairs of measured points (Nubiola, Tables 4.5 and 4.6, Figure 4.8).

A distance does not depend on where the instrument stood, so it judges a robot without a common frame. Ten thousand
points make fifty million pairs; they are gone through in blocks that fit the processor's cache, and none is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array

#: Pairs that are worked on at once.
_BLOCK: Final = 160_000
#: Bins of the histogram at most, and the first digits of their width.
_BINS: Final = 200
_WIDTHS: Final = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, eq=False)
class PairDistances:
    """Errors of distances: those between predicted points minus those between measured ones.

    Attributes
    ----------
    pairs
        How many.
    mean, deviation, maximum
        Of the absolute error [m].
    positive
        Share of the errors above zero.
    edges, counts
        Histogram of the signed errors [m], ``(bins + 1,)`` and ``(bins,)``.
    """

    pairs: int
    mean: float
    deviation: float
    maximum: float
    positive: float
    edges: Array
    counts: NDArray[np.int64]


def pair_distances(predicted: ArrayLike, measured: ArrayLike, configuration: ArrayLike | None = None) -> PairDistances:
    """Compare the distances between all pairs of points.

    Parameters
    ----------
    predicted, measured
        The same points twice [m], ``(n, 3)``.
    configuration
        Which configuration each point was measured at, ``(n,)``; pairs within one tell about the tool and are left
        out. Each point is one of its own if None.

    Raises
    ------
    InputError
        If the shapes differ, a coordinate is missing, or there is no pair.
    """
    P, M = np.asarray(predicted, float), np.asarray(measured, float)
    if P.ndim != 2 or P.shape[1] != 3 or P.shape != M.shape:
        raise InputError(
            "the two sets of points have different shapes",
            where="points",
            came=f"{P.shape} and {M.shape}",
            allowed="(n, 3) both",
        )
    if not (np.isfinite(P).all() and np.isfinite(M).all()):
        raise InputError("a point has no position", where="points", cure="Leave it out.")
    of = np.arange(len(P)) if configuration is None else np.asarray(configuration)
    order = np.argsort(of, kind="stable")
    of, P, M = of[order], np.ascontiguousarray(P[order].T), np.ascontiguousarray(M[order].T)
    if len(of) == 0 or of[0] == of[-1]:
        raise InputError("distances need points of two configurations or more", where="points")
    width = _width(P - M)
    blocks = _blocks(of)
    tally = _Tally(width, max((r.stop - r.start) * (c.stop - c.start) for r, c, _ in blocks))
    P, M = P / width, M / width
    for rows, columns, counted in blocks:
        tally.add(P, M, rows, columns, counted)
    return tally.result()


def _width(errors: Array) -> float:
    """Return a round width of bins: no distance is off by more than both its ends together, without what they share."""
    most = 2.0 * float(np.linalg.norm(errors - errors.mean(axis=1, keepdims=True), axis=0).max())
    least = max(2.0 * most / (_BINS - 2), 1e-15)
    power = 10.0 ** math.floor(math.log10(least))
    return next(first * power for first in _WIDTHS if first * power >= least)


def _blocks(of: NDArray[np.generic]) -> list[tuple[slice, slice, NDArray[np.bool_] | None]]:
    """Return blocks of pairs, each pair once: rows, columns, and which pairs of the block count, None for all.

    Rows end with a configuration, so that behind a block of rows all columns are other configurations.
    """
    n = len(of)
    ends = np.append(np.flatnonzero(of[1:] != of[:-1]) + 1, n)
    blocks: list[tuple[slice, slice, NDArray[np.bool_] | None]] = []
    start = 0
    while start < n:
        last = start + max(1, min(256, _BLOCK // max(n - start, 1)))
        stop = int(ends[min(int(np.searchsorted(ends, last)), len(ends) - 1)])
        rows = slice(start, stop)
        label = of[rows]
        counted = np.triu(label[:, None] != label[None, :])
        if counted.any():
            blocks.append((rows, rows, counted))
        step = max(1, _BLOCK // (stop - start))
        blocks.extend((rows, slice(a, min(a + step, n)), None) for a in range(stop, n, step))
        start = stop
    return blocks


class _Tally:
    """Sums over the pairs seen so far, of points given in widths of a bin."""

    def __init__(self, width: float, largest: int) -> None:
        self._width = width
        self._room = np.empty((3, largest))
        self._bins = np.empty(largest, dtype=np.intp)
        self._pairs, self._sum, self._squares, self._most, self._positive = 0, 0.0, 0.0, 0.0, 0
        self._counts = np.zeros(_BINS, dtype=np.int64)

    def add(self, P: Array, M: Array, rows: slice, columns: slice, counted: NDArray[np.bool_] | None) -> None:
        shape = (rows.stop - rows.start, columns.stop - columns.start)
        error, other, spare = (room[: shape[0] * shape[1]].reshape(shape) for room in self._room)
        _distances(P, rows, columns, error, spare)
        error -= _distances(M, rows, columns, other, spare)
        error = error.reshape(-1) if counted is None else error[counted]
        size = np.abs(error, out=spare.reshape(-1)[: error.size])
        self._pairs += error.size
        self._positive += int(np.count_nonzero(error > 0))
        self._most = max(self._most, float(size.max()))
        self._squares += float(size @ size)
        self._sum += float(size.sum())
        error += _BINS // 2
        bins = self._bins[: error.size]
        np.copyto(bins, error, casting="unsafe")
        self._counts += np.bincount(bins, minlength=_BINS)

    def result(self) -> PairDistances:
        mean = self._sum / self._pairs
        seen = np.flatnonzero(self._counts)
        first, last = int(seen[0]), int(seen[-1]) + 1
        return PairDistances(
            pairs=self._pairs,
            mean=mean * self._width,
            deviation=math.sqrt(max(self._squares / self._pairs - mean**2, 0.0)) * self._width,
            maximum=self._most * self._width,
            positive=self._positive / self._pairs,
            edges=np.asarray((np.arange(first, last + 1) - _BINS // 2) * self._width, float),
            counts=self._counts[first:last],
        )


def _distances(points: Array, rows: slice, columns: slice, square: Array, apart: Array) -> Array:
    """Return the distances between some points and others in `square`; `apart` is overwritten."""
    x, y, z = points
    np.subtract(x[rows, None], x[columns], out=square)
    square *= square
    for axis in (y, z):
        np.subtract(axis[rows, None], axis[columns], out=apart)
        apart *= apart
        square += apart
    return np.sqrt(square, out=square)
