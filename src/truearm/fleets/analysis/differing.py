"""Robots whose parameters differ from those of the others of their kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from truearm.fleets.analysis.kind import Kind
from truearm.fleets.analysis.robust import FREEDOM, robust_spread

#: Robots from which on they are compared with one another; fewer are compared with their priors.
LEAST_COMPARED: Final = 10
#: In at most this share of series is any robot named although none differs.
FALSE_ALARMS: Final = 0.05

Beside = Literal["series", "prior"]


@dataclass(frozen=True)
class Difference:
    """A parameter of a robot that is not like that of the others."""

    robot: str  #: Name of the measurement.
    parameter: str  #: parameter, unit: its name and SI unit.
    unit: str
    off: float  #: How far it is from the median of the series, or from nominal [SI].
    times: float  #: So many of the deviations to be expected.
    chance: float  #: How often a series in which no robot differs shows one so far off anywhere, 1 at most.
    beside: Beside  #: What it was compared with: the other robots, or the prior where these are few.
    alone: bool  #: Whether the value is the parameter's own; False where it is told together with others.
    together: tuple[str, ...] = ()  #: With which, as far as that is known.


def differences(kind: Kind) -> tuple[Difference, ...]:
    """Return the parameters of robots that differ, the least likely first.

    A robot's value is held against the median of the kind. Its expected deviation is the robust spread of all values,
    larger by what this robot's own estimate is less certain than the others'. Student's t with the freedom of that
    spread, times the number of comparisons (Bonferroni), tells how likely it is. With fewer than ten robots the priors
    stand for the spread, and nominal for the median.
    """
    from scipy.special import stdtr

    rows = kind.latest
    series = len(rows) >= LEAST_COMPARED
    found = np.sum(~np.isnan(kind.undrawn[0][rows]), axis=0)
    enough = found >= (LEAST_COMPARED if series else 1)
    chosen = np.flatnonzero((kind.determined | kind.shared) & enough)
    if not len(chosen):
        return ()
    undrawn, variance = (part[np.ix_(rows, chosen)] for part in kind.undrawn)
    beside: Beside = "series" if series else "prior"
    if series:
        freedom = FREEDOM * (found[chosen] - 1)
        centre, spread = robust_spread(undrawn)
        more = np.maximum(variance - np.nanmedian(variance, axis=0), 0.0)
        expected = np.sqrt(np.where(spread > 0.0, spread**2 + more, variance))
    else:
        freedom = np.full(len(chosen), 1e6)
        centre = np.zeros(len(chosen))
        prior = kind.prior[chosen] ** 2
        # Where priors draw, the result varies by P - C over all that they allow, that is by P times the share.
        with np.errstate(invalid="ignore", divide="ignore"):
            drawn = prior / kind.informed[np.ix_(rows, chosen)]
        expected = np.sqrt(np.where(kind.drawn[rows][:, None], drawn, prior + variance))
    off = undrawn - centre
    with np.errstate(invalid="ignore", divide="ignore"):
        times = np.where(expected > 0.0, off / expected, 0.0)
    compared = int(np.sum(~np.isnan(times)))
    chance = np.minimum(2.0 * stdtr(freedom, -np.abs(times)) * compared, 1.0)
    named = np.argwhere(chance < FALSE_ALARMS)  # False for NaN
    told = [
        Difference(
            robot=kind.names[int(rows[row])],
            parameter=kind.parameters[int(chosen[column])],
            unit=kind.units[int(chosen[column])],
            off=float(off[row, column]),
            times=float(times[row, column]),
            chance=float(chance[row, column]),
            beside=beside,
            alone=bool(kind.determined[chosen[column]]),
            together=kind.together(int(chosen[column])),
        )
        for row, column in named.tolist()
    ]
    return tuple(sorted(told, key=lambda one: -abs(one.times)))
