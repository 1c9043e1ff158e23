"""Cross-validation of a linear problem from one fit: held-out residuals in closed form.

A problem with the residual r, its derivative A and Gaussian priors is one of least squares: the rows of A and of the
priors, stacked. Let ``Q R`` be the stack and e its residual at the solution. If the rows F of a fold are left out, the
solution moves by ``R^-1 d`` with ``(I - Q_F' Q_F) d = Q_F' e_F``, and the held-out residual is ``e_F + Q_F d``. That is
``(I - H_F)^-1 e_F`` with the block ``H_F = Q_F Q_F'`` of the hat matrix: Cook and Weisberg 1982, "Residuals and
Influence in Regression", section 3.6, for groups of cases; Golub, Heath and Wahba 1979, "Generalized cross-validation as
a method for choosing a good ridge parameter", section 1, for a penalty, which is a row that no fold leaves out. It is
exact for a linear problem with weights and penalties that stay as they are.

Columns are added to Q by Gram and Schmidt, twice for rounding's sake, so that a candidate costs no more than its own
columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear problem at its solution.

    Attributes
    ----------
    Q
        Orthonormal basis of its columns, ``(rows + penalties, columns)``: rows of the readings first.
    residual
        Of the stacked rows at the solution, ``(rows + penalties,)``.
    fold
        Fold of each row of the readings, from 0, ``(rows,)``; -1 for rows that no fold leaves out.
    """

    Q: Array
    residual: Array
    fold: NDArray[np.intp]

    @classmethod
    def of(cls, residual: Array, columns: Array, offset: Array, penalty: Array, fold: NDArray[np.intp]) -> LinearFit:
        """Return the fit that minimises ``|residual + columns u|^2 + |penalty (u + offset)|^2``.

        Parameters
        ----------
        residual, columns
            ``(rows,)`` and ``(rows, p)``.
        offset, penalty
            Of each unknown, ``(p,)``.
        fold
            Of each row, ``(rows,)``.
        """
        Q = np.linalg.qr(np.concatenate([columns, np.diag(penalty)]))[0]
        target = np.concatenate([residual, penalty * offset])
        return cls(Q, target - Q @ (Q.T @ target), fold)

    def with_columns(self, columns: Array, penalty: Array) -> LinearFit:
        """Return the fit with more unknowns ``(k,)``, whose columns are ``(rows, k)`` and whose priors are at zero."""
        more = len(penalty)
        Q = np.concatenate([self.Q, np.zeros((more, self.Q.shape[1]))])
        added = np.zeros((len(Q), more))
        added[: len(self.fold)] = columns
        added[-more:] = np.diag(penalty)
        for _ in range(2):
            added -= Q @ (Q.T @ added)
        added = np.linalg.qr(added)[0]
        residual = np.concatenate([self.residual, np.zeros(more)])
        return LinearFit(np.concatenate([Q, added], axis=1), residual - added @ (added.T @ residual), self.fold)

    def held_out(self) -> Array:
        """Return the residual of every row as the fit without its fold leaves it, ``(rows,)``."""
        found = self.residual[: len(self.fold)].copy()
        for number in range(int(self.fold.max(initial=-1)) + 1):
            mine = np.flatnonzero(self.fold == number)
            Q, e = self.Q[mine], self.residual[mine]
            if len(mine) <= Q.shape[1]:
                found[mine] = np.linalg.solve(np.eye(len(mine)) - Q @ Q.T, e)
            else:
                found[mine] = e + Q @ np.linalg.solve(np.eye(Q.shape[1]) - Q.T @ Q, Q.T @ e)
        return found
