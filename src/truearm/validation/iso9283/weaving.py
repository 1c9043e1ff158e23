"""Weaving deviations WS and WF: relative errors of stroke and frequency.

WS is the attained stroke minus the commanded one over the commanded one; WF the same of the frequency, whose command is
the commanded velocity over the wavelength (the issue's table; the standard's text was not at hand).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

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
#: Turns on a side are read from so many samples about the outermost.
_ABOUT = 2
#: Fewer samples in a period do not show how far it goes.
_LEAST_SAMPLES = 20
#: Whole periods that a cycle must have.
_LEAST_PERIODS = 2


@dataclass(frozen=True, eq=False)
class WeaveCurves:
    """A weave, for pictures.

    Attributes
    ----------
    path
        Its name.
    run
        What it comes from.
    along, across
        Of each cycle: arc length on the line in the middle, and to the side [m].
    time
        Of each cycle [s].
    stroke, frequency
        Of each cycle [m], [Hz], ``(cycles,)``.
    """

    path: str
    run: Run
    along: tuple[Array, ...]
    across: tuple[Array, ...]
    time: tuple[Array, ...]
    stroke: Array
    frequency: Array


def weaving_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[WeaveCurves]]:
    """Return WS and WF of every weave and condition, the mean of the cycles with their range, and the curves.

    Raises
    ------
    InputError
        If a cycle has fewer than two whole periods.
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
        peak = first + int((sign * across[first : final + 1]).argmax())
        outermost[sign].append(_top(time, sign * across, peak))
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


def _top(time: Array, across: Array, peak: int) -> float:
    """Return the largest value of a parabola through the samples about the largest, or that sample if it is larger.

    The parabola finds the top between two samples; the sample that of a turn so sharp that no parabola fits it.
    """
    first, last = max(peak - _ABOUT, 0), min(peak + _ABOUT + 1, len(time))
    t, y = time[first:last] - time[peak], across[first:last]
    if len(t) < 4:
        return float(across[peak])
    a, b, c = np.polyfit(t / (t[-1] - t[0]), y, 2)
    if a >= 0:
        return float(y.mean())
    at = float(np.clip(-b / (2 * a), t[0] / (t[-1] - t[0]), t[-1] / (t[-1] - t[0])))
    return max(float(a * at * at + b * at + c), float(across[peak]))
