"""One program corrected: its targets before and after, and which of them stay where they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.programs.chosen_targets import Kept
from truearm.engine.programs.expected_errors import ExpectedErrors
from truearm.engine.programs.gauge import common_motion, turns_between
from truearm.engine.programs.program import Edit, Program, Skipped
from truearm.engine.robot.chain import Array

#: So few targets can be moved almost anyhow by a common motion: of them no remainder says anything.
_FEW_TARGETS: Final = 3


def way_through(program: Program, tips: Array, most: int) -> Array:
    """Return tips ``(m, 3)`` in the order of the moves, with a row of NaN between routines.

    Args:
        tips: Of the targets, ``(n, 4, 4)`` or ``(n, 3)`` [m].
        most: So many moves at most.
    """
    points = tips if tips.ndim == 2 else tips[:, :3, 3]
    parts: list[Array] = []
    routine = None
    for move in program.moves[:most]:
        if routine not in (None, move.routine):
            parts.append(np.full(3, np.nan))
        routine = move.routine
        parts += [points[row] for row in (move.via, move.target) if row is not None]
    return np.array(parts).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Correction:
    """One program corrected."""

    program: Program  #: As it was.
    edits: tuple[Edit, ...]  #: What changes in its text.
    corrected: NDArray[np.bool_]  #: Which targets, ``(n,)``.
    #: What stays as it is, and why: what the reader could not use, and targets that cannot be computed.
    skipped: tuple[Skipped, ...]
    #: before, after: tips of the targets in their frames, ``(n, 4, 4)`` [m], before and after the correction.
    before: Array
    after: Array
    tips: Array  #: Tips of the targets in the controller's base frame, ``(n, 4, 4)`` [m].
    #: Joint positions of the model with which the real robot reaches the targets [rad or m], ``(n, joints)``.
    joints: Array
    #: Corrected targets with a joint that leaves the ranges of its configuration, by less than controllers refuse.
    on_edge: tuple[int, ...]
    #: How far the real robot is expected to miss the targets before and after; None if nothing is known of that.
    expected: ExpectedErrors | None = None
    #: Targets whose correction would rather do harm: they stay as they are, unless the path that they belong to is
    #: better corrected as a whole, or all were asked for.
    not_better: tuple[int, ...] = ()
    #: Targets that stay because they shall, by their index, and why.
    kept: Mapping[int, Kept] = field(default_factory=dict)

    @cached_property
    def moved(self) -> Array:
        """By how much each target was moved [m], ``(n,)``; zero where it was not corrected."""
        return np.asarray(np.linalg.norm(self.after[:, :3, 3] - self.before[:, :3, 3], axis=1))

    @cached_property
    def turned(self) -> Array:
        """By how much each target was turned [rad], ``(n,)``."""
        return np.asarray(np.linalg.norm(turns_between(self.before, self.after), axis=1))

    def motions(self, rows: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Return what a correction does to targets, as :func:`truearm.engine.programs.gauge.common_motion` takes it."""
        axes = self.tips[rows, :3, :3] @ self.before[rows, :3, :3].swapaxes(1, 2)
        moved = axes @ (self.after - self.before)[rows, :3, 3:]
        turned = axes @ turns_between(self.before[rows], self.after[rows])[:, :, None]
        return self.tips[rows, :3, 3], moved, turned


@dataclass(frozen=True)
class Shared:
    """The part of a correction that all targets have in common, as one rigid body, and what is left."""

    moved: float  #: By how much the middle of the targets is moved [m].
    turned: float  #: By how much the body is turned [rad].
    remainder: float  #: How far targets are moved beside that, on average [m].


def shared_motion(parts: Sequence[tuple[Array, Array, Array]]) -> Shared | None:
    """Return what corrected targets share, of what :meth:`Correction.motions` gives; None of three targets or fewer."""
    if sum(len(places) for places, _, _ in parts) <= _FEW_TARGETS:
        return None
    motion = common_motion(parts)
    left = np.concatenate([moved - motion.of(places) for places, moved, _ in parts])
    return Shared(
        float(np.linalg.norm(motion.moved)),
        float(np.linalg.norm(motion.turned)),
        float(np.linalg.norm(left, axis=1).mean()),
    )


# A target is kept where its correction makes it worse with a probability above 10 %. Targets joined by straight or
# circular moves, or written as offsets from each other, must not be torn apart: where keeping some of them would leave
# a step of more than 0.1 mm in such a path, all of them are corrected or all are kept, by the probability that the sum
# of squares of their distances grows.

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
    unchanged = judged & (np.nan_to_num(expected.worse) > LIKELY)
    offsets = [row for row, target in enumerate(program.targets) if target.parent is not None]
    step = np.bincount(paths, unchanged & (moved > LARGEST_STEP), count) > 0
    step[paths[offsets]] = True
    mixed = step & (np.bincount(paths, unchanged, count) > 0) & (np.bincount(paths, judged & ~unchanged, count) > 0)
    together = np.nan_to_num(expected.group_worse) > LIKELY
    return np.where(mixed[paths], judged & together, unchanged)
