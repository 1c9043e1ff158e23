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
from truearm.validation.iso9283.streams import spans_of
from truearm.validation.iso9283.synchronise import Cycle
from truearm.validation.iso9283.tops import largest_top
from truearm.validation.iso9283.values import COARSE, Instrument, Value

#: Up to this share of the side behind it the tip is said to come from the corner.
_AFTER = 0.5
#: Straight lines from sample to sample cut off less than a tenth of the least distance if samples are no further
#: apart than so many times that distance: on an arc that touches both sides, and on no arc at all.
_SPARSE = 1.2
#: Less beyond a side is rounding [m].
_NOTHING = 1e-9
#: So many samples show how far the tip goes beyond a side.
_LEAST_OUTSIDE = 4
#: Beyond this share of that part of a side the tip keeps its line; so many steps on either side of the nearest tell how
#: far samples are apart at the corner.
_KEPT, _ABOUT = 0.8, 2
#: Positions are straight lines through samples within this share of the least distance: on an arc that changes the
#: distance by less than half a percent.
_SMOOTHED = 0.2


@dataclass(frozen=True, eq=False)
class CornerCurves:
    """The way round a corner, for pictures."""

    where: str  #: Path and corner, ``rectangle E2``.
    run: Run  #: What it comes from.
    #: corner, before, after: the corner in the base frame [m], and unit vectors of the sides before and after it,
    #: ``(3,)``.
    corner: Array
    before: Array
    after: Array
    attained: tuple[Array, ...]  #: Of each cycle: positions near the corner [m], ``(k, 3)``.
    along: tuple[Array, ...]  #: Of each cycle: arc length from the corner [m], ``(k,)``.
    #: rounding, overshoot, stabilisation: cR, CO, and the length of path after the corner from which on the tip stays
    #: within the limit band of the line that it then keeps [m], ``(cycles,)``.
    rounding: Array
    overshoot: Array
    stabilisation: Array
    #: From the commanded corner to that of the two lines that the tip keeps before and behind it [m], ``(cycles, 3)``.
    aside: Array
    own: Array  #: Least distance from that corner [m], ``(cycles,)``.
    sparse: tuple[bool, bool]  #: Whether samples are too far apart for CR, and for CO.
    noise: float  #: How far beyond the second side noise alone would seem to go, the most of the cycles [m].

    @property
    def offset(self) -> float:
        """Distance of the corner of the attained path from the commanded one, mean of the cycles [m]."""
        return float(np.linalg.norm(self.aside, axis=1).mean())


@dataclass(frozen=True, eq=False)
class _Turn:
    """A cycle near a corner: see :class:`CornerCurves`."""

    attained: Array
    along: Array
    rounding: float
    overshoot: float
    stabilisation: float
    aside: Array
    own: float
    spacing: float  #: Between the samples at the corner [m].
    outside: int  #: So many samples in a row are beyond the side about the one that is furthest.
    noise: float  #: How far beyond the side noise alone would seem to go [m].


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
            here = _corner(run, number, max(plan.limit_band, 3 * instrument.sigma), instrument.sigma)
            found.append(here)
            for id_, lengths, sparse in zip(("CR", "CO"), (here.rounding, here.overshoot), here.sparse, strict=True):
                mean = float(lengths.mean())
                coarse = instrument.sigma > COARSE * mean and (id_ == "CR" or mean > 0.0)
                coarse |= id_ == "CO" and here.noise > COARSE * mean > 0.0
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
                        run.status(coarse=sparse or coarse),
                        float(lengths.min()),
                        float(lengths.max()),
                    )
                )
    return values, found


def _corner(run: Run, number: int, band: float, sigma: float) -> CornerCurves:
    path = run.path
    at = float(path.starts[number])
    before, after = path.tangents(np.array([at - 1e-6, at + 1e-6]))
    reach = (_AFTER * (at - float(path.starts[number - 1])), _AFTER * (float(path.starts[number + 1]) - at))
    turns = [_cycle(cycle, run, at, before, after, reach, band, sigma) for cycle in run.cycles]
    rounding, overshoot = (np.array([getattr(turn, name) for turn in turns]) for name in ("rounding", "overshoot"))
    far = float(np.mean([turn.spacing for turn in turns])) > _SPARSE * float(rounding.mean())
    highest = max(turns, key=lambda turn: turn.overshoot)
    return CornerCurves(
        f"{path.path.name} E{number + 1}",
        run,
        path.vertices[number],
        before,
        after,
        tuple(turn.attained for turn in turns),
        tuple(turn.along for turn in turns),
        rounding,
        overshoot,
        np.array([turn.stabilisation for turn in turns]),
        np.array([turn.aside for turn in turns]),
        np.array([turn.own for turn in turns]),
        (far, highest.outside < _LEAST_OUTSIDE if highest.overshoot > _NOTHING else far),
        max(turn.noise for turn in turns),
    )


def _cycle(
    cycle: Cycle,
    run: Run,
    at: float,
    before: Array,
    after: Array,
    reach: tuple[float, float],
    band: float,
    sigma: float,
) -> _Turn:
    """Return a cycle near the corner."""
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
    beyond = np.where(outside, np.linalg.norm(aside, axis=1), 0.0)
    raw_aside = position - corner - np.outer((position - corner) @ after, after)
    first = int(behind.argmax()) if behind.any() else 0
    overshoot, noise = largest_top(time[first:], raw_aside[first:], outside[first:], sigma)
    highest = [span for span in spans_of(beyond > 0.0) if span[0] <= int(beyond.argmax()) <= span[1]]
    kept = _kept(aside[along > _KEPT * reach[1]])
    kept_before = _kept((away - np.outer(away @ before, before))[along < -_KEPT * reach[0]])
    unsettled = np.flatnonzero(behind & (np.linalg.norm(aside - kept, axis=1) > band))
    stabilisation = float(away[unsettled[-1]] @ after) if len(unsettled) else 0.0
    # where the two lines that the tip keeps come nearest to each other
    lines = np.concatenate([np.eye(3) - np.outer(before, before), np.eye(3) - np.outer(after, after)])
    own = np.linalg.lstsq(lines, np.concatenate([kept_before, kept]), rcond=None)[0]
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    nearest = int(_distance(position, corner).argmin())
    return _Turn(
        smooth,
        along,
        rounding,
        overshoot,
        stabilisation,
        own,
        float(_distance(smooth, corner + own).min()),
        max(float(np.median(steps[max(nearest - _ABOUT, 0) : nearest + _ABOUT + 1])), float(steps[nearest])),
        highest[0][1] - highest[0][0] + 1 if highest else 0,
        noise,
    )


def _kept(aside: Array) -> Array:
    return np.asarray(np.median(aside, axis=0)) if len(aside) else np.zeros(3)


def _distance(position: Array, corner: Array) -> Array:
    """Return the least distance of each stretch between two samples from the corner, ``(n - 1,)``."""
    begin, step = position[:-1], np.diff(position, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(((corner - begin) * step).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(begin + share[:, None] * step - corner, axis=1))
