"""What readings of one arrival share: the robot stops once, and every target is read with the same joint errors.

With errors of the joints of variance S, the residuals of an arrival, each divided by its own deviation, have the
covariance ``V = I + G S G'``, where G is their derivative by the joints. Multiplied by ``V^-1/2`` they are independent
again. With ``H = G S^1/2`` that is ``I - H f(H'H) H'`` for a function f of a small matrix, so no matrix of all rows is
ever formed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.problem import Evaluation, Problem, Rows
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Equations gathered by arrival."""

    of_row: NDArray[np.intp]  #: Index of the arrival of each equation, ``(rows,)``, without gaps.

    @property
    def count(self) -> int:
        """Number of arrivals."""
        return int(self.of_row.max(initial=-1)) + 1

    @cached_property
    def alike(self) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]:
        """Arrivals with equally many equations: their indices ``(k,)`` and the places of their equations ``(k, m)``."""
        sizes = np.bincount(self.of_row)
        order = np.argsort(self.of_row, kind="stable")
        first = np.cumsum(sizes) - sizes
        return tuple(
            (mine, order[first[mine][:, None] + np.arange(size)])
            for size in np.unique(sizes).tolist()
            if len(mine := np.flatnonzero(sizes == size))
        )

    def of(self, rows: Rows) -> Arrivals:
        """Return the arrivals of some equations: all those of some arrivals."""
        if isinstance(rows, slice):
            return self
        return Arrivals(np.unique(self.of_row[rows], return_inverse=True)[1].reshape(-1))

    def products(self, left: Array, right: Array) -> Array:
        """Return ``left' right`` of each arrival, ``(arrivals, a, b)``, for ``(rows, a)`` and ``(rows, b)``."""
        found = np.empty((self.count, left.shape[1], right.shape[1]))
        for mine, rows in self.alike:
            found[mine] = np.swapaxes(left[rows], 1, 2) @ right[rows]
        return found

    def spread(self, left: Array, right: Array) -> Array:
        """Return ``left right`` of each arrival, ``(rows, b)``, for ``(rows, a)`` and ``(arrivals, a, b)``."""
        found = np.empty((len(left), right.shape[2]))
        for mine, rows in self.alike:
            found[rows] = left[rows] @ right[mine]
        return found


@dataclass(frozen=True, eq=False)
class Whitening:
    """Makes the residuals of an arrival independent."""

    arrivals: Arrivals  #: Which equations hang together.
    shared: Array  #: Derivative of the equations by the joints, times the deviations of these, ``(rows, joints)``.

    def of(self, rows: Rows) -> Whitening:
        """Return it for some equations: all those of some arrivals."""
        if isinstance(rows, slice):
            return self
        return Whitening(self.arrivals.of(rows), self.shared[rows])

    @cached_property
    def _inner(self) -> tuple[Array, Array]:
        """Eigenvalues ``(arrivals, joints)`` and eigenvectors of ``shared' shared`` of each arrival."""
        values, vectors = np.linalg.eigh(self.arrivals.products(self.shared, self.shared))
        return np.maximum(values, 0.0), vectors

    def applied(self, rows: Array) -> Array:
        """Return ``V^-1/2`` times equations ``(rows,)`` or ``(rows, columns)``."""
        root = np.sqrt(1.0 + self._inner[0])
        return self._times(rows, -1.0 / (root * (1.0 + root)))

    def undone(self, rows: Array) -> Array:
        """Return ``V^1/2`` times equations ``(rows,)`` or ``(rows, columns)``."""
        return self._times(rows, 1.0 / (1.0 + np.sqrt(1.0 + self._inner[0])))

    def _times(self, rows: Array, factor: Array) -> Array:
        flat = rows.reshape(len(rows), -1)
        vectors = self._inner[1]
        inner = (vectors * factor[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        product = inner @ self.arrivals.products(self.shared, flat)
        return np.asarray(rows + self.arrivals.spread(self.shared, product).reshape(rows.shape))


@dataclass(frozen=True, eq=False)
class WhitenedProblem:
    """A problem whose equations are made independent, as :func:`truearm.identification.solving.solver.solve` takes it.

    It is for the linear loss: a reading is no longer a few consecutive equations of its own.
    """

    plain: Problem
    whitening: Whitening

    @property
    def free(self) -> FreeParameters:
        """What may change."""
        return self.plain.free

    @property
    def priors(self) -> bool:
        """Whether the parameters' priors are rows of the problem."""
        return self.plain.priors

    @property
    def components(self) -> NDArray[np.intp]:
        """Number of consecutive rows of each reading, ``(readings,)``."""
        return self.plain.components

    def at(self, vector: Array) -> WhitenedEvaluation:
        """Evaluate it at a vector ``(parameters,)``."""
        return WhitenedEvaluation(self, self.plain.at(vector))

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``."""
        return self.plain.prior_rows(vector)


@dataclass(frozen=True, eq=False)
class WhitenedEvaluation:
    """A whitened problem at one vector of its free parameters."""

    problem: WhitenedProblem
    plain: Evaluation

    @property
    def vector(self) -> Array:
        """Where, ``(parameters,)``."""
        return self.plain.vector

    def portions(self) -> Iterator[tuple[Rows, WhitenedEvaluation]]:
        """Go through the problem part by part, each with its equations."""
        for rows, part in self.plain.portions():
            whitening = self.problem.whitening.of(rows)
            yield rows, WhitenedEvaluation(WhitenedProblem(part.problem, whitening), part)

    @cached_property
    def residual(self) -> Array:
        """Whitened residual of the readings, ``(rows,)``."""
        return self.problem.whitening.applied(self.plain.residual)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``."""
        return self.problem.whitening.applied(self.plain.jacobian)
