"""What is to be said of readings and times that were written with few decimals."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from truearm.notices import Notice
from truearm.validation.iso9283.clock import Clock
from truearm.validation.iso9283.evaluation import Evaluation
from truearm.validation.iso9283.values import Instrument

#: So many records are named.
_NAMED = 4


def said_of_rounding(found: Evaluation, instrument: Instrument) -> tuple[Notice, ...]:
    """Return what is to be said of rounding.

    Args:
        instrument: As stated, without what rounding adds.
    """
    notices = (_readings(found, instrument), _times(found, instrument))
    return tuple(notice for notice in notices if notice is not None)


def _readings(found: Evaluation, instrument: Instrument) -> Notice | None:
    told = []
    for name, reading in found.readings.items():
        if reading.rounding > instrument.sigma:
            step = 1e3 * math.sqrt(12.0) * reading.rounding
            told.append(f"positions of {name} to {step:.3g} mm ({1e3 * reading.rounding:.2g} mm)")
        if instrument.sigma_rot is not None and reading.rounding_rot > instrument.sigma_rot:
            step = math.sqrt(3.0) * reading.rounding_rot
            told.append(f"quaternions of {name} to {step:.2g} ({math.degrees(reading.rounding_rot):.2g} deg)")
    if not told:
        return None
    return Notice(
        "readings-rounded",
        f"Readings are rounded more coarsely than the instrument reads: {', '.join(told)}. What that leaves open "
        "as a standard deviation, in brackets, stands in place of the instrument's. Write more decimals.",
        "note",
    )


def _times(found: Evaluation, instrument: Instrument) -> Notice | None:
    told: dict[str, str] = {}
    for of, clock, pace in _clocks(found):
        off = pace * clock.resolution / math.sqrt(12.0)
        if off > instrument.sigma and of not in told:
            even = "on an even clock" if clock.even else "no even clock fits"
            told[of] = f"{of} to {clock.resolution:g} s, {1e3 * pace * clock.resolution:.2g} mm ({even})"
    if not told:
        return None
    more = f", and {len(told) - _NAMED} more" if len(told) > _NAMED else ""
    return Notice(
        "times-rounded",
        f"Times are rounded to more than the tip is known to move in: {', '.join(list(told.values())[:_NAMED])}{more}. "
        "Samples that an even clock fits were placed on it; where none does, rounding counts as noise, and what it "
        "leaves open is marked. Write the times with more decimals.",
        "note",
    )


def _clocks(found: Evaluation) -> Iterator[tuple[str, Clock, float]]:
    """Yield whose each clock is, and how fast the tip is there: at rest where it enters the band [m/s]."""
    runs = [one.run for one in found.velocities] + [one.run for one in found.deviations]
    runs += [one.run for one in found.corners] + [one.run for one in found.weaves]
    for run in runs:
        for clock in {id(cycle.clock): cycle.clock for cycle in run.cycles}.values():
            yield f"{run.test} on {run.path.path.name}", clock, run.velocity
    for curve in found.settling:
        row = int(np.clip(np.searchsorted(curve.time, curve.entry), 1, len(curve.time) - 1))
        pace = abs(np.diff(curve.distance)[row - 1]) / max(curve.time[row] - curve.time[row - 1], 1e-9)
        yield f"{curve.test} at {curve.where}", curve.clock, float(pace)
