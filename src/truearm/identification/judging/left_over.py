"""What a fit leaves of all readings, and what its own parameters could still take of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.fit import Fit
from truearm.identification.solving.problem import Problem
from truearm.limits import limit
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.modeling.chain import Array

#: Share of the squares of a residual that rounding leaves where parameters explain all of it.
_ALL_EXPLAINED: Final = 1e-12


@dataclass(frozen=True, eq=False)
class LeftOver:
    """The whitened residuals of a fit on readings, linearised at its solution."""

    fit: Fit  #: What left them.
    problem: Problem  #: The readings; what is known of fixtures is left out.
    residual: Array  #: ``(rows,)``.
    jacobian: Array  #: Derivative by the free parameters, ``(rows, parameters)``.
    basis: Array  #: Orthonormal directions of residuals that the free parameters can take, ``(rows, rank)``.
    strength: Array  #: Singular values of the Jacobian per prior, of those directions, ``(rank,)``.
    turns: Array  #: Directions of the parameters per prior that belong to them, ``(rank, parameters)``.
    given: Dataset  #: The readings asked about.
    #: Which of their configurations these are: all, or of very many as many as the limit of derivatives has room for,
    #: evenly spaced.
    chosen: NDArray[np.intp]

    @classmethod
    def of(cls, fit: Fit, data: Dataset) -> LeftOver:
        """Linearise a fit on readings, those it was not made from too."""
        noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
        problem, chosen = _in_part(Problem(fit.robot, replace(data, setup=None), fit.free, noise))
        r, J = problem.linearised(np.array([fit.robot.values[name] for name in fit.free.names]))
        # Of the square triangle, which is small, instead of the whole Jacobian.
        Q, R = np.linalg.qr(J * fit.free.prior)
        R = _without_size(R, Q.T @ r, float(r @ r)) if len(r) > len(fit.free.names) else R
        U, s, Vt = np.linalg.svd(R, full_matrices=False)
        kept = s > 1e-8 * s[0]
        return cls(fit, problem, r, J, Q @ U[:, kept], s[kept], Vt[kept], data, chosen)

    def without(self, configurations: Sequence[int]) -> LeftOver:
        """Return what is left without some configurations; the parameters stay, and take what they can of the rest."""
        if not configurations:
            return self
        rows = ~np.isin(self.configuration, np.array(configurations, dtype=np.intp))
        data = self.problem.data
        kept = np.setdiff1d(np.arange(data.configurations), np.array(configurations, dtype=np.intp))
        return replace(
            self,
            problem=replace(self.problem, data=data.of_configurations(kept)),
            residual=self.residual[rows],
            jacobian=self.jacobian[rows],
            basis=np.linalg.qr(self.basis[rows])[0],
            chosen=self.chosen[kept],
        )

    @property
    def freedom(self) -> int:
        """Number of equations that are left when the parameters have taken what they can."""
        return len(self.residual) - int(self.basis.shape[1])

    def without_parameters(self, rows: Array) -> Array:
        """Return rows ``(rows,)`` or ``(rows, k)`` without what the free parameters can take."""
        return np.asarray(rows - self.basis @ (self.basis.T @ rows))

    @property
    def configuration(self) -> NDArray[np.intp]:
        """Configuration of each equation, ``(rows,)``."""
        return np.concatenate(
            [
                np.repeat(self.problem.data.configuration[block.readings], block.observation.components)
                for block in self.problem.blocks
            ]
        )


def _in_part(problem: Problem) -> tuple[Problem, NDArray[np.intp]]:
    """Return a problem with as many of its configurations as the limit of derivatives has room for, and which."""
    n = room = problem.data.configurations
    chosen, part, most = np.arange(n), problem, limit("derivatives")
    while room > 1 and (count := part.rows * len(part.free.names)) > most:
        room = max(1, min(room - 1, room * most // count))
        chosen = np.linspace(0, n - 1, room).round().astype(np.intp)
        part = replace(problem, data=problem.data.of_configurations(chosen))
    return part, chosen


def _without_size(R: Array, c: Array, square: float) -> Array:
    """Return the triangle of a Jacobian without the direction that shrinks everything, where no length was measured.

    Of a tip that is held at points the residual is then a length like any other: a robot without size would leave
    nothing. That is no explanation.

    Args:
        R, c: Triangle of the Jacobian per prior, and the part of the residual that its columns span.
        square: Sum of the squares of the residual.
    """
    if square == 0.0 or square - float(c @ c) > _ALL_EXPLAINED * square:
        return R
    size = np.linalg.lstsq(R, c, rcond=1e-12)[0]
    return np.asarray(R - np.outer(R @ size, size) / float(size @ size))


def chi_squared_tail(x: float, freedom: int) -> float:
    """Return the probability that chi squared of so many degrees of freedom is larger than x."""
    tail, k = (math.erfc(math.sqrt(x / 2.0)), 1) if freedom % 2 else (math.exp(-x / 2.0), 2)
    while k < freedom:
        tail += math.exp(k / 2.0 * math.log(max(x, 1e-300) / 2.0) - x / 2.0 - math.lgamma(k / 2.0 + 1.0))
        k += 2
    return tail
