"""The errors of a robot on the distances between measured points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

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

#: Pairs that are worked on at once, about.
_BLOCK: Final = 50_000
#: Bins of the histogram at most, and the first digits of their width.
_BINS: Final = 200
_WIDTHS: Final = (1.0, 2.0, 5.0, 10.0)


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
    ends = np.append(np.flatnonzero(of[1:] != of[:-1]) + 1, len(of))
    counts: NDArray[np.int64] = np.zeros(_BINS, dtype=np.int64)
    sums, largest, positive, start = np.zeros(2), 0.0, 0, 0
    while start < ends[-2]:
        # Rows end with a configuration: all points behind are of others.
        rows = max(1, _BLOCK // (len(of) - start))
        stop = int(ends[min(int(np.searchsorted(ends, start + rows)), len(ends) - 2)])
        errors = _distances(P, start, stop) - _distances(M, start, stop)
        others = np.triu(of[start:stop, None] != of[start:stop])
        flat = np.concatenate([errors[:, : stop - start][others], errors[:, stop - start :].ravel()])
        positive += int(np.count_nonzero(flat > 0))
        counts += np.bincount((flat / width + _BINS // 2).astype(np.intp), minlength=_BINS)
        size = np.abs(flat)
        sums += size.sum(), size @ size
        largest = max(largest, float(size.max()))
        start = stop
    pairs = int(counts.sum())
    mean = float(sums[0]) / pairs
    seen = np.flatnonzero(counts)
    first, last = int(seen[0]), int(seen[-1]) + 1
    return PairDistances(
        pairs=pairs,
        mean=mean,
        deviation=math.sqrt(max(float(sums[1]) / pairs - mean**2, 0.0)),
        maximum=largest,
        positive=positive / pairs,
        edges=np.asarray((np.arange(first, last + 1) - _BINS // 2) * width, float),
        counts=counts[first:last],
    )


def _width(errors: Array) -> float:
    """Return a round width of bins: no distance is off by more than both its ends together, without what they share."""
    most = 2.0 * float(np.linalg.norm(errors - errors.mean(axis=1, keepdims=True), axis=0).max())
    least = max(2.0 * most / (_BINS - 2), 1e-15)
    power = 10.0 ** math.floor(math.log10(least))
    return next(first * power for first in _WIDTHS if first * power >= least)


def _distances(points: Array, start: int, stop: int) -> Array:
    """Return the distances between some points and all from the first of them on."""
    square = np.zeros((stop - start, points.shape[1] - start))
    for axis in points:
        apart = axis[start:stop, None] - axis[start:]
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
