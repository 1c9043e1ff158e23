"""All that a fleet says, from its rows read once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.fleets.analysis.accuracy import Quantile, quantiles, share_interval
from truearm.fleets.analysis.differing import Difference, differences
from truearm.fleets.analysis.drift import Drift, Drifts, drifts
from truearm.fleets.analysis.first_look import Judged, Look, first_looks
from truearm.fleets.analysis.kind import Gathered, Kind, day_of
from truearm.fleets.analysis.spread import ParameterSpread, spreads
from truearm.fleets.rows import Accuracy, Row
from truearm.modeling.chain import Array

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
class KindFound:
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
    kinds: tuple[KindFound, ...]  #: Robots of one kind each, the kind with most first.
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
        return tuple(one for found in self.kinds for one in found.drifts.found)


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
    found = []
    for kind in sorted((g.kind for g in kinds.values() if g.names), key=lambda kind: -len(kind.names)):
        differing = differences(kind)
        found.append(KindFound(kind, differing, spreads(kind, {one.robot for one in differing}), drifts(kind)))
    return Analysis(
        measurements=count,
        machines=len(machines),
        failed=tuple((one.name, one.message) for one in judged if one.message),
        left_out=tuple(one.name for one in judged if one.errors),
        errors=_errors([(name, known) for _, name, known in last.values()]),
        kinds=tuple(found),
        looks=first_looks(
            judged,
            [one for each in found for one in each.differences],
            [one for each in found for one in each.drifts.significant],
        ),
    )


def _errors(known: list[tuple[str, dict[str, Accuracy]]]) -> dict[str, Errors]:
    made = {}
    for kind in ACCURACIES:
        those = [(name, one[kind]) for name, one in known if kind in one]
        if those:
            mean, largest = np.array([(one.mean, one.max) for _, one in those]).T
            made[kind] = Errors(mean, largest, tuple(name for name, _ in those))
    return made
