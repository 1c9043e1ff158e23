"""What parameters are uncertain by where no model of the residuals holds: from the scatter of the arrivals themselves.

The parameters answer to the sum of the arrivals' pulls, so the variance of that sum, found from the pulls, gives theirs
(Huber 1967; Liang and Zeger 1986): ``H^-1 (M + K) H^-1`` with H the information, K that of the priors, and M the sum
of the squared pulls. A fit has followed each arrival part of the way; the pulls are those of Bell and McCaffrey (2002,
their second estimator), which are right on average where arrivals are alike and independent, and an interval has their
degrees of freedom (Pustejovsky and Tipton 2018). With priors all of that holds as it stands, if truths come from them.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.arrivals import Arrivals
from truearm.identification.solving.variance_components import CovariancePart, widening
from truearm.modeling.chain import Array

#: Share that an arrival may have in what is known of a direction, for its pull to be made up for.
_LARGEST_SHARE: Final = 0.999
#: Share of the prior variance that the data should remove for a parameter to count in the degrees of freedom.
_INFORMED: Final = 0.5
_LEAST_FREEDOM: Final = 1.0


def cluster_covariance(
    rows: Array, pull: Array, arrivals: Arrivals, uncertain: NDArray[np.bool_], beforehand: Array
) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of parameters scaled by their priors, zero for those that are not uncertain.

    With it come its parts: of the arrivals' scatter, without what that is uncertain by, and of the priors.

    Parameters
    ----------
    rows
        Square root of the information: a Jacobian, per prior, whose square is what the parameters are known by,
        ``(rows, parameters)``.
    pull
        What each equation pulls the parameters with, ``(rows, parameters)``: its residual times its weight times its
        derivative, per prior.
    uncertain
        Which parameters are, ``(parameters,)``.
    beforehand
        What is known of each parameter before any reading: one by its deviation, in priors, ``(parameters,)``; 1 with
        priors, 0 where nothing is known.
    """
    A, root = rows[:, uncertain], np.diag(beforehand[uncertain])
    _, s, Vt = np.linalg.svd(
        np.asarray(np.linalg.qr(np.concatenate([A, root]), mode="r"), dtype=np.float64), full_matrices=False
    )
    directions = Vt.T / np.maximum(s, 1e-12 * s[:1])
    X, along = A @ directions, root @ directions
    pulls = arrivals.products(pull[:, uncertain] @ directions, np.ones((len(pull), 1)))[..., 0]
    meat, freedom = _meat(X, pulls, arrivals, directions, bool(root.any()))
    known = along.T @ along
    whole = CovariancePart(directions @ (widening(freedom) ** 2 * meat + known) @ directions.T, np.inf)
    scatter = CovariancePart(directions @ meat @ directions.T, freedom)
    rest = CovariancePart(directions @ known @ directions.T, np.inf)
    return whole.among(uncertain).covariance, (scatter.among(uncertain), rest.among(uncertain))


def _meat(X: Array, pulls: Array, arrivals: Arrivals, directions: Array, known_before: bool) -> tuple[Array, float]:
    """Return the squared pulls in directions of unit information, and their degrees of freedom."""
    count = X.shape[1]
    made_up = np.empty_like(pulls)
    sizes = np.empty((len(pulls), len(directions)))  # of each parameter: variance of its share of each arrival
    shares = np.empty((len(pulls), count, len(directions)))
    for mine, rows in arrivals.alike:
        part = X[rows]
        if part.shape[1] < count:  # eigenvectors of the smaller of two matrices
            values, left = np.linalg.eigh(part @ np.swapaxes(part, 1, 2))
            values = np.clip(values, 1e-300, _LARGEST_SHARE)
            vectors = np.swapaxes(part, 1, 2) @ left / np.sqrt(values)[:, None, :]
        else:
            values, vectors = np.linalg.eigh(np.swapaxes(part, 1, 2) @ part)
            values = np.clip(values, 0.0, _LARGEST_SHARE)
        along = np.swapaxes(vectors, 1, 2)
        factor = 1.0 / np.sqrt(1.0 - values) - 1.0
        pull = pulls[mine][..., None]
        made_up[mine] = (pull + vectors @ (factor[..., None] * (along @ pull)))[..., 0]
        seen = along @ directions.T
        sizes[mine] = np.sum((values / (1.0 - values))[..., None] * seen**2, axis=1)
        shares[mine] = vectors @ ((values / np.sqrt(1.0 - values))[..., None] * seen)
    total = sizes.sum(axis=0)
    crossed = np.array([np.sum((shares[..., j].T @ shares[..., j]) ** 2) for j in range(len(directions))])
    squared = np.sum(sizes**2, axis=0) - 2.0 * np.einsum("aj,apj,apj->j", sizes, shares, shares) + crossed
    spent = np.einsum("apj,apj->j", shares, shares)
    freedom = (total - spent) ** 2 / np.maximum(squared, 1e-300)
    informed = np.ones(len(directions), dtype=bool)
    if known_before:
        informed = 1.0 - np.sum(directions**2, axis=1) > _INFORMED
        informed = informed if informed.any() else ~informed
    pooled = float(1.0 / np.mean(1.0 / np.maximum(freedom[informed], _LEAST_FREEDOM)))
    return made_up.T @ made_up, pooled
