"""How far parameters scatter over a series, beside what their priors say, and priors that follow from it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from truearm.fleets.analysis.accuracy import SURE
from truearm.fleets.analysis.kind import Kind
from truearm.modeling.chain import Array

#: Robots from which on a spread is told; of ten its interval already reaches from two thirds to almost twice of it.
LEAST_SPREAD: Final = 10

#: ``agrees``: the prior lies within the interval. ``too few``, ``shared``, ``prior only``, ``priors differ``: not told.
Verdict = Literal["agrees", "wider", "narrower", "too few", "shared", "prior only", "priors differ"]


@dataclass(frozen=True)
class ParameterSpread:
    """How a parameter scatters over the robots of a series; everything in SI units."""

    parameter: str  #: parameter, unit: its name and unit.
    unit: str
    nominal: float  #: nominal, prior: as the robot file has them; NaN where the robots' files disagree.
    prior: float
    share: float  #: Typical informed share.
    robots: int  #: How many count: those that identified it, without those that differ.
    verdict: Verdict  #: The spread beside the prior, or why it is not told.
    #: mean, mean_low, mean_high: mean difference from nominal with its interval of 95 %; None if it is not told.
    mean: float | None = None
    mean_low: float | None = None
    mean_high: float | None = None
    beside: bool = False  #: Whether the whole series lies beside nominal.
    #: spread, low, high: standard deviation of the robots about their mean, without what the estimates are uncertain
    #: by, with its interval of 95 %; None if it is not told.
    spread: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def proposed(self) -> float | None:
        """The prior that follows: the spread, or the most it may be where it is not told from none; None if unknown.

        None too where values scatter so much less than their deviations say that not even the most is above zero.
        """
        if self.spread is None or self.low is None or self.high is None or self.high <= 0.0:
            return None
        return self.spread if self.low > 0.0 else self.high

    @property
    def centre(self) -> float:
        """The nominal value that follows [SI]: shifted where the whole series lies beside it."""
        return self.nominal + (self.mean if self.beside and self.mean is not None else 0.0)


def spreads(kind: Kind, differing: Collection[str] = ()) -> tuple[ParameterSpread, ...]:
    """Return the spread of each parameter over the machines of a series, from the last measurement of each.

    The variance of the values, freed of the pull of the priors, less the mean variance of their estimates. The former
    has an interval by the chi-squared distribution, with fewer degrees of freedom where values far from the mean are
    more frequent than in a normal distribution (Box 1953).

    Args:
        differing: Names of measurements that are left out: robots with a fault say nothing of the kind.
    """
    left_out = set(differing)
    rows = [row for row in kind.latest.tolist() if kind.names[row] not in left_out]
    undrawn, variance = (part[rows] for part in kind.undrawn)
    told = int(np.sum(kind.determined))
    return tuple(
        _spread(kind, number, undrawn[:, number], variance[:, number], told) for number in range(len(kind.parameters))
    )


def _spread(kind: Kind, number: int, values: Array, variances: Array, compared: int) -> ParameterSpread:
    from scipy.special import chdtri, stdtrit

    there = ~np.isnan(values)
    n = int(np.sum(there))
    prior = float(kind.prior[number])
    verdict: Verdict = "too few"
    if np.isnan(prior):
        verdict = "priors differ"
    elif not kind.determined[number]:
        verdict = "shared" if kind.shared[number] else "prior only"
    untold = ParameterSpread(
        parameter=kind.parameters[number],
        unit=kind.units[number],
        nominal=float(kind.nominal[number]),
        prior=prior,
        share=float(kind.share[number]),
        robots=n or int(np.sum(~np.isnan(kind.difference[kind.latest, number]))),
        verdict=verdict,
    )
    if verdict != "too few" or n < LEAST_SPREAD:
        return untold
    values, estimated = values[there], float(np.mean(variances[there]))
    mean, scatter = float(np.mean(values)), float(np.var(values, ddof=1))
    tail = (1.0 - SURE) / 2.0
    freedom = _freedom(values)
    ends = (freedom * scatter / float(chdtri(freedom, p)) - estimated for p in (tail, 1.0 - tail))
    variance = (scatter - estimated, *ends)
    spread, low, high = (float(np.sqrt(max(v, 0.0))) for v in variance)
    error = float(np.sqrt(scatter / n))
    half = float(stdtrit(n - 1, 1.0 - tail)) * error
    sure = float(stdtrit(n - 1, 1.0 - tail / compared)) * error
    return replace(
        untold,
        verdict="wider" if low > prior else "narrower" if high < prior else "agrees",
        mean=mean,
        mean_low=mean - half,
        mean_high=mean + half,
        beside=abs(mean) > sure,
        spread=spread,
        low=low,
        high=high,
    )


def _freedom(values: Array) -> float:
    """Return the degrees of freedom of a variance: of n - 1, as many as the excess of the fourth moment leaves."""
    n = len(values)
    off = values - np.mean(values)
    square = float(np.mean(off**2))
    excess = float(np.mean(off**4)) / square**2 - 3.0 if square > 0.0 else 0.0
    return (n - 1) / (1.0 + 0.5 * max(excess, 0.0) * (n - 1) / n)
