"""Targets on a rigid tool keep their distances: readings that do not are doubted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, counted, millimetres
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.robot.chain import Array

# Readings in another unit of length than the others: by how much, and which they are, in words.

#: What makes a position in another unit right, and what is said of it then.
LENGTH_FACTORS: Final = (
    (1e-3, "a thousand times too large, as if mm were called m"),
    (1e3, "a thousand times too small, as if m were called mm"),
    (1 / 25.4, "25.4 times too large, as if mm were called inches"),
    (25.4, "25.4 times too small, as if inches were called mm"),
)
#: No instrument reads a robot from farther away [m].
FARTHEST: Final = 1e4
#: A unit explains a position that it brings so many times nearer.
_LEAST_IMPROVEMENT: Final = 10.0
#: So many names, or runs of them, are listed: each of these rows must be corrected.
_MOST_NAMED: Final = 60
#: From so many on, configurations numbered one after the other are named by the first and the last.
_LEAST_RUN: Final = 3


def factors_of(position: Array, predicted: Array, allowed: float) -> Array:
    """Return what makes positions in another unit right, 1 where no other unit explains them, ``(readings,)``.

    Args:
        position, predicted: What was read, and what must have been [m], ``(readings, 3)``; NaN where it is not known.
        allowed: How far off a position may be that is explained [m].
    """
    off = np.linalg.norm(position - predicted, axis=1)
    factor = np.ones(len(position))
    least = np.minimum(allowed, off / _LEAST_IMPROVEMENT)
    for by, _ in LENGTH_FACTORS:
        gap = np.linalg.norm(by * position - predicted, axis=1)
        nearer = gap <= least  # false of NaN
        factor[nearer], least[nearer] = by, gap[nearer]
    return factor


def lengths_noticed(data: Dataset, factor: Array) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return in words which readings are in another unit, without a full stop, and which they are.

    Args:
        factor: What makes each reading right, ``(readings,)``; one of those of `LENGTH_FACTORS` somewhere.
    """
    parts = []
    for by, words in LENGTH_FACTORS:
        selected = factor == by
        if selected.any():
            parts.append(f"the positions at {_names(data, selected)} are {words}")
    at = tuple(
        (data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in np.flatnonzero(factor != 1.0)
    )
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}; those of the others are not. Fix the numbers of these rows", at


def length_notice(data: Dataset, factor: Array) -> Notice:
    """Return the error about readings in another unit than the others, as `lengths_noticed` takes them."""
    words, at = lengths_noticed(data, factor)
    return UNIT_LENGTH(f"{words}.", at=at)


def _names(data: Dataset, selected: NDArray[np.bool_]) -> str:
    """Name readings: a configuration all of whose positions are among them by its label alone."""
    read = data.has_position
    whole = np.setdiff1d(data.configuration[selected], data.configuration[read & ~selected])
    single = np.flatnonzero(selected & ~np.isin(data.configuration, whole)).tolist()
    parts = []
    if len(whole):
        parts.append(named_configurations(data.labels, whole))
    if single:
        names = [f"{data.labels[data.configuration[r]]}/{data.targets[data.target[r]]}" for r in single]
        parts.append(f"{_listed([(name, 1) for name in names], 'reading')} (configuration/target)")
    return " and at ".join(parts)


def named_configurations(labels: Sequence[str], configurations: IntArray) -> str:
    """Name configurations: ``configuration 5``, ``configurations 5 to 10, 12``."""
    noun = "configuration" if len(configurations) == 1 else "configurations"
    return f"{noun} {_listed(_in_runs(labels, configurations), 'configuration')}"


def _in_runs(labels: Sequence[str], configurations: IntArray) -> list[tuple[str, int]]:
    """Return names of configurations and how many each is of: those numbered one after the other are one."""
    runs: list[tuple[str, int]] = []
    names = [labels[c] for c in configurations.tolist()]
    first = 0
    while first < len(names):
        end = first + 1
        while end < len(names) and names[end - 1].isdecimal() and names[end] == str(int(names[end - 1]) + 1):
            end += 1
        if end - first < _LEAST_RUN:
            end = first + 1
        runs.append((names[first] if end == first + 1 else f"{names[first]} to {names[end - 1]}", end - first))
        first = end
    return runs


def _listed(runs: Sequence[tuple[str, int]], thing: str) -> str:
    """List names, the first ones of very many."""
    left = sum(count for _, count in runs[_MOST_NAMED:])
    first = ", ".join(name for name, _ in runs[:_MOST_NAMED])
    return f"{first} and {counted(left, f'more {thing}')}" if left else first


# Where targets were read, configuration by configuration: as many places as readings, and no table of both.
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
        rows = self.at(configuration)
        row = rows.start + int(np.searchsorted(self.target[rows], target))
        return self.position[row] if row < rows.stop and self.target[row] == target else None

    def usual(self) -> Array:
        """Return the median place of each target [m], ``(targets, 3)``; NaN where it was not read."""
        usual = np.full((self.targets, 3), np.nan)
        for axis in range(3):
            names, medians = grouped_medians(self.target, self.position[:, axis])
            usual[names, axis] = medians
        return usual


def places_of(data: Dataset) -> Places:
    """Return where the targets of a dataset were read in the instrument's own frame."""
    present = np.flatnonzero(data.has_position)
    both = data.configuration[present] * max(len(data.targets), 1) + data.target[present]
    each, place, count = np.unique(both, return_inverse=True, return_counts=True)
    position = np.empty((len(each), 3))
    for axis in range(3):
        position[:, axis] = np.bincount(place, data.position[present, axis], len(each)) / count
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


UNIT_LENGTH: Final = Rule(
    "unit-length",
    "error",
    "positions that fit when they are so many times larger or smaller, all of them, one column, or [those of some "
    "rows](check.md#rows-in-another-unit-of-length); or that lie far beyond the reach, and no one unit makes them "
    "fit",
)
OUTLIERS: Final = Rule(
    "outliers",
    "warning",
    "a reading that does not keep its distances to the other targets, or lies far from where a robust fit puts it; "
    "or 5 % of the readings and more that are six times farther off than half of all",
)
TARGETS_SWAPPED: Final = Rule(
    "targets-swapped",
    ("warning", "error"),
    "two targets of a configuration that were exchanged (without a robot not told where distances are the same with "
    "exchanged names, as on an equilateral triangle)",
    gravity=2,
)
TARGET_MISTAKEN: Final = Rule(
    "target-mistaken",
    ("warning", "error"),
    "a reading that is where another target or a reference point is, or where its target was before; an error where "
    "it pulls the fit, with the losses `linear` and `huber`",
    gravity=2,
)

#: A distance, or a place, that holds better than this is never doubted [m].
UNMOVED: Final = 1e-4
#: How many robust deviations a distance or a place may be off.
DEVIATIONS: Final = 10.0
#: A reading this close to another known point was taken from it [m].
SAME_POINT: Final = 1e-3
#: To how many of the next targets of a configuration distances are taken: of up to nine targets that is all of them.
_PARTNERS: Final = 8
#: So many of the distances of a wrong reading are off; across its error a distance hardly changes.
_WRONG_SHARE: Final = 0.75
#: Among so many targets of a configuration exchanged names are looked for.
_EXCHANGED: Final = (3, 6)
#: An exchange must change a distance by so many times what distances may be off: exchanged names of an equilateral
#: triangle change none, and explain nothing that a wrong reading does not.
_DISTINCT: Final = 1.5
#: A distance is that of another unit if it is as long as usual in that unit within this share.
_SAME_LENGTH: Final = 0.01
#: One wrong reading explains a configuration if all distances without it are off by less than this share of what they
#: may be off.
_EXPLAINED: Final = 0.3


@dataclass(frozen=True)
class Suspect:
    """A reading that cannot be what it says."""

    rule: Rule  #: What it seems to be.
    configuration: str  #: configuration, target: label and name.
    target: str
    words: str = ""  #: What it looks like, for example ``is target 2``.


@dataclass(frozen=True, eq=False)
class _Distances:
    """Distances between targets of the same configuration, and how far off they are."""

    places: Places  #: Of all targets.
    #: pairs, usual: the pairs of targets, as one number each and in order, with the median of their distances [m],
    #: ``(pairs,)``.
    pairs: IntArray
    usual: Array
    allowed: float  #: How far off a distance may be [m].
    share: Array  #: Of the distances of each place how many are off by more, ``(places,)``.
    most: Array  #: most, total: how far off the distances of each place are [m], ``(places,)``.
    total: Array

    def usual_between(self, targets: IntArray) -> Array:
        """Return the usual distances of a few targets, all of them read together once, ``(n, n)``."""
        low, high = np.minimum(targets[:, None], targets), np.maximum(targets[:, None], targets)
        index = np.minimum(np.searchsorted(self.pairs, low * self.places.targets + high), len(self.pairs) - 1)
        return np.where(low == high, 0.0, self.usual[index])


def rigid_suspects(data: Dataset) -> list[Suspect]:
    """Doubt readings whose distances to the other targets of their configuration do not hold.

    Three or more targets tell which reading is wrong; of two, both are doubted. Of many targets each is compared with
    the next few alone, so that time and memory grow with the readings and not with their square.
    """
    places = places_of(data)
    first, second = _compared(places)
    if not len(first):
        return []
    apart = np.linalg.norm(places.position[first] - places.position[second], axis=1)
    pair = places.target[first] * places.targets + places.target[second]
    pairs, usual = grouped_medians(pair, apart)
    off = np.abs(apart - usual[np.searchsorted(pairs, pair)])
    allowed = max(UNMOVED, DEVIATIONS * 1.4826 * float(np.median(off)))
    doubtful = np.unique(places.configuration[first[off > allowed]]).tolist()
    if not doubtful:
        return []
    count, ends, twice = len(places.target), np.concatenate([first, second]), np.concatenate([off, off])
    compared = np.maximum(np.bincount(ends, minlength=count), 1)
    share = np.asarray(np.bincount(ends[twice > allowed], minlength=count) / compared, dtype=np.float64)
    most, total = np.zeros(count), np.asarray(np.bincount(ends, twice, count), dtype=np.float64)
    np.maximum.at(most, ends, twice)
    distances = _Distances(places, pairs, usual, allowed, share, most, total)
    known = fixed_points(data)
    suspects: list[Suspect] = []
    for c in doubtful:
        suspects += _blamed(data, distances, c, known)
    return suspects


def scaled_distances(data: Dataset) -> dict[float, IntArray]:
    """Return the configurations whose distances between targets are all usual ones in another unit of length.

    Returns:
        Their indices by the factor that makes them usual, of those of `LENGTH_FACTORS`.
    """
    places = places_of(data)
    first, second = _compared(places)
    if not len(first):
        return {}
    apart = np.linalg.norm(places.position[first] - places.position[second], axis=1)
    pairs, usual = grouped_medians(pair := places.target[first] * places.targets + places.target[second], apart)
    usual = usual[np.searchsorted(pairs, pair)]
    configurations, allowed = places.configuration[first], _SAME_LENGTH * usual
    by_scale = {}
    for by, _ in LENGTH_FACTORS:
        other_unit = (np.abs(by * apart - usual) <= allowed) & (usual > 0.0)
        by_scale[by] = np.setdiff1d(configurations[other_unit], configurations[~other_unit])
    return {by: numbers for by, numbers in by_scale.items() if len(numbers)}


def _compared(places: Places) -> tuple[IntArray, IntArray]:
    """Return pairs of places of the same configuration, the first of the lower target, ``(pairs,)``."""
    count = len(places.configuration)
    pairs: list[tuple[IntArray, IntArray]] = []
    for step in range(1, min(_PARTNERS, count - 1) + 1):
        first = np.flatnonzero(places.configuration[step:] == places.configuration[:-step])
        pairs.append((first, first + step))
    if not pairs:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    firsts, seconds = zip(*pairs, strict=True)
    return np.concatenate(firsts), np.concatenate(seconds)


def _blamed(data: Dataset, distances: _Distances, c: int, known: dict[str, Array]) -> list[Suspect]:
    places, allowed = distances.places, distances.allowed
    rows = places.at(c)
    points, seen, label, names = places.position[rows], places.target[rows], data.labels[c], data.targets
    alone = np.ones(len(seen), dtype=bool)
    if _EXCHANGED[0] <= len(seen) <= _EXCHANGED[1]:
        usual = distances.usual_between(seen)
        swap = _swap(points, usual, allowed)
        if swap:
            return [Suspect(TARGETS_SWAPPED, label, names[seen[a]], f"is target {names[seen[b]]}") for a, b in swap]
        alone = _off_without_each(points, usual) <= _EXPLAINED * allowed
    wrong: NDArray[np.bool_] = distances.share[rows] >= _WRONG_SHARE
    if len(seen) > 2 and wrong.sum() > 1:
        wrong = np.arange(len(seen)) == np.argmax(np.where(wrong, distances.total[rows], -1.0))
    doubted = wrong if wrong.any() else distances.most[rows] > allowed
    if (doubted & alone).any():
        doubted &= alone
    others = np.flatnonzero(~doubted)
    suspects = []
    for k in np.flatnonzero(doubted).tolist():
        name, near = names[seen[k]], dict(known)
        if len(others):
            nearest = others[np.argmin(np.linalg.norm(points[others] - points[k], axis=1))]
            near[f"target {names[seen[nearest]]}"] = points[nearest]
        before = places.of(c - 1, int(seen[k]))
        if before is not None:
            near[f"target {name} at the configuration before"] = before
        suspects.append(suspect(points[k], label, name, float(distances.most[rows][k]), near))
    return suspects


def suspect(point: Array, label: str, target: str, size: float, known: dict[str, Array]) -> Suspect:
    """Say what a wrong reading is: another known point, or an outlier.

    Args:
        point: The reading [m], ``(3,)``.
        label, target: Its configuration and target.
        size: How far it is off [m].
        known: Points that it could have been taken from [m].
    """
    gaps = {name: float(np.linalg.norm(point - place)) for name, place in known.items() if np.isfinite(place).all()}
    nearest = min(gaps, key=lambda name: gaps[name]) if gaps else None
    if nearest is not None and gaps[nearest] < SAME_POINT < size:
        return Suspect(TARGET_MISTAKEN, label, target, f"is {nearest}")
    return Suspect(OUTLIERS, label, target, f"{millimetres(size)} mm off")


def _swap(seen: Array, usual: Array, allowed: float) -> list[tuple[int, int]]:
    """Return the exchange of names under which all distances hold best; nothing if there is none.

    An exchange that hardly changes the usual distances explains nothing that a wrong reading does not.

    Args:
        seen: Readings of a configuration [m], ``(n, 3)``.
        usual: Distances of their targets [m], ``(n, n)``.
    """
    orders = np.array(list(permutations(range(len(seen)))))[1:]
    changed = np.abs(usual[orders[:, :, None], orders[:, None]] - usual).max(axis=(1, 2))
    orders = orders[changed > _DISTINCT * allowed]
    if not len(orders):
        return []
    orders = orders[np.argsort((orders != np.arange(len(seen))).sum(axis=1), kind="stable")]
    points = seen[orders]
    misfit = np.abs(np.linalg.norm(points[:, :, None] - points[:, None], axis=3) - usual).max(axis=(1, 2))
    best = int(np.argmin(misfit))
    if misfit[best] > allowed:
        return []
    # the kth really is the reading named order[k]
    return [(b, a) for a, b in enumerate(orders[best].tolist()) if a != b]


def _off_without_each(points: Array, usual: Array) -> Array:
    """Return how far off distances are among all readings but one [m], for each one, ``(n,)``.

    Args:
        points: Readings of a configuration [m], ``(n, 3)``.
        usual: Distances of their targets [m], ``(n, n)``.
    """
    off = np.abs(np.linalg.norm(points[:, None] - points, axis=2) - usual)
    masks = ~np.eye(len(points), dtype=bool)
    return np.array([off[np.ix_(others, others)].max() for others in masks])


def fixed_points(data: Dataset) -> dict[str, Array]:
    """Return the usual places of the reference points [m], ``(3,)`` each."""
    if data.references is None:
        return {}
    usual = places_of(data.references).usual()
    return {f"reference {name}": place for name, place in zip(data.references.targets, usual, strict=True)}
