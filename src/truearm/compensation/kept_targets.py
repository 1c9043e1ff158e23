"""Which targets stay where they are, because their correction would rather do harm.

A target is kept where its correction makes it worse with a probability above 10 %. Targets joined by straight or
circular moves, or written as offsets from each other, must not be torn apart: where keeping some of them would leave a
step of more than 0.1 mm in such a path, all of them are corrected or all are kept, by the probability that the sum of
squares of their distances grows.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.expected_errors import ExpectedErrors
from truearm.compensation.programs.program import Program
from truearm.modeling.chain import Array

#: Probability that a target gets worse above which it is not corrected.
LIKELY: Final = 0.1
#: A step that a path may have [m].
LARGEST_STEP: Final = 1e-4


def paths_of(program: Program) -> NDArray[np.intp]:
    """Return the number of the path that each target belongs to, ``(n,)``: of all that may not be torn apart."""
    first = list(range(len(program.targets)))

    def root(row: int) -> int:
        while first[row] != row:
            first[row] = row = first[first[row]]
        return row

    for row, target in enumerate(program.targets):
        if target.parent is not None:
            first[root(row)] = root(target.parent)
    before = None
    for move in program.moves:
        if move.kind != "joint":
            joined = [] if move.via is None else [move.via]
            if before is not None and (before.routine, before.source) == (move.routine, move.source):
                joined.append(before.target)
            for row in joined:
                first[root(row)] = root(move.target)
        before = move
    roots = np.array([root(row) for row in range(len(first))], dtype=np.intp)
    return np.asarray(np.unique(roots, return_inverse=True)[1], dtype=np.intp)


def kept_targets(program: Program, moved: Array, expected: ExpectedErrors) -> NDArray[np.bool_]:
    """Return which targets of a program stay as they are, ``(n,)``.

    Args:
        moved: By how much their correction would move them [m], ``(n,)``.
        expected: What is expected of them.
    """
    paths = paths_of(program)
    count = int(paths.max(initial=-1)) + 1
    judged = np.isfinite(expected.worse)
    kept = judged & (np.nan_to_num(expected.worse) > LIKELY)
    offsets = [row for row, target in enumerate(program.targets) if target.parent is not None]
    step = np.bincount(paths, kept & (moved > LARGEST_STEP), count) > 0
    step[paths[offsets]] = True
    mixed = step & (np.bincount(paths, kept, count) > 0) & (np.bincount(paths, judged & ~kept, count) > 0)
    together = np.nan_to_num(expected.group_worse) > LIKELY
    return np.where(mixed[paths], judged & together, kept)
