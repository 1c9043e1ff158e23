"""Accuracy of a series, robots of one kind, and machines measured again: which parameters have changed, how fast."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array
from truearm.fleets.series import FoundParameters, Row

# Accuracy over a series: quantiles with intervals that assume nothing of how errors are distributed.

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


# What was found of robots of one kind, as arrays, and what of it can be compared.
#
# A value that priors hold near its nominal value is drawn towards it. Where ``x`` is the true difference from nominal,
# ``P`` the variances of the priors (diagonal) and ``C`` the covariance of the result, that result is ``A x`` plus
# errors of the readings with covariance ``A C``, and ``A = I - C / P``. The diagonal of ``A`` is the informed share. A
# parameter is *determined* where that share is 0.9 or more: a robot's value is then its own, and dividing by the share
# makes it unbiased but for at most a tenth of what other parameters' priors are off by. It is *shared* where the share
# is less: the readings tell a combination with others, such as ``d_2 + d_3``. Below 0.05 nothing but the prior holds
# it, as where base or target can move instead.

#: Informed share from which on a parameter is determined, and below which nothing but its prior holds it.
DETERMINED: Final = 0.9
UNINFORMED: Final = 0.05
#: Nominal values and priors that differ by less, of their size, are the same.
_SAME: Final = 1e-9
#: Correlation beyond which two shared parameters are named together.
_TOGETHER: Final = 0.5
#: Robots that wait to be made arrays of.
_AT_ONCE: Final = 1000


@dataclass(frozen=True, eq=False)
class Kind:
    """Robots of one kind that were calibrated, one row a measurement."""

    robot: str  #: Its name.
    names: tuple[str, ...]  #: Of the measurements, ``rows`` of them.
    machines: tuple[str, ...]  #: The machine of each: several measurements may be of one.
    #: days, temperatures: when, in days, and of the arm [degC]; NaN where that is not known, ``(rows,)``.
    days: Array
    temperatures: Array
    #: parameters, units: those of the arm that were identified in any row, with their SI units.
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    #: nominal, prior: value before and its standard deviation [SI], ``(parameters,)``; NaN where robots disagree about
    #: them.
    nominal: Array
    prior: Array
    difference: Array  #: What was found less nominal [SI], ``(rows, parameters)``; NaN where it was not identified.
    deviation: Array  #: Standard deviation of that [SI], ``(rows, parameters)``.
    informed: Array  #: Share of the prior variance that the readings removed, ``(rows, parameters)``.
    drawn: NDArray[np.bool_]  #: Whether priors drew the values towards nominal, ``(rows,)``.
    #: Of each row, in priors, ``(parameters, parameters)``; None where it is not known.
    covariances: tuple[Array | None, ...]

    def together(self, number: int) -> tuple[str, ...]:
        """Return the parameters with which the readings tell one together, as far as covariances show them."""
        known = next((c for c in self.covariances if c is not None), None)
        if known is None or not self.shared[number]:
            return ()
        correlation = known[number] / np.sqrt(np.maximum(known[number, number] * np.diag(known), 1e-300))
        like = np.flatnonzero((np.abs(correlation) > _TOGETHER) & self.shared)
        return tuple(self.parameters[other] for other in like.tolist() if other != number)

    @cached_property
    def latest(self) -> NDArray[np.intp]:
        """Indices of the last measurement of each machine, in order; without dates the last one named."""
        last: dict[str, tuple[float, int]] = {}
        for row, (machine, day) in enumerate(zip(self.machines, self.days.tolist(), strict=True)):
            when = -np.inf if np.isnan(day) else day
            if machine not in last or when >= last[machine][0]:
                last[machine] = (when, row)
        return np.array(sorted(row for _, row in last.values()), dtype=np.intp)

    @cached_property
    def share(self) -> Array:
        """Typical informed share of each parameter, ``(parameters,)``; NaN where robots disagree about the prior."""
        return np.where(np.isnan(self.prior), np.nan, np.nanmedian(self.informed, axis=0))

    @cached_property
    def determined(self) -> NDArray[np.bool_]:
        """Which parameters are determined in most of the measurements, ``(parameters,)``."""
        return np.asarray(self.share >= DETERMINED)

    @cached_property
    def shared(self) -> NDArray[np.bool_]:
        """Which are told together with others only, ``(parameters,)``."""
        return np.asarray((self.share >= UNINFORMED) & (self.share < DETERMINED))

    @cached_property
    def pull(self) -> Array:
        """What is left of a difference where priors draw it towards nominal, ``(rows, parameters)``, 0 to 1."""
        return np.asarray(np.where(self.drawn[:, None], self.informed, 1.0))

    @cached_property
    def undrawn(self) -> tuple[Array, Array]:
        """Differences without the pull of priors, and the variances of these, both ``(rows, parameters)``."""
        with np.errstate(invalid="ignore", divide="ignore"):
            pull = np.where(self.pull >= UNINFORMED, self.pull, np.nan)
            return self.difference / pull, self.deviation**2 / pull


def day_of(text: str | None) -> float:
    """Return a date (ISO 8601) in days; NaN for none."""
    return float("nan") if text is None else float(date.fromisoformat(text[:10]).toordinal())


class Gathered:
    """Robots of one kind, taken up one after the other: only their figures are kept, as arrays."""

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.names: list[str] = []
        self._machines: list[str] = []
        self._days: list[float] = []
        self._temperatures: list[float] = []
        self._drawn: list[bool] = []
        self._units: dict[str, str] = {}
        self._waiting: dict[tuple[str, ...], list[tuple[int, FoundParameters]]] = {}
        self._blocks: list[tuple[list[int], list[int], Array]] = []
        self._covariances: list[tuple[float, ...]] = []

    def add(self, row: Row) -> None:
        """Take up a robot; one that was not calibrated has nothing to compare."""
        if row.status != "calibrated" or not row.parameters:
            return
        waiting = self._waiting.setdefault(row.parameters.name, [])
        waiting.append((len(self.names), row.parameters))
        self.names.append(row.name)
        self._machines.append(row.machine)
        self._days.append(day_of(row.date))
        self._temperatures.append(float("nan") if row.temperature is None else row.temperature)
        self._drawn.append(row.drawn)
        self._covariances.append(row.covariance)
        if len(waiting) == _AT_ONCE:
            self._take(row.parameters.name)

    def _take(self, names: tuple[str, ...]) -> None:
        """Make an array of what waits of robots with the same parameters."""
        waiting = self._waiting.pop(names)
        for name, unit in zip(names, waiting[0][1].unit, strict=True):
            self._units.setdefault(name, unit)
        known = {name: number for number, name in enumerate(self._units)}
        columns = [
            [getattr(parameters, kind) for _, parameters in waiting]
            for kind in ("value", "nominal", "deviation", "prior")
        ]
        figures = np.stack([np.array(column) for column in columns], axis=2)
        self._blocks.append(([number for number, _ in waiting], [known[name] for name in names], figures))

    @property
    def kind(self) -> Kind:
        """All of them as arrays."""
        for names in [*self._waiting]:
            self._take(names)
        figures = np.full((len(self.names), len(self._units), 4), np.nan)
        places: list[list[int]] = [[]] * len(self.names)
        for rows, columns, block in self._blocks:
            figures[np.ix_(rows, columns)] = block
            for number in rows:
                places[number] = columns
        value, nominals, deviation, priors = np.moveaxis(figures, 2, 0)
        drawn = np.array(self._drawn)
        share = (deviation / priors) ** 2
        nominal = _one_for_all(nominals)
        return Kind(
            robot=self.robot,
            names=tuple(self.names),
            machines=tuple(self._machines),
            days=np.array(self._days),
            temperatures=np.array(self._temperatures),
            parameters=tuple(self._units),
            units=tuple(self._units.values()),
            nominal=nominal,
            prior=np.where(np.isnan(nominal), np.nan, _one_for_all(priors)),
            difference=value - nominals,
            deviation=deviation,
            informed=np.where(drawn[:, None], np.maximum(1.0 - share, 0.0), 1.0 / (1.0 + share)),
            drawn=drawn,
            covariances=tuple(
                _whole(covariance, of_row, len(self._units))
                for covariance, of_row in zip(self._covariances, places, strict=True)
            ),
        )


def _one_for_all(values: Array) -> Array:
    """Return the one value of each column, NaN where rows disagree."""
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    return np.where(high - low <= _SAME * np.maximum(np.abs(high), 1e-3), low, np.nan)


def _whole(lower: tuple[float, ...], places: list[int], count: int) -> Array | None:
    """Return a covariance among all parameters, in priors, from its lower triangle; the others are at their priors."""
    if not lower:
        return None
    own = np.zeros((len(places), len(places)))
    own[np.tril_indices(len(places))] = lower
    whole = np.eye(count)
    whole[np.ix_(places, places)] = own + np.tril(own, -1).T
    return whole


#: Days of a month.
MONTH: Final = 365.25 / 12.0
#: In at most this share of fleets is a drift told although no machine has changed.
FALSE_ALARMS: Final = 0.05
#: Machines from which on it is asked whether all drift alike.
_LEAST_ALIKE: Final = 5
#: Machines of which every parameter is told; of more, deviations beyond which a change may be more than chance.
_FEW: Final = 50
_LIKELY: Final = 2.5
#: Root mean square change, in priors, from which on it may be another robot (of two it is 1.4), and of how many
#: parameters at least.
_AS_ANOTHER: Final = 0.7
_LEAST_PARAMETERS: Final = 8
_Z: Final = 1.959963984540054
#: Growth with the temperature that is taken for possible [1/K], aluminium's, and steel's beside it; and a difference
#: between campaigns whose temperatures nobody recorded [K].
_MOST_GROWTH: Final = 24e-6
_LEAST_GROWTH: Final = 11.5e-6
_MOST_WARMER: Final = 20.0
#: A line is called no line where chance alone bends one as far so rarely.
_CURVED: Final = 0.01


# Machines that were measured again: which parameters have changed, how fast, and how sure that is.
#
# Two results of one machine share what the priors add: where nothing but a prior holds a parameter both are at nominal,
# and their difference says nothing. Be ``C_1`` and ``C_2`` their covariances with the variances ``P`` of the priors as
# unit. If the machine is the same, its true values vary as the priors say, and base and targets stood elsewhere, then
# the results covary by ``(I - C_1)(I - C_2)``, each varies by ``I - C``, and their difference by ``C_1 + C_2 - C_1 C_2
# - C_2 C_1``: what errors of the readings add, and what the two campaigns shrink differently. Where both determine
# nothing but ``d_2 + d_3`` that is as small as the sum is known, although each alone is known to its prior only.
@dataclass(frozen=True)
class Drift:
    """How a parameter of a machine went on from campaign to campaign; everything in SI units."""

    machine: str  #: Which one.
    parameter: str  #: parameter, unit: its name and unit.
    unit: str
    campaigns: int  #: So many measurements of it.
    months: float  #: From the first to the last.
    #: slope, low, high: change in a month with its interval, in which the true ones of all comparisons together lie in
    #: 95 % of fleets: it holds no zero where the change is more than chance.
    slope: float
    low: float
    high: float
    times: float  #: The slope in its deviations.
    chance: float  #: How often a fleet in which nothing changes shows one so large anywhere, 1 at most.
    steady: bool | None  #: Whether a straight line fits; None of two campaigns, which any line fits.
    #: campaign_months, changes, deviations: when each campaign was, in months after the first, what had changed by
    #: then, and the standard deviation of that.
    campaign_months: tuple[float, ...]
    changes: tuple[float, ...]
    deviations: tuple[float, ...]
    alone: bool  #: Whether the value is the parameter's own; False where it is told together with others.
    together: tuple[str, ...] = ()  #: With which, as far as that is known.

    @property
    def significant(self) -> bool:
        """Whether the change is more than chance."""
        return self.chance < FALSE_ALARMS

    @property
    def change(self) -> float:
        """From the first campaign to the last, along the line [SI]."""
        return self.slope * self.months


@dataclass(frozen=True)
class AllDrift:
    """A parameter that changes alike in all machines: [SI] a month, mean over machines, with its interval of 95 %."""

    parameter: str
    unit: str
    machines: int
    slope: float
    low: float
    high: float


@dataclass(frozen=True)
class Growth:
    """All lengths of a machine grew alike, as far as a temperature explains it: that is no change of the machine."""

    machine: str
    share: float  #: Of each length, from the first campaign to the last; negative where they shrank.
    warmer: float | None  #: By how much the last campaign was [K]; None if that was not recorded.

    @property
    def explaining(self) -> tuple[float, float]:
        """The differences of temperature that would make an arm of aluminium, and of steel, grow so [K]."""
        return self.share / _MOST_GROWTH, self.share / _LEAST_GROWTH


@dataclass(frozen=True)
class Drifts:
    """Machines that were measured again."""

    #: Their parameters, the surest change first; of many machines those that changed by more than chance, and the
    #: surest of each.
    changes: tuple[Drift, ...] = ()
    compared: int = 0  #: How many parameters of machines were looked at.
    #: Parameters that change alike in all machines: what measured them may have changed instead.
    alike: tuple[AllDrift, ...] = ()
    grown: tuple[Growth, ...] = ()  #: Machines whose lengths changed as a temperature explains: not in `changes`.
    undated: tuple[str, ...] = ()  #: Machines with several measurements, but not at two known dates.
    #: Machines whose results differ as those of two robots do: their serial numbers may be wrong.
    others: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()  #: Parameters of which no change can be seen, because nothing but priors holds them.

    @property
    def significant(self) -> tuple[Drift, ...]:
        """What has changed by more than chance."""
        return tuple(change for change in self.changes if change.significant)


def drifts(kind: Kind) -> Drifts:
    """Return how parameters of machines that were measured at several dates went on.

    A line is fitted through the results of each machine, weighted by the covariance of the differences between them.
    The chance is that of the normal distribution times the number of comparisons (Bonferroni). Where lengths changed by
    more than that, and by no more than that beside a uniform growth that a temperature explains, this is taken out.
    """
    again: dict[str, list[int]] = {}
    for row, machine in enumerate(kind.machines):
        again.setdefault(machine, []).append(row)
    lines: list[Drift] = []
    undated, others, grown = [], [], list[Growth]()
    slopes: dict[str, list[float]] = {}
    fitted: dict[str, tuple[list[int], _Lines]] = {}
    few = sum(len(rows) > 1 for rows in again.values()) <= _FEW
    for machine, rows in again.items():
        if len(rows) < 2:
            continue
        dated = sorted((row for row in rows if not np.isnan(kind.days[row])), key=lambda row: kind.days[row])
        if len(dated) < 2 or kind.days[dated[0]] == kind.days[dated[-1]]:
            undated.append(machine)
            continue
        fitted[machine] = (dated, _lines(kind, dated))
        if _is_another(kind, dated):
            others.append(machine)
    compared = sum(len(of_machine.numbers) for _, of_machine in fitted.values())
    for machine, (dated, as_found) in fitted.items():
        of_machine, share = _without_growth(kind, dated, as_found, _reach(compared))
        if share:
            warmer = float(np.diff(kind.temperatures[dated]).sum())
            grown.append(Growth(machine, share, None if np.isnan(warmer) else warmer))
        for number, slope in zip(of_machine.numbers.tolist(), of_machine.slopes.tolist(), strict=True):
            slopes.setdefault(kind.parameters[number], []).append(slope)
        lines += [
            of_machine.drift(kind, machine, place)
            for place, times in enumerate(np.abs(of_machine.times).tolist())
            if few or place == 0 or times > _LIKELY
        ]
    changes = _with_chances(lines, compared)
    changes = [
        change
        for i, change in enumerate(changes)
        if few or change.significant or change.machine != changes[i - 1].machine
    ]
    units = dict(zip(kind.parameters, kind.units, strict=True))
    nothing = kind.share < UNINFORMED
    return Drifts(
        tuple(sorted(changes, key=lambda change: (change.chance, -abs(change.times)))),
        compared,
        _alike(slopes, units),
        tuple(grown),
        tuple(undated),
        tuple(others),
        tuple(name for name, is_unknown in zip(kind.parameters, nothing.tolist(), strict=True) if is_unknown)
        if lines
        else (),
    )


def _is_another(kind: Kind, machine_rows: list[int]) -> bool:
    """Return whether parameters changed from one campaign to the next by as much as robots differ from one another."""
    rows = np.array(machine_rows)
    chosen = kind.determined & ~np.isnan(kind.difference[rows]).any(axis=0)
    if np.sum(chosen) < _LEAST_PARAMETERS:
        return False
    steps = np.diff(kind.difference[np.ix_(rows, np.flatnonzero(chosen))], axis=0) / kind.prior[chosen]
    return bool(np.sqrt(np.mean(steps**2, axis=1)).max() > _AS_ANOTHER)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines through the campaigns of a machine, one for each parameter, the surest first."""

    numbers: NDArray[np.intp]  #: Of the parameters, ``(parameters,)``.
    months: Array  #: Of the campaigns after the first, ``(campaigns,)``.
    slopes: Array  #: slopes, errors: in a month with their standard deviations [SI], ``(parameters,)``.
    errors: Array
    changes: Array  #: changes, deviations: since the first campaign [SI], ``(parameters, campaigns)``.
    deviations: Array
    misfit_chance: Array  #: How rarely chance bends a line so far, ``(parameters,)``; NaN of two campaigns.
    grown: float = 0.0  #: Share by which all lengths grew from the first campaign to the last, where that is taken out.

    @property
    def times(self) -> Array:
        """Slopes in their standard deviations."""
        return np.asarray(self.slopes / self.errors)

    def drift(self, kind: Kind, machine: str, place: int) -> Drift:
        """Return one of them by its place."""
        number = int(self.numbers[place])
        slope, error = float(self.slopes[place]), float(self.errors[place])
        return Drift(
            machine=machine,
            parameter=kind.parameters[number],
            unit=kind.units[number],
            campaigns=len(self.months),
            months=float(self.months[-1]),
            slope=slope,
            low=slope - _Z * error,
            high=slope + _Z * error,
            times=slope / error,
            chance=1.0,
            steady=None if len(self.months) == 2 else bool(self.misfit_chance[place] > _CURVED),
            campaign_months=tuple(self.months.tolist()),
            changes=tuple(self.changes[place].tolist()),
            deviations=tuple(self.deviations[place].tolist()),
            alone=bool(kind.determined[number]),
            together=kind.together(number),
        )


def _without_growth(kind: Kind, rows: list[int], as_found: _Lines, reach: float) -> tuple[_Lines, float]:
    """Return the lines beside a uniform growth of all lengths, and that as a share, if it explains these; else 0.

    Args:
        as_found: The lines with it.
        reach: Deviations from which on a change is more than chance.
    """
    lengths = _lengths(kind)
    changed = (np.abs(as_found.times) > reach) & (lengths[as_found.numbers] != 0.0)
    if not changed.any():
        return as_found, 0.0
    beside = _lines(kind, rows, growing=True)
    left = np.abs(beside.times[lengths[beside.numbers] != 0.0])
    return (as_found, 0.0) if (left > reach).any() else (beside, beside.grown)


def _lengths(kind: Kind) -> Array:
    """Return nominal lengths [priors], ``(parameters,)``; 0 for what is none."""
    return np.where(np.array(kind.units) == "m", np.nan_to_num(kind.nominal / kind.prior), 0.0)


def _growths(kind: Kind, rows: NDArray[np.intp], y: Array, inverse: Array, grows: Array) -> Array:
    """Return the uniform growth of lengths between campaigns that fits best, as a share, ``(campaigns - 1,)``.

    In proportion to the temperature where that was recorded at all campaigns, else whatever a temperature may make.

    Args:
        y, inverse: Changes between campaigns [SI], and the inverses of their covariances.
        grows: How much of each parameter grows with the lengths [SI], ``(parameters,)``.
    """
    warmer = np.diff(kind.temperatures[rows])
    normal, wanted = np.einsum("p,pij->ij", grows**2, inverse), np.einsum("p,pij,pj->i", grows, inverse, y)
    if np.isnan(warmer).any():
        most = _MOST_GROWTH * _MOST_WARMER
        return np.asarray(np.clip(np.linalg.lstsq(normal, wanted, rcond=None)[0], -most, most))
    rate = (warmer @ wanted) / max(float(warmer @ normal @ warmer), 1e-300)
    return np.asarray(np.clip(rate, 0.0, _MOST_GROWTH) * warmer)


def _lines(kind: Kind, machine_rows: list[int], *, growing: bool = False) -> _Lines:
    """Return a line through the campaigns of a machine for each parameter that all of them determine or share.

    Args:
        growing: Whether a uniform growth of all lengths is taken out before.
    """
    rows = np.array(machine_rows)
    measured = ~np.isnan(kind.difference[rows]).any(axis=0)
    numbers = np.flatnonzero((kind.determined | kind.shared) & measured)
    months = (kind.days[rows] - kind.days[rows[0]]) / MONTH
    # A sum with others is not made larger: nobody knows by how much.
    pull = np.where(kind.determined[numbers], kind.pull[np.ix_(rows, numbers)].mean(axis=0), 1.0)
    values = (kind.difference[np.ix_(rows, numbers)] / pull).T
    variance = np.moveaxis(_covariances(kind, rows)[:, :, numbers], 2, 0)
    variance = variance * (kind.prior[numbers] / pull)[:, None, None] ** 2
    contrast = np.diff(np.eye(len(rows)), axis=0)
    between = contrast @ variance @ contrast.T
    y, t = values @ contrast.T, contrast @ months
    scale = np.sqrt(np.maximum(np.diagonal(between, axis1=1, axis2=2), 0.0))
    sound = (scale > 0.0).all(axis=1)
    numbers, y, values, variance = numbers[sound], y[sound], values[sound], variance[sound]
    sizes = scale[sound][:, :, None] * scale[sound][:, None, :]
    inverse = np.linalg.pinv(between[sound] / sizes, hermitian=True) / sizes
    grown = np.zeros(len(rows))
    if growing:
        grows = _resolved(kind, rows)[numbers] / pull[sound]
        grown[1:] = np.cumsum(_growths(kind, rows, y, inverse, grows))
        values = values - grows[:, None] * grown
        y = values @ contrast.T
    weight = np.maximum(np.einsum("i,pij,j->p", t, inverse, t), 1e-300)
    slopes = np.einsum("i,pij,pj->p", t, inverse, y) / weight
    left = y - slopes[:, None] * t
    misfit = np.einsum("pi,pij,pj->p", left, inverse, left)
    own = np.diagonal(variance, axis1=1, axis2=2)
    since = np.maximum(own + own[:, :1] - 2.0 * variance[:, 0], 0.0)
    since[:, 0] = 0.0
    fitted = _Lines(
        numbers=numbers,
        months=months,
        slopes=slopes,
        errors=weight**-0.5,
        changes=values - values[:, :1],
        deviations=np.sqrt(since),
        misfit_chance=_chances(misfit, len(rows) - 2),
        grown=float(grown[-1]),
    )
    order = np.argsort(-np.abs(fitted.times), kind="stable")
    return replace(
        fitted,
        numbers=numbers[order],
        slopes=fitted.slopes[order],
        errors=fitted.errors[order],
        changes=fitted.changes[order],
        deviations=fitted.deviations[order],
        misfit_chance=fitted.misfit_chance[order],
    )


def _resolved(kind: Kind, rows: NDArray[np.intp]) -> Array:
    """Return how much larger each parameter is found where all lengths grow by their own size [SI], ``(parameters,)``.

    That is ``A`` times the lengths; without correlations what is drawn is drawn by its own prior alone.
    """
    lengths = _lengths(kind)
    known = [c for row in rows.tolist() if kind.drawn[row] and (c := kind.covariances[row]) is not None]
    if len(known) == len(rows):
        return np.asarray(kind.prior * (lengths - np.mean(known, axis=0) @ lengths))
    return np.asarray(kind.prior * lengths * kind.pull[rows].mean(axis=0))


def _chances(misfit: Array, freedom: int) -> Array:
    """Return how rarely chance makes a sum of squares so large; NaN where there is no freedom."""
    from scipy.special import chdtrc

    return np.asarray(chdtrc(freedom, misfit) if freedom else np.full(len(misfit), np.nan))


def _covariances(kind: Kind, rows: NDArray[np.intp]) -> Array:
    """Return how the results of campaigns covary, parameter by parameter, in priors ``(rows, rows, parameters)``."""
    own = (kind.deviation[rows] / kind.prior) ** 2
    if not kind.drawn[rows].all():  # nothing is shared
        return np.asarray(np.eye(len(rows))[:, :, None] * own[:, None, :])
    whole = [kind.covariances[row] for row in rows.tolist()]
    known = [c for c in whole if c is not None]
    if len(known) == len(rows):
        stacked = np.stack(known)
        both = np.einsum("rij,sij->rsi", stacked, stacked)
        own = np.einsum("rii->ri", stacked)
    else:  # without correlations, at least as large
        both = own[:, None, :] * own[None, :, :]
    covariances = 1.0 - own[:, None, :] - own[None, :, :] + both
    covariances[np.arange(len(rows)), np.arange(len(rows))] = 1.0 - own
    return np.asarray(covariances)


def _reach(compared: int) -> float:
    """Return the deviations from which on a change is more than chance (Bonferroni)."""
    from scipy.special import ndtri

    return float(-ndtri(FALSE_ALARMS / (2.0 * max(compared, 1))))


def _with_chances(lines: list[Drift], compared: int) -> list[Drift]:
    """Return changes with their chances, and intervals that hold for all comparisons together (Bonferroni)."""
    from scipy.special import ndtr

    times = np.array([line.times for line in lines])
    chances = np.minimum(2.0 * ndtr(-np.abs(times)) * compared, 1.0)
    reach = _reach(compared)
    changes = []
    for line, chance in zip(lines, chances.tolist(), strict=True):
        half = reach / _Z * (line.high - line.slope)
        changes.append(replace(line, chance=chance, low=line.slope - half, high=line.slope + half))
    return changes


def _alike(slopes: Mapping[str, Sequence[float]], units: Mapping[str, str]) -> tuple[AllDrift, ...]:
    """Return parameters whose mean slope over the machines is more than chance (Student's t, Bonferroni)."""
    from scipy.special import stdtrit

    common = []
    tail = (1.0 - SURE) / 2.0
    for name, those in slopes.items():
        n = len(those)
        if n < _LEAST_ALIKE:
            continue
        mean, error = float(np.mean(those)), float(np.std(those, ddof=1) / np.sqrt(n))
        if error > 0.0 and abs(mean) > float(stdtrit(n - 1, 1.0 - tail / len(slopes))) * error:
            half = float(stdtrit(n - 1, 1.0 - tail)) * error
            common.append(AllDrift(name, units[name], n, mean, mean - half, mean + half))
    return tuple(common)
