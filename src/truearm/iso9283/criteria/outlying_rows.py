"""Rows that lie far from the other cycles of their pose, and poses where the tip comes to rest in two places.

One row 5 mm off among thirty makes RP 3 mm. Nothing is left out for that: the standard knows no exclusion. But it is
named, with what the values would be without it.

How far a row is from the others is divided by how these scatter, each group of cycles by its own scatter, and where
a group has fewer than eight, by that of all such groups of the test. Rows are taken as outlying, the furthest first, if
each is beyond what a Gaussian has once in a few million rows, and further by a factor than the furthest of all that
are left in the campaign. So what tails the robot has is learnt from the campaign itself: tails as those of Student's t
with five degrees of freedom give no more than a few false names in a hundred campaigns. Rows at the same pose that are
off alike, three or more, are no accident: the tip rests in two places there.

How often that is right was measured by simulation: ``benchmarks/iso9283_outlying_rows.py``.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.drift import groups_of
from truearm.iso9283.criteria.rows import Cycles, Instrument, Value

# Cycles that follow each other and are alike: then they tell less than as many independent ones.

#: So seldom is it said of any test of a campaign whose cycles are independent.
_FALSE: Final = 0.01
#: Fewer cycles do not show it.
_LEAST_CYCLES: Final = 10


@dataclass(frozen=True)
class AlikeCycles:
    """A test whose cycles are like those before them."""

    test: str  #: test, velocity, load: which, and under what.
    velocity: float
    load: float
    correlation: float  #: Between each cycle and the next, of positions about their mean; of independent cycles 0.
    usual: float  #: Its standard deviation where cycles are independent.


def alike_cycles(cycles: Sequence[Cycles]) -> tuple[AlikeCycles, ...]:
    """Return the tests in which each cycle is like the one before it by more than chance.

    The positions at all poses of a cycle are one vector, each pose divided by its scatter. The sum of products of each
    vector and the next over that of squares is the correlation. Of independent cycles it is -1/n in the mean, with the
    variance ``tr C^2 / (n (tr C)^2)``, where C is the vectors' covariance: poses that move together count once. Drift
    is left out, for it shall change.
    """
    parts: dict[tuple[str, float, float], list[Cycles]] = {}
    for cycle in cycles:
        if cycle.test != "dAP" and len(cycle) >= _LEAST_CYCLES:
            parts.setdefault((cycle.test, cycle.velocity, cycle.load), []).append(cycle)
    candidates = []
    for key, groups in parts.items():
        vectors = _vectors(groups)
        if len(vectors) < _LEAST_CYCLES or not vectors.shape[1]:
            continue
        n = len(vectors)
        squares = float((vectors**2).sum())
        correlation = float((vectors[:-1] * vectors[1:]).sum()) / squares + 1.0 / n
        candidates.append(AlikeCycles(*key, correlation, float(np.sqrt(_share(vectors) / n))))
    if not candidates:
        return ()
    from scipy.special import ndtri

    far = float(ndtri(1.0 - _FALSE / len(candidates)))
    return tuple(candidate for candidate in candidates if candidate.correlation > far * candidate.usual)


def _vectors(groups: Sequence[Cycles]) -> Array:
    """Return the positions of all groups in the cycles that all have, about their means, ``(n, 3 groups)``."""
    common = functools.reduce(np.intersect1d, [group.cycle for group in groups])
    columns = []
    for group in groups:
        _, _, rows = np.intersect1d(common, group.cycle, return_indices=True)
        about = group.points[rows] - group.points[rows].mean(axis=0)
        size = float(np.linalg.norm(about))
        if size > 1e-12:
            columns.append(about / size)
    return np.concatenate(columns, axis=1) if columns else np.empty((len(common), 0))


def _share(vectors: Array) -> float:
    """Return ``tr C^2 / (tr C)^2`` of the vectors' covariance, without what few vectors add to it (Srivastava 2005)."""
    n = len(vectors)
    product = vectors @ vectors.T / (n - 1)
    trace, square = float(np.trace(product)), float((product**2).sum())
    unbiased = (n - 1) ** 2 / ((n - 2) * (n + 1)) * (square - trace**2 / (n - 1))
    return float(max(unbiased / trace**2, 1.0 / vectors.shape[1]))


#: Groups with fewer cycles scatter by what all of them in the test scatter, and are named later by this factor.
_SMALL: Final = 8
_CAUTION: Final = 1.6
#: So many degrees of freedom are needed to say what is far.
_LEAST_FREEDOM: Final = 6
#: An outlying row is so many deviations away, as a Gaussian's are counted, and further than those left by these
#: factors: one alone, and several.
_FAR: Final = 5.0
_BEYOND: Final = (2.2, 1.8)
#: What is counted as a Gaussian's deviation: where Student's t is as rare as this.
_RARE: Final = 1e-5
#: The scatter is never taken below this share of the instrument's, nor below that of rounding.
_LEAST_SCATTER: Final = 1.0 / 3.0
#: At most this share of all rows is outlying, but three may be.
_SHARE: Final = 0.02
#: Offsets that differ by less than this share are alike, and so many are no accident.
_ALIKE: Final = 1.0 / 3.0
_ALIKE_ROWS: Final = 3
#: Two places are told from one of so many cycles, by the distance of two halves over the scatter within them.
_LEAST_CYCLES_OUTLYING_ROWS: Final = 20
_APART: Final = 7.0

Kind = Literal["position", "orientation"]


@dataclass(frozen=True, eq=False)
class OutlyingRow:
    """A row that lies far from the other cycles of its pose."""

    of: Cycles  #: It alone, with what it was measured under.
    kind: Kind  #: What is far off.
    #: away, scatter: how far from the mean of the others, and the root mean square distance of these from it [m or
    #: rad].
    away: float
    scatter: float
    changes: tuple[tuple[Value, Value], ...] = ()  #: Values that it is in, and the same without all outlying rows.


@dataclass(frozen=True, eq=False)
class TwoPlaces:
    """Cycles of one pose at rest in two places."""

    of: Cycles  #: The cycles.
    kind: Kind  #: Whether positions or orientations.
    apart: float  #: The distance of the two places [m or rad].
    rows: tuple[int, int]  #: How many are in either, the fewer first.
    lines: tuple[int, ...]  #: Of the fewer, in the file.


@dataclass(frozen=True, eq=False)
class UnusualRows:
    """What is unusual about the rows of a campaign."""

    outlying: tuple[OutlyingRow, ...] = ()  #: Rows that lie far from the others.
    two_places: tuple[TwoPlaces, ...] = ()  #: Poses with two places of rest.
    alike: tuple[AlikeCycles, ...] = ()  #: Tests whose cycles are like those before them.


def unusual_rows(cycles: Sequence[Cycles], instrument: Instrument) -> UnusualRows:
    """Return rows that lie far from the others, in the order of the plan, and what else is unusual about them."""
    groups = [part for cycle in cycles for part in (groups_of(cycle) if cycle.test == "dAP" else [cycle])]
    outlying: list[OutlyingRow] = []
    two: list[TwoPlaces] = []
    kinds: tuple[Kind, Kind] = ("position", "orientation")
    for kind, least in zip(kinds, instrument.least_scatter(_LEAST_SCATTER), strict=True):
        groups_read = [group for group in groups if kind == "position" or group.angles is not None]
        if groups_read:
            rows = _Rows(groups_read, kind, least)
            places = rows.two_places()
            named, alike = rows.outlying(places)
            outlying += named
            two += [*places.values(), *alike]
    return UnusualRows(tuple(outlying), tuple(two), alike_cycles(cycles))


def without(cycles: Sequence[Cycles], outlying: Sequence[OutlyingRow]) -> list[Cycles]:
    """Return cycles without some rows."""
    lines = np.array([int(row.of.line[0]) for row in outlying])
    left = [cycle.rows(~np.isin(cycle.line, lines)) for cycle in cycles]
    return [group for group in left if len(group)]


class _Rows:
    """All rows of a campaign, by groups."""

    def __init__(self, groups: list[Cycles], kind: Kind, least: float) -> None:
        self.groups = groups
        self.kind: Kind = kind
        numbers = [group.points if kind == "position" or group.angles is None else group.angles for group in groups]
        self.numbers = np.concatenate(numbers)
        self.line = np.concatenate([group.line for group in groups])
        self.counts = np.array([len(group) for group in groups])
        self.begin = np.cumsum(self.counts) - self.counts
        self.group = np.repeat(np.arange(len(groups)), self.counts)
        self.small = self.counts < _SMALL
        names: dict[tuple[str, float, float], int] = {}
        self.family = np.array([names.setdefault((g.test, g.velocity, g.load), len(names)) for g in groups])
        self.floor = max(np.sqrt(3.0) * least, 1e-12)

    def two_places(self) -> dict[int, TwoPlaces]:
        """Return the groups whose cycles are in two places, three cycles or more in each."""
        places_of_groups = {}
        for number, (group, begin, n) in enumerate(zip(self.groups, self.begin, self.counts, strict=True)):
            if n >= _LEAST_CYCLES_OUTLYING_ROWS:
                split = _split(self.numbers[begin : begin + n], self.floor)
                if split is not None:
                    apart, fewer = split
                    lines = tuple(sorted(group.line[fewer].tolist()))
                    places_of_groups[number] = TwoPlaces(group, self.kind, apart, (len(fewer), n - len(fewer)), lines)
        return places_of_groups

    def outlying(self, places: dict[int, TwoPlaces]) -> tuple[list[OutlyingRow], list[TwoPlaces]]:
        """Return outlying rows that are in no second place of rest, and second places that are seen by them."""
        chosen = self._furthest()
        rows = np.array([row for row in np.flatnonzero(chosen) if self.group[row] not in places], dtype=np.intp)
        means, offset = self._means(chosen), self._offsets()
        keys = [
            (cycles.test, cycles.robot, cycles.pose, cycles.approach, cycles.velocity, cycles.load)
            for cycles in self.groups
        ]
        named: list[OutlyingRow] = []
        alike: dict[tuple[object, ...], TwoPlaces] = {}
        for row in rows:
            group = self.groups[self.group[row]]
            key = keys[self.group[row]]
            same = np.flatnonzero([keys[number] == key for number in self.group])
            apart = float(np.linalg.norm(offset[row]))
            near = same[np.linalg.norm(offset[same] - offset[row], axis=1) < _ALIKE * apart]
            if len(near) >= _ALIKE_ROWS:
                lines = tuple(sorted(int(self.line[other]) for other in near))
                alike.setdefault(key, TwoPlaces(group, self.kind, apart, (len(near), len(same) - len(near)), lines))
                continue
            away = float(np.linalg.norm(self.numbers[row] - means[self.group[row]]))
            others = self.numbers[(self.group == self.group[row]) & ~chosen]
            about = others - others.mean(axis=0) if len(others) else np.zeros((1, 3))
            scatter = float(np.sqrt((about**2).sum() / max(len(others) - 1, 1)))
            number = row - self.begin[self.group[row]]
            named.append(OutlyingRow(group.rows(slice(number, number + 1)), self.kind, away, scatter))
        return named, list(alike.values())

    def _furthest(self) -> NDArray[np.bool_]:
        """Return which rows are further than all others by more than tails do."""
        n = len(self.numbers)
        order = np.argsort(-self._from_medians(), kind="stable")
        outlying = np.zeros(n, dtype=bool)
        for k in range(1, min(max(3, int(_SHARE * n)), n // 4) + 1):
            chosen = np.zeros(n, dtype=bool)
            chosen[order[:k]] = True
            far = self._deviations(chosen)
            if far[chosen].min() > max(_FAR, _BEYOND[min(k, 2) - 1] * far[~chosen].max()):
                outlying = chosen
        return outlying

    def _from_medians(self) -> Array:
        """Return the distance of each row from the median of its group over what the nearest four fifths scatter by."""
        away = np.linalg.norm(self._offsets(), axis=1)
        scale = np.empty(len(self.groups))
        for k, (begin, n) in enumerate(zip(self.begin, self.counts, strict=True)):
            nearest = np.sort(away[begin : begin + n])[: max(1, int(0.8 * n))]
            scale[k] = np.sqrt((nearest**2).mean())
        for family in np.unique(self.family[self.small]):
            those = self.small & (self.family == family)
            scale[those] = np.median(away[those[self.group]])
        return np.asarray(away / np.maximum(scale, self.floor)[self.group])

    def _offsets(self) -> Array:
        """Return each row from the median of its group, ``(n, 3)``."""
        ends = zip(self.begin, self.begin + self.counts, strict=True)
        medians = np.array([np.median(self.numbers[a:b], axis=0) for a, b in ends])
        return np.asarray(self.numbers - medians[self.group])

    def _means(self, chosen: NDArray[np.bool_]) -> Array:
        """Return the mean of the rows of each group that are not chosen, ``(groups, 3)``."""
        retained = (~chosen).astype(float)
        n = np.bincount(self.group, retained, len(self.groups))
        sums = [np.bincount(self.group, retained * self.numbers[:, k], len(self.groups)) for k in range(3)]
        return np.asarray(np.stack(sums, axis=1) / np.maximum(n, 1.0)[:, None])

    def _deviations(self, chosen: NDArray[np.bool_]) -> Array:
        """Return how far each row is from the mean of the others that are not chosen, in their deviations.

        The scatter is that of the others, without the row itself; 0 where they are too few to say it.
        """
        group, groups = self.group, len(self.groups)
        retained = (~chosen).astype(float)
        n = np.bincount(group, retained, groups)
        squares = ((self.numbers - self._means(chosen)[group]) ** 2).sum(axis=1)
        # From the mean without the row: the sum of squares falls by as much where the row is left out.
        squares *= np.where(chosen, n[group] / (n[group] + 1.0), n[group] / np.maximum(n[group] - 1.0, 1e-9))
        about = np.bincount(
            group, retained * squares * np.maximum(n - 1.0, 0.0)[group] / np.maximum(n, 1.0)[group], groups
        )
        freedom = np.maximum(n - 1.0, 0.0)
        for family in np.unique(self.family[self.small]):
            those = self.small & (self.family == family)
            about[those], freedom[those] = about[those].sum(), freedom[those].sum()
        left = np.maximum(about[group] - retained * squares, 0.0)
        free = freedom[group] - retained
        variance = np.maximum(left / np.maximum(free, 1.0), self.floor**2)
        deviations = np.sqrt(squares / variance) / _gaussian_deviation(free)
        deviations = np.where(self.small[group], deviations / _CAUTION, deviations)
        return np.where(free >= _LEAST_FREEDOM, deviations, 0.0)


def _gaussian_deviation(freedom: Array) -> Array:
    """Return how many times further Student's t reaches than a Gaussian, ``(n,)``."""
    from scipy.special import ndtri, stdtrit

    each, inverse = np.unique(np.maximum(freedom, 1.0), return_inverse=True)
    return np.asarray(stdtrit(each, 1.0 - _RARE) / ndtri(1.0 - _RARE))[inverse]


def _split(points: Array, floor: float) -> tuple[float, NDArray[np.intp]] | None:
    """Return the distance of two places and the points in that of the fewer; None if one place explains the points.

    Along the first principal axis the points are parted where the two parts are furthest apart in terms of the
    scatter within them (Ashman, Bird and Zepf 1994 call that distance D).
    """
    about = points - points.mean(axis=0)
    axis = np.linalg.svd(about, full_matrices=False)[2][0]
    order = np.argsort(about @ axis, kind="stable")
    along = (about @ axis)[order]
    n = len(along)
    k = np.arange(_ALIKE_ROWS, n - _ALIKE_ROWS + 1)
    sums, squares = np.cumsum(along), np.cumsum(along**2)
    low, high = sums[k - 1] / k, (sums[-1] - sums[k - 1]) / (n - k)
    within = np.maximum(squares[-1] - k * low**2 - (n - k) * high**2, 0.0)
    far = (high - low) / np.sqrt(np.maximum(within / (n - 2), floor**2 / 3.0))
    best = int(far.argmax())
    if not far[best] > _APART:
        return None
    below, above = order[: k[best]], order[k[best] :]
    return float(high[best] - low[best]), below if len(below) <= len(above) else above
