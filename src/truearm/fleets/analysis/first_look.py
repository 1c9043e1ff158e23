"""Which robots of a fleet to look at first, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from truearm.fleets.analysis.differing import FALSE_ALARMS, LEAST_COMPARED, Difference
from truearm.fleets.analysis.drift import Drift
from truearm.fleets.analysis.robust import FREEDOM, robust_spread
from truearm.fleets.rows import Row
from truearm.modeling.chain import Array

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
        times = [abs(one.times) for one in self.differences] + [abs(one.times) for one in self.drifts]
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

    means = np.array([float("nan") if one.errors else one.mean for one in judged])
    limit = _limit(means)
    median = float(np.nanmedian(means)) if np.isfinite(means).any() else 0.0
    last = {one.machine: one.name for one in judged}
    for one in judged:
        if one.message:
            add(one.name, Reason("failed", message=one.message))
            continue
        if one.errors:
            add(one.name, Reason("error", codes=one.errors))
        if one.fit_status not in _SOUND:
            add(one.name, Reason("unsound", codes=(one.fit_status or "",)))
        if one.mean > one.before * (1.0 + 1e-9):  # False for NaN
            add(one.name, Reason("not better", error=one.mean, beside=one.before))
        if one.mean > limit and not one.errors:
            add(one.name, Reason("inaccurate", error=one.mean, beside=median))
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
