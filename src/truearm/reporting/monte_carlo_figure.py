"""Intervals by Monte Carlo beside the linear ones: how often these hold, as a picture, and both as rows of a table."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass

import numpy as np

from truearm.identification.judging.simulated_calibrations import SimulatedCalibrations
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.parameters import PLACES
from truearm.modeling.robot import Robot
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import decimals_of, rounded, significant
from truearm.units import SHOWN_AS, from_si

#: What the intervals are made to hold.
_CLAIMED = 0.95


@dataclass(frozen=True)
class IntervalRow:
    """One parameter: its intervals of 95 % and its deviations, by Monte Carlo and by the covariance, as printed."""

    name: str
    unit: str
    linear: str
    simulated: str
    linear_deviation: str
    deviation: str
    coverage: str


def interval_rows(found: SimulatedCalibrations, robot: Robot) -> tuple[IntervalRow, ...]:
    """Return a row for each parameter that was free, in the order of the fit, but for terms of joint curves."""
    rows = []
    for i, name in enumerate(found.names):
        if robot.parameters[name].group == JointCurve.name:
            continue
        unit = SHOWN_AS[robot.parameters[name].unit]
        linear, deviation = (from_si(float(d[i]), unit) for d in (found.linear_deviation, found.deviation))
        places = decimals_of(deviation, 6)
        of_linear, of_trials = (
            " to ".join(f"{from_si(end, unit):.{places}f}" for end in interval[i].tolist())
            for interval in (found.linear_interval_95, found.interval_95)
        )
        rows.append(
            IntervalRow(
                name,
                unit,
                of_linear,
                of_trials,
                significant(linear, 2, 6),
                significant(deviation, 2, 6),
                f"{100.0 * float(found.coverage[i]):.1f} %",
            )
        )
    return tuple(rows)


def coverage_figure(found: SimulatedCalibrations, robot: Robot) -> Figure:
    """Show the share of trials in which the linear interval of each of the arm's parameters held the truth.

    Between the dotted lines lie 95 of 100 shares of so many trials, if the intervals hold 95 % of the truths.
    """
    beside = (*PLACES, JointCurve.name)
    own = [i for i, name in enumerate(found.names) if robot.parameters[name].group not in beside]
    own = own or list(range(len(found.names)))
    shares = 100.0 * found.coverage[own]
    ratio = found.deviation[own] / np.where(found.linear_deviation[own] > 0.0, found.linear_deviation[own], np.nan)
    band = 196.0 * math.sqrt(_CLAIMED * (1.0 - _CLAIMED) / max(found.settled, 1))
    trace = {
        "type": "scatter",
        "mode": "markers",
        "x": [html.escape(found.names[i]) for i in own],
        "y": rounded(shares, 4),
        "customdata": ["–" if np.isnan(r) else f"{r:.2f}" for r in ratio.tolist()],
        "marker": {"color": AFTER, "size": 7},
        "hovertemplate": "%{x}: held in %{y} % of the trials, deviation %{customdata} times the linear one"
        "<extra></extra>",
        "showlegend": False,
    }
    line = {"type": "line", "x0": 0, "x1": 1, "xref": "paper"}
    shapes = [
        line | {"y0": y, "y1": y, "line": {"color": BEFORE, "width": 1.5, "dash": dash}}
        for y, dash in ((100.0 * _CLAIMED, "solid"), (100.0 * _CLAIMED - band, "dot"), (100.0 * _CLAIMED + band, "dot"))
    ]
    low = min(float(shares.min()), 100.0 * _CLAIMED - band) - 1.0
    high = min(max(float(shares.max()), 100.0 * _CLAIMED + band) + 1.0, 101.0)
    return figure(
        [trace],
        340,
        xaxis={**axis(""), "tickangle": -60, "type": "category"},
        yaxis={**axis("held the truth [%]"), "range": [low, high]},
        shapes=shapes,
    )
