"""What parameters are uncertain by where no model of the residuals holds: from the scatter of the arrivals themselves.

The parameters answer to the sum of the arrivals' pulls, so the variance of that sum, found from the pulls, gives theirs
(Huber 1967; Liang and Zeger 1986): ``H^-1 (M + K) H^-1`` with H the information, K that of the priors, and M the sum
of the squared pulls. A fit has followed each arrival part of the way; the pulls are those of Bell and McCaffrey (2002,
their second estimator), which are right on average where arrivals are alike and independent, and an interval has their
degrees of freedom (Pustejovsky and Tipton 2018). With priors all of that holds as it stands, if truths come from them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.arrivals import Arrivals
from truearm.identification.solving.problem import Rows
from truearm.identification.solving.variance_components import CovariancePart, widening
from truearm.modeling.chain import Array

#: Share that an arrival may have in what is known of a direction, for its pull to be made up for.
_LARGEST_SHARE: Final = 0.999
#: Share of the prior variance that the data should remove for a parameter to count in the degrees of freedom.
_INFORMED: Final = 0.5
_LEAST_FREEDOM: Final = 1.0
#: Numbers that are in memory at once, of the arrivals' shares and of their products.
_KEPT: Final = 16_000_000


def cluster_covariance(
    parts: Callable[[], Iterable[tuple[Rows, Array, Array]]],
    arrivals: Arrivals,
    uncertain: NDArray[np.bool_],
    beforehand: Array,
) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of parameters scaled by their priors, zero for those that are not uncertain.

    With it come its parts: of the arrivals' scatter, without what that is uncertain by, and of the priors.

    Args:
        parts: Goes through the equations of some whole arrivals at a time, each part with their indices, with the
            square root of the information: a Jacobian, per prior, whose square is what the parameters are known by,
            ``(k, parameters)``; and with what each equation pulls the parameters with, ``(k, parameters)``: its
            residual times its weight times its derivative, per prior.
        uncertain: Which parameters are, ``(parameters,)``.
        beforehand: What is known of each parameter before any reading: one by its deviation, in priors,
            ``(parameters,)``; 1 with priors, 0 where nothing is known.
    """
    root = triangle = np.diag(beforehand[uncertain])
    for _, told, _ in parts():
        triangle = np.asarray(np.linalg.qr(np.concatenate([told[:, uncertain], triangle]), mode="r"), dtype=np.float64)
    _, s, Vt = np.linalg.svd(triangle, full_matrices=False)
    directions = Vt.T / np.maximum(s, 1e-12 * s[:1])
    along = root @ directions
    meat, freedom = _meat(_Scatter(parts, arrivals, uncertain, directions), bool(root.any()))
    known = along.T @ along
    whole = CovariancePart(directions @ (widening(freedom) ** 2 * meat + known) @ directions.T, np.inf)
    scatter = CovariancePart(directions @ meat @ directions.T, freedom)
    rest = CovariancePart(directions @ known @ directions.T, np.inf)
    return whole.among(uncertain).covariance, (scatter.among(uncertain), rest.among(uncertain))


@dataclass(frozen=True, eq=False)
class _Scatter:
    """Arrivals with their equations and pulls for :func:`cluster_covariance`, and directions to see them in."""

    parts: Callable[[], Iterable[tuple[Rows, Array, Array]]]
    arrivals: Arrivals
    uncertain: NDArray[np.bool_]
    directions: Array  #: Of unit information, ``(parameters, p)``.

    def alike(self) -> Iterable[tuple[Array, Array, Array]]:
        """Go through arrivals with equally many equations, all at once where that takes little memory.

        Each comes with its share of what is known: eigenvalues ``(k, m)``, their vectors ``(k, p, m)``, and its pull
        ``(k, p)``.
        """
        return self._found() if self._kept is None else self._kept

    @cached_property
    def _kept(self) -> list[tuple[Array, Array, Array]] | None:
        few = len(self.arrivals.of_row) * self.directions.shape[1] <= _KEPT
        return list(self._found()) if few else None

    def _found(self) -> Iterator[tuple[Array, Array, Array]]:
        for rows, told, pull in self.parts():
            arrivals = self.arrivals.of(rows)
            X = told[:, self.uncertain] @ self.directions
            pulled = pull[:, self.uncertain] @ self.directions
            pulls = arrivals.products(pulled, np.ones((len(pull), 1)))[..., 0]
            for mine, places in arrivals.alike:
                yield *_eigen(X[places]), pulls[mine]


def _eigen(part: Array) -> tuple[Array, Array]:
    """Return the eigenvalues ``(k, m)`` and vectors ``(k, p, m)`` of the squares of matrices ``(k, m, p)``."""
    turned = np.swapaxes(part, 1, 2)
    if part.shape[1] < part.shape[2]:  # eigenvectors of the smaller of two matrices
        values, left = np.linalg.eigh(part @ turned)
        values = np.clip(values, 1e-300, _LARGEST_SHARE)
        return values, turned @ left / np.sqrt(values)[:, None, :]
    values, vectors = np.linalg.eigh(turned @ part)
    return np.clip(values, 0.0, _LARGEST_SHARE), vectors


def _meat(scatter: _Scatter, known_before: bool) -> tuple[Array, float]:
    """Return the squared pulls in directions of unit information, and their degrees of freedom."""
    directions = scatter.directions
    count = directions.shape[1]
    informed = np.ones(len(directions), dtype=bool)
    if known_before:
        informed = 1.0 - np.sum(directions**2, axis=1) > _INFORMED
        informed = informed if informed.any() else ~informed
    asked = directions[informed]
    meat = np.zeros((count, count))
    # Of each parameter, over the arrivals: variance of its shares, their squares, what they have in common.
    total, squares, mixed, spent = np.zeros((4, len(asked)))
    crossed = np.empty(len(asked))
    at_once = max(1, _KEPT // count**2)
    for first in range(0, len(asked), at_once):
        some = slice(first, first + at_once)
        products = np.zeros((len(asked[some]), count, count))
        for values, vectors, pull in scatter.alike():
            along = np.swapaxes(vectors, 1, 2)
            if first == 0:
                factor = 1.0 / np.sqrt(1.0 - values) - 1.0
                made_up = (pull[..., None] + vectors @ (factor[..., None] * (along @ pull[..., None])))[..., 0]
                meat += made_up.T @ made_up
            seen = along @ asked[some].T
            sizes = np.sum((values / (1.0 - values))[..., None] * seen**2, axis=1)
            weighed = (values / np.sqrt(1.0 - values))[..., None] * seen
            total[some] += sizes.sum(axis=0)
            squares[some] += np.sum(sizes**2, axis=0)
            for j in range(len(products)):
                share = (vectors @ weighed[..., j : j + 1])[..., 0]
                lengths = np.sum(share**2, axis=1)
                mixed[first + j] += float(sizes[:, j] @ lengths)
                spent[first + j] += float(lengths.sum())
                products[j] += share.T @ share
        crossed[some] = np.sum(products**2, axis=(1, 2))
    squared = squares - 2.0 * mixed + crossed
    freedom = (total - spent) ** 2 / np.maximum(squared, 1e-300)
    return meat, float(1.0 / np.mean(1.0 / np.maximum(freedom, _LEAST_FREEDOM)))
