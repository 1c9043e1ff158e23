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

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array


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
