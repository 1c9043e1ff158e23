"""The errors of a robot on the distances between measured points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.errors import InputError, counted, refusals_of
from truearm.engine.base.units import Marked, parts_of
from truearm.engine.command.arguments import refuse_swapped
from truearm.engine.data.statistics import errors_of
from truearm.engine.document.document import Block, detail, say
from truearm.engine.document.records import Record
from truearm.engine.robot.chain import Array
from truearm.validation.validate import as_measured

if TYPE_CHECKING:
    from truearm.validation.jobs import JudgeDistances

# Errors of the distances between all pairs of measured points (Nubiola, Tables 4.5 and 4.6, Figure 4.8).
#
# A distance does not depend on where the instrument stood, so it judges a robot without a common frame. Ten thousand
# points make fifty million pairs; they are gone through in blocks that fit the processor's cache, and none is kept.
#
# With p the predicted points, m the measured ones, u = p - m and w = p + m about their middle, the error of a pair is
#
#     ``e = (|p1 - p2|^2 - |m1 - m2|^2) / (|p1 - p2| + |m1 - m2|) = (u1 - u2) . (w1 - w2) / sqrt(H - e^2)``,
#     ``H = |w1 - w2|^2 + |u1 - u2|^2``.
#
# Numerator and H are a matrix product each, in double precision; the numerator is as small as the error, so that it
# loses no digits of it. The root is in single precision, with ``e^2 = (numerator)^2 / H`` in it: every error is right
# to 2e-7 of itself, and means over many to far less. Pairs that are close, beside the extent of all or beside their
# error, are computed from differences of coordinates in double precision.

#: Pairs that are worked on at once, and their rows.
_BLOCK: Final = 100_000
_ROWS: Final = 128
#: Two threads: what a small machine has.
_THREADS: Final = 2
#: Pairs are close below this share of the extent of all points, and below so many of the largest errors.
_CLOSE: Final = 0.005
_ERRORS: Final = 20.0
#: Share of close pairs above which all of a block are computed from coordinates.
_MANY: Final = 0.1
#: Bins of the histogram at most, and the first digits of their width.
_BINS: Final = 200
_WIDTHS: Final = (1.0, 2.0, 5.0, 10.0)

_F = TypeVar("_F", np.float32, np.float64)


@dataclass(frozen=True, eq=False)
class PairDistances:
    """Errors of distances: those between predicted points minus those between measured ones."""

    pairs: int  #: How many.
    mean: float  #: mean, deviation, maximum: of the absolute error [m].
    deviation: float
    maximum: float
    positive: float  #: Share of the errors above zero.
    edges: Array  #: edges, counts: histogram of the signed errors [m], ``(bins + 1,)`` and ``(bins,)``.
    counts: NDArray[np.int64]


def pair_distances(predicted: ArrayLike, measured: ArrayLike, configuration: ArrayLike | None = None) -> PairDistances:
    """Compare the distances between all pairs of points.

    Args:
        predicted, measured: The same points twice [m], ``(n, 3)``.
        configuration: Which configuration each point was measured at, ``(n,)``; pairs within one tell about the tool
            and are left out. Each point is one of its own if None.

    Raises:
        InputError: If the shapes differ, a coordinate is missing, or there is no pair.
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
    points = _Points(P, M, width)
    groups = _blocks(of)
    workers = min(_THREADS, len(groups))
    if workers == 1:
        tallies = [_Tally(points, groups)]
    else:
        with ThreadPoolExecutor(workers) as pool:
            tallies = [*pool.map(lambda k: _Tally(points, groups[k::workers]), range(workers))]
    # Sums of a group of rows do not depend on who made them, and are added in one order.
    sums = np.array([tallies[k % workers].sums[k // workers] for k in range(len(groups))]).sum(axis=0)
    counts = np.sum([tally.counts for tally in tallies], axis=0)
    pairs = int(counts.sum())
    mean = float(sums[0]) / pairs
    seen = np.flatnonzero(counts)
    first, last = int(seen[0]), int(seen[-1]) + 1
    return PairDistances(
        pairs=pairs,
        mean=mean * width,
        deviation=math.sqrt(max(float(sums[1]) / pairs - mean**2, 0.0)) * width,
        maximum=max(tally.largest for tally in tallies) * width,
        positive=sum(tally.positive for tally in tallies) / pairs,
        edges=np.asarray((np.arange(first, last + 1) - _BINS // 2) * width, float),
        counts=counts[first:last],
    )


def _width(errors: Array) -> float:
    """Return a round width of bins: no distance is off by more than both its ends together, without what they share."""
    most = 2.0 * float(np.linalg.norm(errors - errors.mean(axis=1, keepdims=True), axis=0).max())
    least = max(2.0 * most / (_BINS - 2), 1e-15)
    power = 10.0 ** math.floor(math.log10(least))
    return next(first * power for first in _WIDTHS if first * power >= least)


_Block = tuple[slice, slice, NDArray[np.bool_] | None]


def _blocks(of: NDArray[np.generic]) -> list[list[_Block]]:
    """Return blocks of pairs, each pair once, by groups of rows: rows, columns, and which of its pairs count, or None.

    Rows end with a configuration, so that behind a group of rows all columns are other configurations.
    """
    n = len(of)
    ends = np.append(np.flatnonzero(of[1:] != of[:-1]) + 1, n)
    groups: list[list[_Block]] = []
    start = 0
    while start < n:
        stop = int(ends[min(int(np.searchsorted(ends, start + _ROWS)), len(ends) - 1)])
        rows = slice(start, stop)
        label = of[rows]
        counted = np.triu(label[:, None] != label[None, :])
        step = max(1, _BLOCK // (stop - start))
        blocks: list[_Block] = [(rows, rows, counted)] if counted.any() else []
        blocks.extend((rows, slice(a, min(a + step, n)), None) for a in range(stop, n, step))
        if blocks:
            groups.append(blocks)
        start = stop
    return groups


class _Points:
    """The two sets of points, in widths of a bin, about the middle of each.

    Attributes:
        predicted, measured: The points, ``(3, n)``.
        numerator, squares: Two arrays each, ``(n, 8)`` and ``(8, n)``, whose product is the numerator of all pairs, and
            H.
        close: H below which a pair is close.
    """

    def __init__(self, predicted: Array, measured: Array, width: float) -> None:
        self.predicted, self.measured = (
            (points - points.mean(axis=1, keepdims=True)) / width for points in (predicted, measured)
        )
        u, w, ones = self.predicted - self.measured, self.predicted + self.measured, np.ones(measured.shape[1])
        both, every = (u * w).sum(axis=0), (u**2 + w**2).sum(axis=0)
        self.numerator = np.stack([*u, *w, both, ones], axis=1), np.stack([*-w, *-u, ones, both])
        self.squares = np.stack([*u, *w, every, ones], axis=1), np.stack([*(-2.0 * u), *(-2.0 * w), ones, every])
        extent, most = (2.0 * float(np.linalg.norm(points, axis=0).max()) for points in (w, u))
        self.close = max(_CLOSE * extent, 2.0 * _ERRORS * most) ** 2


class _Tally:
    """Errors of groups of blocks, summed up.

    Attributes:
        sums: Of each group, the sum of the absolute errors and of their squares.
        largest, positive: The largest absolute error, and how many errors are above zero.
        counts: Of the bins, ``(200,)``.
    """

    def __init__(self, points: _Points, groups: list[list[_Block]]) -> None:
        blocks = [block for group in groups for block in group]
        most = max((rows.stop - rows.start) * (columns.stop - columns.start) for rows, columns, _ in blocks)
        self._points = points
        self._buffer = np.empty((3, most))
        self._single = np.empty((3, most), dtype=np.float32)
        self._bins = np.zeros(most, dtype=np.uint8)
        self._twos = np.zeros(2**16, dtype=np.int64)
        self.largest, self.positive = 0.0, 0
        self.counts: NDArray[np.int64] = np.zeros(_BINS, dtype=np.int64)
        self.sums = [np.sum([self._add(*block) for block in group], axis=0) for group in groups]
        table = self._twos.reshape(256, 256)
        self.counts += (table.sum(axis=0) + table.sum(axis=1))[:_BINS]

    def _add(self, rows: slice, columns: slice, counted: NDArray[np.bool_] | None) -> tuple[float, float]:
        """Count the errors of a block, and return the sum of their absolute values and of their squares."""
        if counted is None:
            sums = self._by_products(rows, columns)
            if sums is not None:
                return sums
        error, other, spare = self._shaped(self._buffer, rows, columns)
        _distances(self._points.predicted, rows, columns, error, spare)
        error -= _distances(self._points.measured, rows, columns, other, spare)
        flat = error.reshape(-1) if counted is None else error[counted]
        size = np.abs(flat, out=spare.reshape(-1)[: flat.size])
        self.largest = max(self.largest, float(size.max()))
        self.positive += int(np.count_nonzero(flat > 0))
        sums = float(size.sum()), float(size @ size)
        flat += _BINS // 2
        self._count(flat)
        return sums

    def _by_products(self, rows: slice, columns: slice) -> tuple[float, float] | None:
        """Do so by two matrix products, or return None if too many pairs are close."""
        points = self._points
        numerator, squares, _ = self._shaped(self._buffer, rows, columns)
        for (left, right), product in ((points.numerator, numerator), (points.squares, squares)):
            np.matmul(left[rows], right[:, columns], out=product)
        error, square, spare = (buffer.reshape(-1) for buffer in self._shaped(self._single, rows, columns))
        np.copyto(error, numerator.reshape(-1), casting="same_kind")
        np.copyto(square, squares.reshape(-1), casting="same_kind")
        close = np.flatnonzero(square < points.close)
        if len(close) > _MANY * square.size:
            return None
        square[close] = points.close
        np.divide(error, square, out=spare)
        spare *= error
        square -= spare
        np.sqrt(square, out=square)
        error /= square
        if len(close):
            row, column = np.divmod(close, columns.stop - columns.start)
            error[close] = self._exact(rows.start + row, columns.start + column)
        self.positive += int(np.count_nonzero(error > 0))
        np.add(error, np.float32(_BINS // 2), out=spare)
        self._count(spare)
        np.abs(error, out=error)
        row, column = divmod(int(error.argmax()), columns.stop - columns.start)
        self.largest = max(self.largest, abs(float(self._exact(rows.start + row, columns.start + column))))
        size = numerator.reshape(-1)
        np.copyto(size, error)
        return float(size.sum()), float(size @ size)

    def _exact(self, row: int | NDArray[np.intp], column: int | NDArray[np.intp]) -> Array:
        """Return the errors of single pairs, from differences of coordinates."""
        predicted, measured = (
            np.linalg.norm(points[:, row] - points[:, column], axis=0)
            for points in (self._points.predicted, self._points.measured)
        )
        return np.asarray(predicted - measured)

    def _count(self, bins: NDArray[np.floating]) -> None:
        """Count bins, two by two: half as many steps."""
        numbers = self._bins[: bins.size]
        np.copyto(numbers, bins, casting="unsafe")
        if bins.size % 2:
            self.counts[numbers[-1]] += 1
            numbers = numbers[:-1]
        np.add.at(self._twos, numbers.view(np.uint16), 1)

    @staticmethod
    def _shaped(buffers: NDArray[_F], rows: slice, columns: slice) -> tuple[NDArray[_F], NDArray[_F], NDArray[_F]]:
        """Return three arrays for a block."""
        shape = (rows.stop - rows.start, columns.stop - columns.start)
        first, second, third = (buffer[: shape[0] * shape[1]].reshape(shape) for buffer in buffers)
        return first, second, third


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


#: Bars of the histogram where a person reads, about, and signs in the longest.
_BARS: Final = 20
_LONGEST: Final = 50


@dataclass(frozen=True, eq=False, repr=False)
class Distances(Record):
    """Errors of the distances between all pairs of measured points."""

    source: str  #: The measurements, for messages.
    configurations: int  #: How many there are.
    errors: PairDistances  #: Predicted minus measured distances.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give the statistics and a histogram, in mm."""
        errors, edges = self.errors, self._edges()
        figures = {"mean": errors.mean * 1e3, "deviation": errors.deviation * 1e3, "max": errors.maximum * 1e3}
        yield say(
            f"{counted(errors.pairs, 'distance')} between points of {counted(self.configurations, 'configuration')} of "
            f"{self.source}:",
            f"  {'  '.join(f'{name} {value:.3f}' for name, value in figures.items())} mm",
            f"  {100 * errors.positive:.0f} % of the predicted distances are too long",
            configurations=self.configurations,
            pairs=errors.pairs,
            distance_mm=figures,
            positive=errors.positive,
        )
        step = max(1, len(errors.counts) // _BARS)
        starts = range(0, len(errors.counts), step)
        sums = [int(errors.counts[first : first + step].sum()) for first in starts]
        ends = [edges[min(first + step, len(errors.counts))] for first in starts]
        bars = [
            f"  {edges[first]:8.3f} to {end:8.3f} mm  {'#' * round(_LONGEST * count / max(sums))}".rstrip()
            for first, end, count in zip(starts, ends, sums, strict=True)
        ]
        yield detail(*bars, histogram={"edges_mm": edges, "counts": errors.counts.tolist()})

    def _edges(self) -> list[float]:
        edges: list[float] = np.round(self.errors.edges * 1e3, 9).tolist()
        return edges


def judged(asked: JudgeDistances) -> Distances:
    """Compare the distances between all pairs of measured points with those that the robot predicts."""
    refuse_swapped(asked.robot, asked.data, "distances")
    arm, readings = as_measured(asked.robot, asked.data, asked.loads)
    predicted = errors_of(arm, readings).position_errors
    seen = readings.has_position
    measured = readings.position[seen]
    with refusals_of("data"):
        errors = pair_distances(measured + predicted[seen], measured, readings.configuration[seen])
    return Distances(readings.source, readings.configurations, errors, parts_of((arm, readings)))
