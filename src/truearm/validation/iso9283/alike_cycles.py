"""Cycles that follow each other and are alike: then they tell less than as many independent ones."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.validation.iso9283.pose_rows import Cycles

#: So seldom is it said of any test of a campaign whose cycles are independent.
_FALSE: Final = 0.01
#: Fewer cycles do not show it.
_LEAST_CYCLES: Final = 10


@dataclass(frozen=True)
class AlikeCycles:
    """A test whose cycles are like those before them."""

    test: str  #: test, velocity, load: which, and under what.
    velocity: float
    load: float
    correlation: float  #: Between each cycle and the next, of positions about their mean; of independent cycles 0.
    usual: float  #: Its standard deviation where cycles are independent.


def alike_cycles(cycles: Sequence[Cycles]) -> tuple[AlikeCycles, ...]:
    """Return the tests in which each cycle is like the one before it by more than chance.

    The positions at all poses of a cycle are one vector, each pose divided by its scatter. The sum of products of each
    vector and the next over that of squares is the correlation. Of independent cycles it is -1/n in the mean, with the
    variance ``tr C^2 / (n (tr C)^2)``, where C is the vectors' covariance: poses that move together count once. Drift
    is left out, for it shall change.
    """
    parts: dict[tuple[str, float, float], list[Cycles]] = {}
    for one in cycles:
        if one.test != "dAP" and len(one) >= _LEAST_CYCLES:
            parts.setdefault((one.test, one.velocity, one.load), []).append(one)
    found = []
    for key, groups in parts.items():
        vectors = _vectors(groups)
        if len(vectors) < _LEAST_CYCLES or not vectors.shape[1]:
            continue
        n = len(vectors)
        squares = float((vectors**2).sum())
        correlation = float((vectors[:-1] * vectors[1:]).sum()) / squares + 1.0 / n
        found.append(AlikeCycles(*key, correlation, float(np.sqrt(_share(vectors) / n))))
    if not found:
        return ()
    from scipy.special import ndtri

    far = float(ndtri(1.0 - _FALSE / len(found)))
    return tuple(one for one in found if one.correlation > far * one.usual)


def _vectors(groups: Sequence[Cycles]) -> Array:
    """Return the positions of all groups in the cycles that all have, about their means, ``(n, 3 groups)``."""
    common = functools.reduce(np.intersect1d, [one.cycle for one in groups])
    columns = []
    for one in groups:
        _, _, rows = np.intersect1d(common, one.cycle, return_indices=True)
        about = one.points[rows] - one.points[rows].mean(axis=0)
        size = float(np.linalg.norm(about))
        if size > 1e-12:
            columns.append(about / size)
    return np.concatenate(columns, axis=1) if columns else np.empty((len(common), 0))


def _share(vectors: Array) -> float:
    """Return ``tr C^2 / (tr C)^2`` of the vectors' covariance, without what few vectors add to it (Srivastava 2005)."""
    n = len(vectors)
    product = vectors @ vectors.T / (n - 1)
    trace, square = float(np.trace(product)), float((product**2).sum())
    unbiased = (n - 1) ** 2 / ((n - 2) * (n + 1)) * (square - trace**2 / (n - 1))
    return float(max(unbiased / trace**2, 1.0 / vectors.shape[1]))
