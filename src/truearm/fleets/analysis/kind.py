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

from dataclasses import dataclass
from datetime import date
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.fleets.rows import FoundParameters, Row
from truearm.modeling.chain import Array

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
    days: Array  #: When, in days; NaN where that is not known, ``(rows,)``.
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
        self._drawn: list[bool] = []
        self._units: dict[str, str] = {}
        self._waiting: dict[tuple[str, ...], list[tuple[int, FoundParameters]]] = {}
        self._found: list[tuple[list[int], list[int], Array]] = []
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
            [getattr(found, kind) for _, found in waiting] for kind in ("value", "nominal", "deviation", "prior")
        ]
        figures = np.stack([np.array(column) for column in columns], axis=2)
        self._found.append(([number for number, _ in waiting], [known[name] for name in names], figures))

    @property
    def kind(self) -> Kind:
        """All of them as arrays."""
        for names in [*self._waiting]:
            self._take(names)
        figures = np.full((len(self.names), len(self._units), 4), np.nan)
        places: list[list[int]] = [[]] * len(self.names)
        for rows, columns, found in self._found:
            figures[np.ix_(rows, columns)] = found
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
