"""Which configurations are held out together: by chance, or in blocks where data lie on a grid or a path.

A configuration of a grid or a path has neighbours that are almost the same. A fold of single ones would praise a model
for what it took from them. There the folds are made of blocks of neighbours in joint space (Roberts and others 2017,
"Cross-validation strategies for data with temporal, spatial, hierarchical, or phylogenetic structure").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array

FOLDS: Final = 5
#: How the configurations lie: anywhere, along a way from one to the next, on few positions of each joint, or close to
#: each other.
Layout = Literal["scattered", "path", "grid", "close"]
_BLOCKS: Final = 3  # a fold, at least
_LEAST_FOR_BLOCKS: Final = 40  # configurations
#: Configurations that are held out in all, each once in every draw, and draws at most.
_HELD_OUT: Final = 100
_MOST_DRAWS: Final = 4
#: Median step from one configuration to the next, over the median distance of any two, below which it is a path.
_PATH: Final = 0.75
#: Distinct positions of a joint, by configurations, up to which it was moved in steps.
_STEPPED: Final = 0.34
#: Distance of the nearest neighbour, over what it would be if the joints had moved each for itself, that is close.
_CLOSE: Final = 0.3
_SAME: Final = 1e-4  # positions of a joint in a grid [rad or m]
_MOST: Final = 600  # configurations whose distances are looked at


@dataclass(frozen=True, eq=False)
class Folds:
    """Which configurations are held out together."""

    layout: Layout  #: How the configurations lie.
    of: NDArray[np.intp]  #: Fold of each configuration, ``(configurations,)``.
    #: Group of each configuration, ``(configurations,)``: its block, or itself where folds are drawn one by one. What
    #: configurations of a group gain hangs together.
    group: NDArray[np.intp]

    @property
    def blocks(self) -> int:
        """How many blocks there are; 0 where configurations were drawn one by one."""
        return 0 if self.layout == "scattered" else int(self.group.max()) + 1


def folds_of(data: Dataset, seed: int, again: int = 0) -> Folds:
    """Return the folds of a dataset.

    Args:
        again: Number of the draw, from 0: others draw other folds.
    """
    n, rng = data.configurations, np.random.default_rng([seed, again] if again else seed)
    layout = layout_of(data)
    of = np.empty(n, dtype=np.intp)
    if layout == "scattered" or n < _LEAST_FOR_BLOCKS:
        of[rng.permutation(n)] = np.arange(n) * FOLDS // n
        return Folds("scattered", of, np.arange(n))
    group = _blocks(_standardised(data.joints), n // (FOLDS * _BLOCKS))
    count = int(group.max()) + 1
    of_block = np.empty(count, dtype=np.intp)
    of_block[rng.permutation(count)] = np.arange(count) % FOLDS
    return Folds(layout, of_block[group], group)


def draws_of(data: Dataset, seed: int) -> tuple[Folds, ...]:
    """Return as many draws of folds as let enough configurations be held out.

    Of few configurations, one draw says much by chance (Kohavi 1995, "A study of cross-validation and bootstrap for
    accuracy estimation and model selection").
    """
    count = min(max(-(-_HELD_OUT // max(data.configurations, 1)), 1), _MOST_DRAWS)
    return tuple(folds_of(data, seed, again) for again in range(count))


def layout_of(data: Dataset) -> Layout:
    """Return how the configurations of a dataset lie."""
    rng = np.random.default_rng(0)
    q = _standardised(data.joints)
    n = len(q)
    if n < 20 or q.shape[1] == 0:
        return "scattered"
    moving = data.joints[:, np.ptp(data.joints, axis=0) > _SAME]
    if all(len(np.unique(np.round(joint / _SAME))) <= _STEPPED * n for joint in moving.T):
        return "grid"
    if data.number is not None:
        way = q[np.argsort(data.number, kind="stable")]
        step = np.median(np.linalg.norm(np.diff(way, axis=0), axis=1))
        if step < _PATH * np.median(np.linalg.norm(q - np.roll(rng.permutation(q), 1, axis=0), axis=1)):
            return "path"
    some = q if n <= _MOST else q[rng.permutation(n)[:_MOST]]
    apart = np.column_stack([rng.permutation(joint) for joint in some.T])
    return "close" if _neighbour(some) < _CLOSE * _neighbour(apart) else "scattered"


def _standardised(joints: Array) -> Array:
    """Return the positions of the joints that move, each divided by its spread."""
    spread = joints.std(axis=0)
    moves = spread > _SAME
    return np.asarray((joints[:, moves] - joints[:, moves].mean(axis=0)) / spread[moves])


def _neighbour(q: Array) -> float:
    """Return the median distance to the nearest neighbour."""
    squares = (q**2).sum(axis=1)
    apart = squares[:, None] + squares - 2.0 * q @ q.T
    np.fill_diagonal(apart, np.inf)
    return float(np.sqrt(np.maximum(np.median(apart.min(axis=1)), 0.0)))


def _blocks(q: Array, most: int) -> NDArray[np.intp]:
    """Return the block of each configuration: halves of halves, across the widest direction, of `most` at most."""
    block = np.zeros(len(q), dtype=np.intp)
    count, waiting = 0, [np.arange(len(q))]
    while waiting:
        mine = waiting.pop()
        if len(mine) <= max(most, 1):
            block[mine] = count
            count += 1
            continue
        centred = q[mine] - q[mine].mean(axis=0)
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        order = np.argsort(along, kind="stable")
        half = len(mine) // 2
        waiting += [mine[order[:half]], mine[order[half:]]]
    return block
