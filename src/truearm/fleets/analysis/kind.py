"""What was found of robots of one kind, as arrays, and what of it can be compared.

A value that priors hold near its nominal value is drawn towards it. Where ``x`` is the true difference from nominal,
``P`` the variances of the priors (diagonal) and ``C`` the covariance of the result, that result is ``A x`` plus errors
of the readings with covariance ``A C``, and ``A = I - C / P``. The diagonal of ``A`` is the informed share. A parameter
is *determined* where that share is 0.9 or more: a robot's value is then its own, and dividing by the share makes it
unbiased but for at most a tenth of what other parameters' priors are off by. It is *shared* where the share is less:
the readings tell a combination with others, such as ``d_2 + d_3``. Below 0.05 nothing but the prior holds it, as where
base or target can move instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import groupby
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.fleets.rows import Row
from truearm.modeling.chain import Array

#: Informed share from which on a parameter is determined, and below which nothing but its prior holds it.
DETERMINED: Final = 0.9
UNINFORMED: Final = 0.05
#: Nominal values and priors that differ by less, of their size, are the same.
_SAME: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Kind:
    """Robots of one kind that were calibrated, one row a measurement.

    Attributes
    ----------
    robot
        Its name.
    names
        Of the measurements, ``rows`` of them.
    machines
        The machine of each: several measurements may be of one.
    days
        When, in days; NaN where that is not known, ``(rows,)``.
    parameters, units
        Those of the arm that were identified in any row, with their SI units.
    nominal, prior
        Value before and its standard deviation [SI], ``(parameters,)``; NaN where robots disagree about them.
    difference
        What was found less nominal [SI], ``(rows, parameters)``; NaN where it was not identified.
    deviation
        Standard deviation of that [SI], ``(rows, parameters)``.
    informed
        Share of the prior variance that the readings removed, ``(rows, parameters)``.
    drawn
        Whether priors drew the values towards nominal, ``(rows,)``.
    covariances
        Of each row, in priors, ``(parameters, parameters)``; None where it is not known.
    """

    robot: str
    names: tuple[str, ...]
    machines: tuple[str, ...]
    days: Array
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    nominal: Array
    prior: Array
    difference: Array
    deviation: Array
    informed: Array
    drawn: NDArray[np.bool_]
    covariances: tuple[Array | None, ...]

    @property
    def latest(self) -> NDArray[np.intp]:
        """Indices of the last measurement of each machine, in order; without dates the last one named."""
        last: dict[str, tuple[float, int]] = {}
        for row, (machine, day) in enumerate(zip(self.machines, self.days.tolist(), strict=True)):
            when = -np.inf if np.isnan(day) else day
            if machine not in last or when >= last[machine][0]:
                last[machine] = (when, row)
        return np.array(sorted(row for _, row in last.values()), dtype=np.intp)

    @property
    def share(self) -> Array:
        """Typical informed share of each parameter, ``(parameters,)``; NaN where robots disagree about the prior."""
        with np.errstate(invalid="ignore"):
            typical = _medians(np.where(np.isnan(self.difference), 0.0, self.informed))
        return np.where(np.isnan(self.prior), np.nan, typical)

    @property
    def determined(self) -> NDArray[np.bool_]:
        """Which parameters are determined in most of the measurements, ``(parameters,)``."""
        return np.asarray(self.share >= DETERMINED)

    @property
    def shared(self) -> NDArray[np.bool_]:
        """Which are told together with others only, ``(parameters,)``."""
        return np.asarray((self.share >= UNINFORMED) & (self.share < DETERMINED))

    @property
    def pull(self) -> Array:
        """What is left of a difference where priors draw it towards nominal, ``(rows, parameters)``, 0 to 1."""
        return np.asarray(np.where(self.drawn[:, None], self.informed, 1.0))

    @property
    def undrawn(self) -> tuple[Array, Array]:
        """Differences without the pull of priors, and the variances of these, both ``(rows, parameters)``."""
        with np.errstate(invalid="ignore", divide="ignore"):
            pull = np.where(self.pull >= UNINFORMED, self.pull, np.nan)
            return self.difference / pull, self.deviation**2 / pull


def kinds_of(rows: Iterable[Row]) -> tuple[Kind, ...]:
    """Return the robots that were calibrated, kind by kind, the kind with most first."""
    found = sorted((row for row in rows if row.status == "calibrated" and row.parameters), key=lambda row: row.robot)
    kinds = [_kind(robot, [*those]) for robot, those in groupby(found, key=lambda row: row.robot)]
    return tuple(sorted(kinds, key=lambda kind: -len(kind.names)))


def day_of(text: str | None) -> float:
    """Return a date (ISO 8601) in days; NaN for none."""
    return float("nan") if text is None else float(date.fromisoformat(text[:10]).toordinal())


def _kind(robot: str, rows: Sequence[Row]) -> Kind:
    known = dict.fromkeys(name for row in rows for name in row.parameters)
    place = {name: number for number, name in enumerate(known)}
    shape = (len(rows), len(place))
    nominal, prior, difference, deviation, informed = (np.full(shape, np.nan) for _ in range(5))
    units = dict.fromkeys(known, "")
    for number, row in enumerate(rows):
        for name, one in row.parameters.items():
            at = (number, place[name])
            units[name] = one.unit
            nominal[at], prior[at] = one.nominal, one.prior
            difference[at], deviation[at] = one.value - one.nominal, one.deviation
            informed[at] = _informed(one.deviation, one.prior, drawn=row.drawn)
    return Kind(
        robot=robot,
        names=tuple(row.name for row in rows),
        machines=tuple(row.machine for row in rows),
        days=np.array([day_of(row.date) for row in rows]),
        parameters=tuple(known),
        units=tuple(units.values()),
        nominal=_one_for_all(nominal),
        prior=_one_for_all(prior, _one_for_all(nominal)),
        difference=difference,
        deviation=deviation,
        informed=informed,
        drawn=np.array([row.drawn for row in rows]),
        covariances=tuple(_covariance(row, place) for row in rows),
    )


def _informed(deviation: float, prior: float, *, drawn: bool) -> float:
    share = (deviation / prior) ** 2
    return max(1.0 - share, 0.0) if drawn else 1.0 / (1.0 + share)


def _one_for_all(values: Array, beside: Array | None = None) -> Array:
    """Return the one value of each column, NaN where rows disagree or where there is none `beside` it."""
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    same = high - low <= _SAME * np.maximum(np.abs(high), 1e-3)
    return np.where(same if beside is None else same & ~np.isnan(beside), np.nanmedian(values, axis=0), np.nan)


def _covariance(row: Row, place: dict[str, int]) -> Array | None:
    """Return the covariance of a row among all parameters, in priors; parameters it has not identified are at prior."""
    if not row.covariance:
        return None
    names = [place[name] for name in row.parameters]
    own = np.zeros((len(names), len(names)))
    own[np.tril_indices(len(names))] = row.covariance
    own = own + np.tril(own, -1).T
    whole = np.eye(len(place))
    whole[np.ix_(names, names)] = own
    return whole


def _medians(values: Array) -> Array:
    return np.asarray(np.median(values, axis=0))
