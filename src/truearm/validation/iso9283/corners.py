"""Cornering deviations CR and CO, and the length of path after which the tip has settled.

CR is the least distance from the corner to the attained path. CO is the largest deviation from the commanded path after
the corner, to the outside: in the direction in which the tip came, as secondary descriptions of ISO 9283 have it; what
is left inside is the rounding that CR tells. Both are means of the cycles, with their range (the standard's text was
not at hand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.measurement.performance.records import Samples
from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.runs import Run, runs_of
from truearm.validation.iso9283.smoothing import local_lines
from truearm.validation.iso9283.synchronise import Cycle
from truearm.validation.iso9283.values import COARSE, Instrument, Value

#: Up to this share of the side behind it the tip is said to come from the corner.
_AFTER = 0.5
#: Positions are straight lines through samples within this share of the least distance: on an arc that changes the
#: distance by less than half a percent.
_SMOOTHED = 0.2


@dataclass(frozen=True, eq=False)
class CornerCurves:
    """The way round a corner, for pictures.

    Attributes
    ----------
    where
        Path and corner, ``rectangle E2``.
    run
        What it comes from.
    corner, before, after
        The corner in the base frame [m], and unit vectors of the sides before and after it, ``(3,)``.
    attained
        Of each cycle: positions near the corner [m], ``(k, 3)``.
    along
        Of each cycle: arc length from the corner [m], ``(k,)``.
    rounding, overshoot, stabilisation
        CR, CO, and the length of path after the corner from which on the tip stays within the limit band of the line
        that it then keeps [m], ``(cycles,)``.
    """

    where: str
    run: Run
    corner: Array
    before: Array
    after: Array
    attained: tuple[Array, ...]
    along: tuple[Array, ...]
    rounding: Array
    overshoot: Array
    stabilisation: Array


def corner_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[CornerCurves]]:
    """Return CR and CO of every corner between the begin and the end of the path, and what they come from.

    Three cycles give no interval: each value has the least and the largest of the cycles.
    """
    values: list[Value] = []
    found: list[CornerCurves] = []
    for run in runs_of(plan, samples, transform, "CR"):
        for number in range(1, len(run.path.vertices) - 1):
            here = _corner(run, number, max(plan.limit_band, 3 * instrument.sigma))
            found.append(here)
            for id_, lengths in (("CR", here.rounding), ("CO", here.overshoot)):
                mean = float(lengths.mean())
                values.append(
                    Value(
                        id_,
                        "position",
                        here.where,
                        mean,
                        "length",
                        None,
                        len(lengths),
                        run.conditions,
                        run.status(coarse=instrument.sigma > COARSE * mean and (id_ == "CR" or mean > 0.0)),
                        float(lengths.min()),
                        float(lengths.max()),
                    )
                )
    return values, found


def _corner(run: Run, number: int, band: float) -> CornerCurves:
    path = run.path
    at = float(path.starts[number])
    before, after = path.tangents(np.array([at - 1e-6, at + 1e-6]))
    reach = (_AFTER * (at - float(path.starts[number - 1])), _AFTER * (float(path.starts[number + 1]) - at))
    rows = [_cycle(cycle, run, at, before, after, reach, band) for cycle in run.cycles]
    attained, along, rounding, overshoot, stabilisation = zip(*rows, strict=True)
    return CornerCurves(
        f"{path.path.name} E{number + 1}",
        run,
        path.vertices[number],
        before,
        after,
        attained,
        along,
        np.array(rounding),
        np.array(overshoot),
        np.array(stabilisation),
    )


def _cycle(
    cycle: Cycle, run: Run, at: float, before: Array, after: Array, reach: tuple[float, float], band: float
) -> tuple[Array, Array, float, float, float]:
    """Return positions and arc lengths near the corner, CR, CO and the length of stabilisation of a cycle."""
    near = np.flatnonzero((cycle.along > at - reach[0]) & (cycle.along < at + reach[1]))
    chosen = slice(int(near[0]), int(near[-1]) + 1)
    corner = run.path.points(np.array([at]))[0]
    position, time, along = cycle.position[chosen], cycle.time[chosen], cycle.along[chosen] - at
    raw = float(_distance(position, corner).min())
    half = _SMOOTHED * raw / run.velocity
    smooth = local_lines(time, position, time, half)[0] if half > np.median(np.diff(time)) else position
    rounding = float(_distance(smooth, corner).min())
    # behind the corner: nearer to the second side, and past the corner along it
    away = smooth - corner
    behind = (away @ after > 0) & (np.maximum.accumulate(along) > 0)
    aside = away - np.outer(away @ after, after)
    outside = behind & (aside @ before > 0)
    overshoot = float(np.linalg.norm(aside[outside], axis=1).max(initial=0.0))
    kept = np.median(aside[along > 0.8 * reach[1]], axis=0) if (along > 0.8 * reach[1]).any() else np.zeros(3)
    unsettled = np.flatnonzero(behind & (np.linalg.norm(aside - kept, axis=1) > band))
    stabilisation = float(away[unsettled[-1]] @ after) if len(unsettled) else 0.0
    return smooth, along, rounding, overshoot, stabilisation


def _distance(position: Array, corner: Array) -> Array:
    """Return the least distance of each stretch between two samples from the corner, ``(n - 1,)``."""
    begin, step = position[:-1], np.diff(position, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(((corner - begin) * step).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(begin + share[:, None] * step - corner, axis=1))
