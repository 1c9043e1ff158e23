"""Cornering and weaving deviations of ISO 9283: CR, CO, WS and WF."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.rows import COARSE, Instrument, Value
from truearm.iso9283.criteria.runs import Run, runs_of
from truearm.iso9283.criteria.streams import Cycle, largest_top, local_lines, spans_of
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Samples

# Cornering deviations CR and CO, and the length of path after which the tip has settled.
#
# CR is the least distance from the corner to the attained path. CO is the largest deviation from the commanded path
# after the corner, to the outside: in the direction in which the tip came, as secondary descriptions of ISO 9283 have
# it; what is left inside is the rounding that CR tells. Both are means of the cycles, with their range (the standard's
# text was not at hand).

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
_STRAIGHT_SHARE, _ABOUT = 0.8, 2
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
    curves: list[CornerCurves] = []
    for run in runs_of(plan, samples, transform, "CR"):
        for number in range(1, len(run.path.vertices) - 1):
            corner = _corner(run, number, max(plan.limit_band, 3 * instrument.sigma), instrument.sigma)
            curves.append(corner)
            for id_, lengths, sparse in zip(
                ("CR", "CO"), (corner.rounding, corner.overshoot), corner.sparse, strict=True
            ):
                mean = float(lengths.mean())
                coarse = instrument.sigma > COARSE * mean and (id_ == "CR" or mean > 0.0)
                coarse |= id_ == "CO" and corner.noise > COARSE * mean > 0.0
                values.append(
                    Value(
                        id_,
                        "position",
                        corner.where,
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
    return values, curves


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
    offset_after = _median_offset(aside[along > _STRAIGHT_SHARE * reach[1]])
    offset_before = _median_offset((away - np.outer(away @ before, before))[along < -_STRAIGHT_SHARE * reach[0]])
    unsettled = np.flatnonzero(behind & (np.linalg.norm(aside - offset_after, axis=1) > band))
    stabilisation = float(away[unsettled[-1]] @ after) if len(unsettled) else 0.0
    # where the two lines that the tip keeps come nearest to each other
    lines = np.concatenate([np.eye(3) - np.outer(before, before), np.eye(3) - np.outer(after, after)])
    own = np.linalg.lstsq(lines, np.concatenate([offset_before, offset_after]), rcond=None)[0]
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


def _median_offset(aside: Array) -> Array:
    return np.asarray(np.median(aside, axis=0)) if len(aside) else np.zeros(3)


def _distance(position: Array, corner: Array) -> Array:
    """Return the least distance of each stretch between two samples from the corner, ``(n - 1,)``."""
    begin, step = position[:-1], np.diff(position, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(((corner - begin) * step).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(begin + share[:, None] * step - corner, axis=1))


#: A side is reached beyond this share of half the stroke.
_SIDE = 0.4
#: A turn is first read over this share of the time that the tip is on its side, before and behind: an eighteenth of the
#: period of a sine; then over less, until a parabola leaves no more than noise, times this, and what
#: chance adds to few samples.
_SHARE, _LEFT = 0.15, 1.0
#: Median size of a standard normal number.
_MEDIAN = 0.6745
#: A turn is sharper than a parabola if its outermost sample is so many standard deviations of noise beyond.
_SHARPER = 4.0
#: Sharp turns on a side are read from so many samples about the outermost.
_ABOUT_WEAVING = 2
#: A parabola that is checked goes through so many samples or more.
_LEAST_NEAR = 7
#: Fewer samples in a period do not show how far it goes.
_LEAST_SAMPLES = 20
#: Whole periods that a cycle must have.
_LEAST_PERIODS = 2


# WS is the attained stroke minus the commanded one over the commanded one; WF the same of the frequency, whose command
# is the commanded velocity over the wavelength (the table; the standard's text was not at hand).
@dataclass(frozen=True, eq=False)
class WeaveCurves:
    """A weave, for pictures."""

    path: str  #: Its name.
    run: Run  #: What it comes from.
    #: along, across: of each cycle: arc length on the line in the middle, and to the side [m].
    along: tuple[Array, ...]
    across: tuple[Array, ...]
    time: tuple[Array, ...]  #: Of each cycle [s].
    stroke: Array  #: stroke, frequency: of each cycle [m], [Hz], ``(cycles,)``.
    frequency: Array


def weaving_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[WeaveCurves]]:
    """Return WS and WF of every weave and condition, the mean of the cycles with their range, and the curves.

    Raises:
        InputError: If a cycle has fewer than two whole periods.
    """
    values: list[Value] = []
    curves: list[WeaveCurves] = []
    for run in runs_of(plan, samples, transform, "WS"):
        path = run.path.path
        tangent = run.path.tangents(np.array([0.0]))[0]
        side = np.cross(path.normal, tangent)
        across = [(cycle.position - path.points[0]) @ side for cycle in run.cycles]
        read = [_read(cycle, a, path.stroke, samples.source) for cycle, a in zip(run.cycles, across, strict=True)]
        stroke, frequency, few = (np.array(column) for column in zip(*read, strict=True))
        commanded = run.velocity / path.wavelength
        coarse = bool(few.min() < _LEAST_SAMPLES)
        for id_, ratios, noise in (
            ("WS", stroke / path.stroke - 1.0, 2 * instrument.sigma / path.stroke),
            ("WF", frequency / commanded - 1.0, 0.0),
        ):
            mean = float(ratios.mean())
            values.append(
                Value(
                    id_,
                    "position",
                    path.name,
                    mean,
                    "ratio",
                    None,
                    len(ratios),
                    run.conditions,
                    run.status(coarse=(coarse and id_ == "WS") or noise > COARSE * abs(mean)),
                    float(ratios.min()),
                    float(ratios.max()),
                )
            )
        curves.append(
            WeaveCurves(
                path.name,
                run,
                tuple(cycle.along for cycle in run.cycles),
                tuple(across),
                tuple(cycle.time - cycle.time[0] for cycle in run.cycles),
                stroke,
                frequency,
            )
        )
    return values, curves


def _read(cycle: Cycle, across: Array, stroke: float, source: str) -> tuple[float, float, float]:
    """Return the stroke [m], the frequency [Hz] and the number of samples in a period.

    The middle of the strip is that between the outermost points. The stroke is the mean outermost point on one side
    less that on the other, each from a parabola through the samples about it; the first and the last turn are left out,
    because the tip begins and stops there. The frequency is that of the passages through the middle, each from a line
    through its samples.
    """
    time = cycle.time
    low, high = np.quantile(across, [0.02, 0.98])
    middle, half = (low + high) / 2, max((high - low) / 2, stroke / 8)
    state = np.where(across - middle > _SIDE * half, 1, np.where(across - middle < -_SIDE * half, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), 0))
    sides = state[last]
    turns = sorted([(*span, 1) for span in spans_of(sides == 1)] + [(*span, -1) for span in spans_of(sides == -1)])
    inner = turns[1:-1]
    noise = float(np.median(np.abs(np.diff(across, n=3)))) / (_MEDIAN * np.sqrt(20.0))
    if len(inner) < 2 * _LEAST_PERIODS:
        raise InputError(
            "the weave has too few whole periods",
            where=f"{source}, cycle that begins on line {cycle.line}",
            came=f"{max(len(inner), 0) / 2:g}",
            allowed=f"{_LEAST_PERIODS} or more, besides the first and the last turn",
            cure="Weave along a longer line, or check stroke and wavelength in the plan.",
        )
    outermost: dict[int, list[float]] = {1: [], -1: []}
    for first, final, sign in inner:
        side = first + np.flatnonzero(sign * (across[first : final + 1] - middle) > _SIDE * half)
        outermost[sign].append(_top(time, sign * across, side, noise))
    passages = []
    for (_, final, _), (first, _, _) in itertools.pairwise(turns):
        # sides keep their sign until the other side is reached: from the last sample beyond one to the first beyond
        before = final - int((state[final::-1] != 0).argmax())
        part = slice(before, first + 1)
        passages.append(float(np.polyfit(across[part] - middle, time[part] - time[first], 1)[1] + time[first]))
    number = np.arange(len(passages))
    period = 2.0 * float(np.polyfit(number, np.array(passages) - passages[0], 1)[0])
    step = float(np.median(np.diff(time)))
    reached = float(np.mean(outermost[1]) + np.mean(outermost[-1]))
    return reached, 1.0 / period, period / step


def _top(time: Array, across: Array, side: NDArray[np.intp], noise: float) -> float:
    """Return how far a turn goes.

    The top is that of a parabola through the samples about the middle of the turn, as long as it leaves no more than
    noise: the largest of many samples would be too large. A turn that is sharper is read from few samples about the
    outermost, or from that one where it is beyond the parabola by more than noise.

    Args:
        side: Samples of the turn on its side, ``(k,)``.
        noise: Standard deviation of `across` by noise.
    """
    about = slice(max(int(side[0]) - 1, 0), int(side[-1]) + 2)
    t, y = time[about], across[about]
    centre, half = 0.5 * float(time[side[0]] + time[side[-1]]), _SHARE * float(time[side[-1]] - time[side[0]])
    while int((np.abs(t - centre) <= half).sum()) >= _LEAST_NEAR:
        for _ in range(2):  # again about the top that was found
            near = np.abs(t - centre) <= half
            if int(near.sum()) < _LEAST_NEAR:
                break
            x = (t[near] - centre) / half
            a, b, c = np.polyfit(x, y[near], 2)
            free = len(x) - 3
            left = float(np.sqrt(((y[near] - np.polyval((a, b, c), x)) ** 2).sum() / free))
            most = noise * (_LEFT + np.sqrt(1.5 / free))
            at = float(np.clip(-b / (2 * a), -1.0, 1.0)) if a < 0 else 0.0
            top = float(a * at * at + b * at + c)
            centre += at * half
        if a < 0 and left <= most:
            return top
        half /= 1.5
    peak = int(side[across[side].argmax()])
    first, last = max(peak - _ABOUT_WEAVING, 0), min(peak + _ABOUT_WEAVING + 1, len(time))
    t, y = time[first:last] - time[peak], across[first:last]
    if len(t) < 4:
        return float(across[peak])
    a, b, c = np.polyfit(t / (t[-1] - t[0]), y, 2)
    if a >= 0:
        return float(y.mean())
    at = float(np.clip(-b / (2 * a), t[0] / (t[-1] - t[0]), t[-1] / (t[-1] - t[0])))
    top = float(a * at * at + b * at + c)
    return float(across[peak]) if across[peak] > top + _SHARPER * noise else top
