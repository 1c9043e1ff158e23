"""Accuracy over a series: quantiles with intervals that assume nothing of how errors are distributed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array

#: Shares of the robots of which the figure is told.
SHARES: Final = (0.5, 0.9, 0.95, 0.99)
#: How sure intervals are.
SURE: Final = 0.95


@dataclass(frozen=True)
class Quantile:
    """An error below which a share of the robots is."""

    share: float  #: Of the robots.
    value: float | None  #: The error; None where the robots are too few to expect one of them beyond it.
    #: low, high: ends of the interval of 95 %, two of the errors found (order statistics); None where no error that was
    #: found is sure to be beyond.
    low: float | None
    high: float | None
    needed: int  #: So many robots give both ends.


def quantiles(values: Array, shares: tuple[float, ...] = SHARES) -> tuple[Quantile, ...]:
    """Return quantiles of errors ``(n,)`` of robots taken from a series at random.

    The interval is that between order statistics ``l`` and ``u``: the probability that fewer than ``l``, or ``u`` and
    more, of n are below the quantile is binomial, and at most 2.5 % each (David and Nagaraja 2003, section 7.1).
    """
    ordered = np.sort(values)
    return tuple(_quantile(ordered, share) for share in shares)


def _quantile(ordered: Array, share: float) -> Quantile:
    from scipy.special import bdtr

    n = len(ordered)
    tail = (1.0 - SURE) / 2.0
    below = bdtr(np.arange(n + 1, dtype=float), n, share)  # probability of so many or fewer below the quantile
    lows = np.flatnonzero(below <= tail)  # l - 1
    highs = np.flatnonzero(below >= 1.0 - tail)  # u - 1
    upper = int(highs[0])
    known = n * (1.0 - share) >= 1.0 - 1e-9
    return Quantile(
        share,
        float(np.quantile(ordered, share)) if known else None,
        float(ordered[int(lows[-1])]) if len(lows) else None,
        float(ordered[upper]) if upper < n else None,
        max(math.ceil(math.log(tail) / math.log(edge)) for edge in (share, 1.0 - share)),
    )


def share_interval(count: int, of: int) -> tuple[float, float]:
    """Return the interval of 95 % of a share of which `count` of `of` were seen (Clopper and Pearson 1934)."""
    from scipy.special import betaincinv

    tail = (1.0 - SURE) / 2.0
    low = 0.0 if count == 0 else float(betaincinv(count, of - count + 1, tail))
    high = 1.0 if count == of else float(betaincinv(count + 1, of - count, 1.0 - tail))
    return low, high
