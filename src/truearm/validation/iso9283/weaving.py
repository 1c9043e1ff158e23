"""Weaving deviations WS and WF: relative errors of stroke and frequency.

WS is the attained stroke minus the commanded one over the commanded one; WF the same of the frequency, whose command is
the commanded velocity over the wavelength (the issue's table; the standard's text was not at hand).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.performance.records import Samples
from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.runs import Run, runs_of
from truearm.validation.iso9283.streams import spans_of
from truearm.validation.iso9283.synchronise import Cycle
from truearm.validation.iso9283.values import COARSE, Instrument, Value

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
_ABOUT = 2
#: A parabola that is checked goes through so many samples or more.
_LEAST_NEAR = 7
#: Fewer samples in a period do not show how far it goes.
_LEAST_SAMPLES = 20
#: Whole periods that a cycle must have.
_LEAST_PERIODS = 2


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
    first, last = max(peak - _ABOUT, 0), min(peak + _ABOUT + 1, len(time))
    t, y = time[first:last] - time[peak], across[first:last]
    if len(t) < 4:
        return float(across[peak])
    a, b, c = np.polyfit(t / (t[-1] - t[0]), y, 2)
    if a >= 0:
        return float(y.mean())
    at = float(np.clip(-b / (2 * a), t[0] / (t[-1] - t[0]), t[-1] / (t[-1] - t[0])))
    top = float(a * at * at + b * at + c)
    return float(across[peak]) if across[peak] > top + _SHARPER * noise else top
