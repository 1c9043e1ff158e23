"""All that a fleet says, from its rows read once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import counted
from truearm.engine.base.units import SHOWN_AS, from_si, to_si
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.fleets.drift import (
    SURE,
    Drift,
    Drifts,
    Gathered,
    Kind,
    Quantile,
    day_of,
    drifts,
    quantiles,
    share_interval,
)
from truearm.fleets.series import Accuracy, Row

# Centre and spread of values among which a few may be wrong.

#: Median absolute deviations beyond which a value has no part in the spread (Lax 1985; Mosteller and Tukey 1977).
_REACH: Final = 9.0
#: Degrees of freedom of the spread of `n` values, as a share of n - 1. With Student's t and this share the largest of
#: twenty times n normal values is called too large in 2 to 5 % of series of 10 to 1000 robots that asked for 5 %
#: (simulated; without it up to 16 %).
FREEDOM: Final = 0.6


def robust_spread(values: Array) -> tuple[Array, Array]:
    """Return median and standard deviation of each column, the latter by the biweight midvariance.

    Args:
        values: ``(n, columns)``, NaN where there is none.

    Returns:
        Both ``(columns,)``; where more than half of the values are the same the deviation is 0.
    """
    centre = np.nanmedian(values, axis=0)
    off = values - centre
    median = np.nanmedian(np.abs(off), axis=0)
    u = off / (_REACH * np.where(median > 0.0, median, 1.0))
    near = np.abs(u) < 1.0  # False for NaN
    u2 = np.where(near, u, 0.0) ** 2
    count = np.sum(~np.isnan(values), axis=0)
    above = np.sum(np.where(near, off, 0.0) ** 2 * (1.0 - u2) ** 4, axis=0)
    below = np.abs(np.sum(np.where(near, (1.0 - u2) * (1.0 - 5.0 * u2), 0.0), axis=0))
    spread = np.sqrt(count * above) / np.maximum(below, 1e-300)
    return centre, np.where(median > 0.0, spread, 0.0)


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
    counts = np.sum(~np.isnan(kind.undrawn[0][rows]), axis=0)
    enough = counts >= (LEAST_COMPARED if series else 1)
    chosen = np.flatnonzero((kind.determined | kind.shared) & enough)
    if not len(chosen):
        return ()
    undrawn, variance = (part[np.ix_(rows, chosen)] for part in kind.undrawn)
    beside: Beside = "series" if series else "prior"
    if series:
        freedom = FREEDOM * (counts[chosen] - 1)
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
    differing = [
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
    return tuple(sorted(differing, key=lambda difference: -abs(difference.times)))


#: Why a robot is looked at, the gravest first: it was not calibrated; its result must not be used as it is; its fit did
#: not end well; it is no better than before; it is less accurate than the others; parameters differ or drift. The last
#: is the worst of the robots in the series, which always is one.
Why = Literal["failed", "error", "unsound", "not better", "inaccurate", "differs", "drifts", "largest error"]
WHYS: Final[tuple[Why, ...]] = (
    "failed",
    "error",
    "unsound",
    "not better",
    "inaccurate",
    "differs",
    "drifts",
    "largest error",
)
_SOUND: Final = ("converged", "at-bound")


@dataclass(frozen=True)
class Judged:
    """What is kept of a robot to tell whether to look at it."""

    name: str  #: name, machine: of the measurement, and of what was measured.
    machine: str
    message: str  #: Why it was not calibrated; empty if it was.
    errors: tuple[str, ...]  #: Codes of notices of the level error.
    fit_status: str | None  #: How the fit ended.
    mean: float  #: mean, largest: mean and largest held-out error [m]; NaN where nothing was held out.
    largest: float
    before: float  #: Mean error of the nominal robot [m].

    @classmethod
    def of(cls, row: Row) -> Judged:
        """Take over what a row says."""
        mean, largest = (float("nan"),) * 2 if row.held_out is None else (row.held_out.mean, row.held_out.max)
        return cls(
            row.name,
            row.machine,
            row.message if row.status == "failed" else "",
            row.errors,
            row.fit_status,
            mean,
            largest,
            float("nan") if row.nominal is None else row.nominal.mean,
        )


@dataclass(frozen=True)
class Reason:
    """Why to look at a robot."""

    why: Why  #: Which kind of reason.
    message: str = ""  #: message, codes: for ``failed`` and ``error``, ``unsound``.
    codes: tuple[str, ...] = ()
    #: error, beside: mean held-out error [m], and what it is held against: of the nominal robot, or the median of the
    #: series.
    error: float = 0.0
    beside: float = 0.0
    differences: tuple[Difference, ...] = ()  #: differences, drifts: the parameters, the surest first.
    drifts: tuple[Drift, ...] = ()

    @property
    def size(self) -> float:
        """How much there is of it, to order robots with the same reason."""
        times = [abs(difference.times) for difference in self.differences] + [abs(drift.times) for drift in self.drifts]
        return max(times, default=self.error)


@dataclass(frozen=True)
class Look:
    """A robot to look at, with the reasons, the gravest first."""

    robot: str
    reasons: tuple[Reason, ...]


def first_looks(
    judged: Sequence[Judged], differences: Sequence[Difference], drifts: Sequence[Drift]
) -> tuple[Look, ...]:
    """Return the robots to look at, those first whose gravest reason is gravest."""
    reasons: dict[str, list[Reason]] = {}

    def add(robot: str, reason: Reason) -> None:
        reasons.setdefault(robot, []).append(reason)

    means = np.array([float("nan") if row.errors else row.mean for row in judged])
    limit = _limit(means)
    median = float(np.nanmedian(means)) if np.isfinite(means).any() else 0.0
    last = {row.machine: row.name for row in judged}
    for result in judged:
        if result.message:
            add(result.name, Reason("failed", message=result.message))
            continue
        if result.errors:
            add(result.name, Reason("error", codes=result.errors))
        if result.fit_status not in _SOUND:
            add(result.name, Reason("unsound", codes=(result.fit_status or "",)))
        if result.mean > result.before * (1.0 + 1e-9):  # False for NaN
            add(result.name, Reason("not better", error=result.mean, beside=result.before))
        if result.mean > limit and not result.errors:
            add(result.name, Reason("inaccurate", error=result.mean, beside=median))
    differing: dict[str, list[Difference]] = {}
    for difference in differences:
        differing.setdefault(difference.robot, []).append(difference)
    drifting: dict[str, list[Drift]] = {}
    for drift in drifts:
        drifting.setdefault(drift.machine, []).append(drift)
    for robot, of_robot in differing.items():
        add(robot, Reason("differs", differences=tuple(of_robot)))
    for machine, of_machine in drifting.items():
        add(last.get(machine, machine), Reason("drifts", drifts=tuple(of_machine)))
    if np.isfinite(means).any() and len(judged) > 1:
        worst = judged[int(np.nanargmax(means))]
        add(worst.name, Reason("largest error", error=worst.mean, beside=median))
    looks = [
        Look(robot, tuple(sorted(those, key=lambda reason: WHYS.index(reason.why)))) for robot, those in reasons.items()
    ]
    return tuple(sorted(looks, key=lambda look: (WHYS.index(look.reasons[0].why), -look.reasons[0].size)))


def _limit(means: Array) -> float:
    """Return the error that robots like the others exceed anywhere in 5 % of series: of their logarithms, robustly."""
    from scipy.special import stdtrit

    known = means[np.isfinite(means) & (means > 0.0)]
    if len(known) < LEAST_COMPARED:
        return float("inf")
    centre, spread = robust_spread(np.log(known)[:, None])
    times = float(stdtrit(FREEDOM * (len(known) - 1), 1.0 - FALSE_ALARMS / len(known)))
    return float(np.exp(centre[0] + times * spread[0])) if spread[0] > 0.0 else float("inf")


#: Robots from which on a spread is told; of ten its interval already reaches from two thirds to almost twice of it.
LEAST_SPREAD: Final = 10
#: In at most this share of series is any parameter called wider or narrower than its prior although none is.
_FALSE_VERDICTS: Final = 0.01

#: ``agrees``: chance may make a spread differ so far from its prior. ``too few``, ``shared``, ``prior only``, ``priors
#: differ``: not told.
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
    more frequent than in a normal distribution (Box 1953). A verdict counts all parameters that are compared
    (Bonferroni).

    Args:
        differing: Names of measurements that are left out: robots with a fault say nothing of the kind.
    """
    left_out = set(differing)
    rows = [row for row in kind.latest.tolist() if kind.names[row] not in left_out]
    undrawn, variance = (part[rows] for part in kind.undrawn)
    compared = int(np.sum(kind.determined))
    return tuple(
        _spread(kind, number, undrawn[:, number], variance[:, number], compared)
        for number in range(len(kind.parameters))
    )


def _spread(kind: Kind, number: int, values: Array, variances: Array, compared: int) -> ParameterSpread:
    from scipy.special import chdtri, stdtrit

    known = ~np.isnan(values)
    n = int(np.sum(known))
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
    values, estimated = values[known], float(np.mean(variances[known]))
    mean, scatter = float(np.mean(values)), float(np.var(values, ddof=1))
    tail = (1.0 - SURE) / 2.0
    freedom, chance = _freedom(values), _FALSE_VERDICTS / 2.0 / compared
    ends = (freedom * scatter / float(chdtri(freedom, p)) - estimated for p in (tail, 1.0 - tail, chance, 1.0 - chance))
    spread, low, high, least, most = (float(np.sqrt(max(v, 0.0))) for v in (scatter - estimated, *ends))
    error = float(np.sqrt(scatter / n))
    half = float(stdtrit(n - 1, 1.0 - tail)) * error
    sure = float(stdtrit(n - 1, 1.0 - tail / compared)) * error
    return replace(
        untold,
        verdict="wider" if least > prior else "narrower" if most < prior else "agrees",
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


#: What errors are of: the nominal robot, the calibrated one as an instrument reads it, and without the instrument.
ACCURACIES: Final = ("nominal", "held_out", "truth")


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of robots, one machine an entry, by its last measurement that can be used [m]."""

    #: mean, largest: over the configurations of each robot that its calibration has not seen, ``(machines,)``.
    mean: Array
    largest: Array
    names: tuple[str, ...]  #: Of these measurements.

    @property
    def of_means(self) -> tuple[Quantile, ...]:
        """Quantiles of the mean error over the series."""
        return quantiles(self.mean)

    @property
    def of_largest(self) -> tuple[Quantile, ...]:
        """Quantiles of the largest error over the series."""
        return quantiles(self.largest)


@dataclass(frozen=True, eq=False)
class KindAnalysis:
    """What robots of one kind say of their parameters."""

    kind: Kind
    differences: tuple[Difference, ...]
    spreads: tuple[ParameterSpread, ...]
    drifts: Drifts


@dataclass(frozen=True, eq=False)
class Analysis:
    """All that a fleet says."""

    measurements: int  #: measurements, machines: how many there are.
    machines: int
    failed: tuple[tuple[str, str], ...]  #: Names of those that could not be calibrated, with the reason.
    #: Names of those whose result should not be used as it is: nothing of it is in the figures.
    left_out: tuple[str, ...]
    #: By what they are of, see :data:`ACCURACIES`; those that were not judged are left out.
    errors: Mapping[str, Errors]
    kinds: tuple[KindAnalysis, ...]  #: Robots of one kind each, the kind with most first.
    looks: tuple[Look, ...]  #: Which to look at first.

    @property
    def usable(self) -> int:
        """How many measurements have a result that ends without an error."""
        return self.measurements - len(self.failed) - len(self.left_out)

    @property
    def failing(self) -> tuple[float, float]:
        """The share of a series that cannot be calibrated so, as an interval of 95 %."""
        return share_interval(len(self.failed), self.measurements)

    @property
    def drifts(self) -> tuple[Drift, ...]:
        """All changes of all kinds."""
        return tuple(drift for kind in self.kinds for drift in kind.drifts.changes)


def analysed(rows: Iterable[Row]) -> Analysis:
    """Return what a fleet says; a result that ends with an error is named and has no part in any figure."""
    kinds: dict[str, Gathered] = {}
    judged: list[Judged] = []
    last: dict[str, tuple[float, str, dict[str, Accuracy]]] = {}
    count = 0
    machines = set()
    for row in rows:
        count += 1
        machines.add(row.machine)
        judged.append(Judged.of(row))
        if row.errors:
            continue
        if row.robot not in kinds:
            kinds[row.robot] = Gathered(row.robot)
        kinds[row.robot].add(row)
        known = {name: accuracy for name in ACCURACIES if (accuracy := getattr(row, name)) is not None}
        day = day_of(row.date)
        when = -np.inf if np.isnan(day) else day
        if known and (row.machine not in last or when >= last[row.machine][0]):
            last[row.machine] = (when, row.name, known)
    by_kind = []
    for kind in sorted((g.kind for g in kinds.values() if g.names), key=lambda kind: -len(kind.names)):
        differing = differences(kind)
        by_kind.append(
            KindAnalysis(kind, differing, spreads(kind, {difference.robot for difference in differing}), drifts(kind))
        )
    return Analysis(
        measurements=count,
        machines=len(machines),
        failed=tuple((robot.name, robot.message) for robot in judged if robot.message),
        left_out=tuple(robot.name for robot in judged if robot.errors),
        errors=_errors([(name, known) for _, name, known in last.values()]),
        kinds=tuple(by_kind),
        looks=first_looks(
            judged,
            [difference for each in by_kind for difference in each.differences],
            [drift for each in by_kind for drift in each.drifts.significant],
        ),
    )


def _errors(known: list[tuple[str, dict[str, Accuracy]]]) -> dict[str, Errors]:
    errors = {}
    for kind in ACCURACIES:
        those = [(name, accuracies[kind]) for name, accuracies in known if kind in accuracies]
        if those:
            mean, largest = np.array([(accuracy.mean, accuracy.max) for _, accuracy in those]).T
            errors[kind] = Errors(mean, largest, tuple(name for name, _ in those))
    return errors


def with_proposed(robot: Robot, spreads: Sequence[ParameterSpread]) -> tuple[Robot, tuple[str, ...]]:
    """Return a nominal robot with proposed priors, and the names of the parameters that have them.

    Nominal values are shifted where the whole series lies beside them. Parameters that only a model adds, as
    compliances, are left out: a nominal robot does not have them.
    """
    known = robot.parameters
    proposed = {
        spread.parameter: replace(
            known[spread.parameter].restarted(spread.centre if spread.beside else None), prior=spread.proposed
        )
        for spread in spreads
        if spread.proposed is not None and spread.parameter in known
    }
    if not proposed:
        return robot, ()
    robots = max(spread.robots for spread in spreads)
    words = f"priors of {counted(len(proposed), 'parameter')} from the spread of {counted(robots, 'robot')}"
    source = "; ".join(part for part in (robot.source, words) if part)
    return replace(robot.with_parameters(proposed.values()), source=source), tuple(proposed)


def _rounded(value: float, unit: str) -> float:
    """Return a deviation [SI] with three digits in the unit of files: more of them mean nothing."""
    shown = SHOWN_AS[unit]
    return to_si(float(f"{from_si(value, shown):.3g}"), shown)
