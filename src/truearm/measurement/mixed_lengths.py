"""Readings in another unit of length than the others: by how much, and which they are, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset, IntArray
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.shown import counted

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
#: So many names, or runs of them, are listed: each of these rows must be mended.
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
    said = []
    for by, words in LENGTH_FACTORS:
        mine = factor == by
        if mine.any():
            said.append(f"the positions at {_names(data, mine)} are {words}")
    at = tuple(
        (data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in np.flatnonzero(factor != 1.0)
    )
    told = "; ".join(said)
    return f"{told[0].upper()}{told[1:]}; those of the others are not. Mend the numbers of these rows", at


def length_notice(data: Dataset, factor: Array) -> Notice:
    """Return the error about readings in another unit than the others, as `lengths_noticed` takes them."""
    words, at = lengths_noticed(data, factor)
    return Notice("unit-length", f"{words}.", "error", at=at)


def _names(data: Dataset, mine: NDArray[np.bool_]) -> str:
    """Name readings: a configuration all of whose positions are among them by its label alone."""
    read = data.has_position
    whole = np.setdiff1d(data.configuration[mine], data.configuration[read & ~mine])
    single = np.flatnonzero(mine & ~np.isin(data.configuration, whole)).tolist()
    found = []
    if len(whole):
        found.append(named_configurations(data.labels, whole))
    if single:
        names = [f"{data.labels[data.configuration[r]]}/{data.targets[data.target[r]]}" for r in single]
        found.append(f"{_listed([(name, 1) for name in names], 'reading')} (configuration/target)")
    return " and at ".join(found)


def named_configurations(labels: Sequence[str], which: IntArray) -> str:
    """Name configurations: ``configuration 5``, ``configurations 5 to 10, 12``."""
    what = "configuration" if len(which) == 1 else "configurations"
    return f"{what} {_listed(_in_runs(labels, which), 'configuration')}"


def _in_runs(labels: Sequence[str], which: IntArray) -> list[tuple[str, int]]:
    """Return names of configurations and how many each is of: those numbered one after the other are one."""
    found: list[tuple[str, int]] = []
    names = [labels[c] for c in which.tolist()]
    first = 0
    while first < len(names):
        end = first + 1
        while end < len(names) and names[end - 1].isdecimal() and names[end] == str(int(names[end - 1]) + 1):
            end += 1
        if end - first < _LEAST_RUN:
            end = first + 1
        found.append((names[first] if end == first + 1 else f"{names[first]} to {names[end - 1]}", end - first))
        first = end
    return found


def _listed(runs: Sequence[tuple[str, int]], thing: str) -> str:
    """List names, the first ones of very many."""
    rest = sum(count for _, count in runs[_MOST_NAMED:])
    first = ", ".join(name for name, _ in runs[:_MOST_NAMED])
    return f"{first} and {counted(rest, f'more {thing}')}" if rest else first
