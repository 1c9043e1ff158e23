"""Cross-validation of a linear problem from one fit: held-out residuals in closed form.

A problem with the residual r, its derivative A and Gaussian priors is one of least squares: the rows of A and of the
priors, stacked. Let ``Q R`` be the stack and e its residual at the solution. If the rows F of a fold are left out, the
solution moves by ``R^-1 d`` with ``(I - Q_F' Q_F) d = Q_F' e_F``, and the held-out residual is ``e_F + Q_F d``. That is
``(I - H_F)^-1 e_F`` with the block ``H_F = Q_F Q_F'`` of the hat matrix: Cook and Weisberg 1982, "Residuals and
Influence in Regression", section 3.6, for groups of cases; Golub, Heath and Wahba 1979, "Generalized cross-validation
as a method for choosing a good ridge parameter", section 1, for a penalty, which is a row that no fold leaves out. It
is exact for a linear problem with weights and penalties that stay as they are.

Candidates are further columns C with priors at zero. What the fit's own columns can take of them is taken out fold by
fold, once (Frisch and Waugh 1933, "Partial time regressions as compared with individual trends"). Any choice among them
is then a small system a fold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array

# Which configurations are held out together: by chance, or in blocks where data lie on a grid or a path.
#
# A configuration of a grid or a path has neighbours that are almost the same. A fold of single ones would praise a
# model for what it took from them. There the folds are made of blocks of neighbours in joint space (Roberts and others
# 2017, "Cross-validation strategies for data with temporal, spatial, hierarchical, or phylogenetic structure").
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


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear problem at its solution."""

    Q: Array  #: Orthonormal basis of its columns, ``(rows + penalties, columns)``: rows of the readings first.
    residual: Array  #: Of the stacked rows at the solution, ``(rows + penalties,)``.
    #: Fold of each row of the readings, from 0, ``(rows,)``; -1 for rows that no fold leaves out.
    fold: NDArray[np.intp]

    @classmethod
    def of(cls, residual: Array, columns: Array, offset: Array, penalty: Array, fold: NDArray[np.intp]) -> LinearFit:
        """Return the fit that minimises ``|residual + columns u|^2 + |penalty (u + offset)|^2``.

        Args:
            residual, columns: ``(rows,)`` and ``(rows, p)``.
            offset, penalty: Of each unknown, ``(p,)``.
            fold: Of each row, ``(rows,)``.
        """
        Q = np.linalg.qr(np.concatenate([columns, np.diag(penalty)]))[0]
        target = np.concatenate([residual, penalty * offset])
        return cls(Q, target - Q @ (Q.T @ target), fold)

    def with_columns(self, columns: Array) -> LinearFit:
        """Return the fit with more unknowns, whose columns are ``(rows, k)`` per prior; their priors are at zero."""
        added = _stacked(self.Q, columns)
        Q = np.concatenate([self.Q, np.zeros((columns.shape[1], self.Q.shape[1]))])
        for _ in range(2):  # twice, against rounding
            added -= Q @ (Q.T @ added)
        added = np.linalg.qr(added)[0]
        residual = np.concatenate([self.residual, np.zeros(columns.shape[1])])
        return LinearFit(np.concatenate([Q, added], axis=1), residual - added @ (added.T @ residual), self.fold)

    @property
    def folds(self) -> int:
        """How many folds there are."""
        return int(self.fold.max(initial=-1)) + 1

    @property
    def spent(self) -> float:
        """How many equations' worth of residual the columns use up: the trace of the hat matrix."""
        return float(np.sum(self.Q[: len(self.fold)] ** 2))

    def held_out(self, only: int | None = None) -> Array:
        """Return the residual of every row as the fit without its fold leaves it, ``(rows,)``; of one fold if asked."""
        found = self.residual[: len(self.fold)].copy()
        for number in range(self.folds) if only is None else [only]:
            mine = np.flatnonzero(self.fold == number)
            Q, e = self.Q[mine], self.residual[mine]
            if len(mine) <= Q.shape[1]:
                found[mine] = np.linalg.solve(np.eye(len(mine)) - Q @ Q.T, e)
            else:
                found[mine] = e + Q @ np.linalg.solve(np.eye(Q.shape[1]) - Q.T @ Q, Q.T @ e)
        return found


@dataclass(frozen=True, eq=False)
class Fold:
    """A fold, with the fit's own columns taken out: all that a choice among the candidates needs."""

    rows: NDArray[np.intp]  #: Held-out rows.
    residual: Array  #: What the fit without them leaves of them, ``(m,)``.
    columns: Array  #: What one of each candidate column adds to that, ``(m, k)``.
    #: inner, pull: normal equations of the candidates on the other rows, with their priors, ``(k, k)`` and ``(k,)``.
    inner: Array
    pull: Array
    #: by_fit, by_columns: how the solution moves in the basis of the fit's own columns, ``(p,)``, and ``(p, k)`` with
    #: one of each candidate.
    by_fit: Array
    by_columns: Array

    def values(self, chosen: NDArray[np.intp]) -> Array:
        """Return the values that some candidates get from the other rows, ``(chosen,)``."""
        return np.asarray(-np.linalg.solve(self.inner[np.ix_(chosen, chosen)], self.pull[chosen]))


@dataclass(frozen=True, eq=False)
class Extensions:
    """A fit and candidate columns, any of which could be added."""

    fit: LinearFit  #: What they are added to.
    columns: Array  #: Of all candidates, per prior, ``(rows, k)``.
    #: What the columns are where held-out rows are predicted, if they are others there, ``(rows, k)``.
    predicting: Array | None = None

    @cached_property
    def apart(self) -> Array:
        """The columns, stacked on their priors, without what the fit's own can take, ``(rows + penalties, k)``."""
        Q, added = self.fit.Q, _stacked(self.fit.Q, self.columns)
        added[: len(Q)] -= Q @ (Q.T @ added[: len(Q)])
        return added

    @cached_property
    def folds(self) -> tuple[Fold, ...]:
        """What each fold knows of the candidates."""
        C, n = self.apart, len(self.fit.fold)
        G, g = C.T @ C, C[: len(self.fit.Q)].T @ self.fit.residual
        found = []
        for number in range(self.fit.folds):
            mine = np.flatnonzero(self.fit.fold == number)
            Q, e, own = self.fit.Q[:n][mine], self.fit.residual[mine], C[mine]
            inverse = np.linalg.inv(np.eye(Q.shape[1]) - Q.T @ Q)
            by_own = inverse @ (Q.T @ own)  # how the fit's own columns follow: it minimises over the other rows
            by_fit = inverse @ (Q.T @ e)
            added = own + Q @ by_own
            inner = G - own.T @ added
            pull = g - own.T @ (e + Q @ by_fit)
            if self.predicting is not None:
                added = added + (self.predicting - self.columns)[mine]
            found.append(Fold(mine, e + Q @ by_fit, added, inner, pull, by_fit, by_own))
        return tuple(found)

    def held_out(self, chosen: Sequence[int] | NDArray[np.intp] = ()) -> Array:
        """Return the residual of every row as the fit without its fold leaves it, with some columns, ``(rows,)``."""
        found = self.fit.residual[: len(self.fit.fold)].copy()
        places = np.asarray(chosen, dtype=np.intp)
        for fold in self.folds:
            left = fold.residual
            if len(places):
                left = left + fold.columns[:, places] @ fold.values(places)
            found[fold.rows] = left
        return found

    def without_fold(self, number: int, chosen: Sequence[int] | NDArray[np.intp] = ()) -> Array:
        """Return the residual of every row as the fit without a fold leaves it, with some columns, ``(rows,)``."""
        fold, n, places = self.folds[number], len(self.fit.fold), np.asarray(chosen, dtype=np.intp)
        values = fold.values(places)
        moved = fold.by_fit + fold.by_columns[:, places] @ values
        return np.asarray(self.fit.residual[:n] + self.fit.Q[:n] @ moved + self.apart[:n, places] @ values)

    def solved(self, chosen: Sequence[int] | NDArray[np.intp] = ()) -> Array:
        """Return the residual of every row as the fit to all rows leaves it, with some columns, ``(rows,)``."""
        C, n = self.apart[:, np.asarray(chosen, dtype=np.intp)], len(self.fit.fold)
        values = -np.linalg.solve(C.T @ C, C[: len(self.fit.Q)].T @ self.fit.residual)
        return np.asarray(self.fit.residual[:n] + C[:n] @ values)

    def excited(self, chosen: Sequence[int] | NDArray[np.intp]) -> bool:
        """Return whether the readings know any of some columns better than their priors do."""
        return bool(np.sum(self.apart[: len(self.fit.fold), chosen] ** 2) > 1.0)


def _stacked(Q: Array, columns: Array) -> Array:
    """Return columns ``(rows, k)`` on the priors of what is there already and of their own."""
    more = columns.shape[1]
    found = np.zeros((len(Q) + more, more))
    found[: len(columns)] = columns
    found[len(Q) :] = np.eye(more)
    return found
