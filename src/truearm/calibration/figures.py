"""Pictures and tables of a calibration: error budget, joint curves, simulated intervals, choice of the model, zones."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.calibration.parts import mdeg, name_of
from truearm.calibration.zones import ZoneChoice
from truearm.engine.base.errors import counted, listed
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.choosing.cross_validation import FOLDS
from truearm.engine.choosing.selection import Selection
from truearm.engine.choosing.zones import Box, shown_box
from truearm.engine.diagnose.curves import FittedCurve
from truearm.engine.diagnose.error_budget import ErrorBudget, Share, shown_shares
from truearm.engine.diagnose.simulated_calibrations import SimulatedCalibrations
from truearm.engine.document.document import Cell, Table
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    Figure,
    axis,
    decimals_of,
    figure,
    rounded,
    rounded_to,
    significant,
)
from truearm.engine.document.summaries import LAYOUT
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.parameters import PLACES
from truearm.engine.robot.robot import Robot

# What limits the accuracy, as a picture in which squares add up, and as rows of a table.
_NEGATIVE = "#b3261e"
#: Height of a bar with its gap, and of what stands around them.
_BAR = 34
_AROUND = 96


def budget_table(budget: ErrorBudget) -> Table:
    """Return a row for each source, and one for what they add up to."""
    rows = [
        (
            name_of(share),
            "–" if share.rms is None else _signed(share.rms * 1e3),
            "–" if share.square is None else _percent(share.square, budget.square),
            "–" if share.square is None else _squares(share.square, share.deviation),
            share.words,
        )
        for share in budget.shares
    ]
    subject = "all held-out readings together" if budget.held_out else "all together"
    words = "the uncertainty is that by the scatter of the configurations"
    rows.append((subject, significant(budget.rms * 1e3), "100 %", _squares(budget.square, budget.deviation), words))
    heading = ("source", "rms [mm]", "of the square", "square [mm²]", "how it is known")
    return Table(heading, rows, texts=(4,), name="budget", wide=True)


def budget_figure(budget: ErrorBudget) -> Figure:
    """Show squares from the first source to the last, each beginning where the one before ends, and their sum."""
    shares = shown_shares(budget.shares)
    return _stairs(shares, budget.square, "held out, together" if budget.held_out else "to expect, together")


def workspace_budget_figure(shares: Sequence[Share]) -> Figure:
    """Show likewise what the mean square to expect over the workspace is made of."""
    total = sum(share.square or 0.0 for share in shares)
    return _stairs(list(shares), total, "over the workspace, together")


def _stairs(shares: Sequence[Share], total: float, together: str) -> Figure:
    squares = np.array([share.square or 0.0 for share in shares]) * 1e6
    ends = np.cumsum(squares)
    begins = np.concatenate([ends - squares, [0.0]])
    lengths = np.concatenate([squares, [total * 1e6]])
    names = [*map(name_of, shares), together]
    roots = [_signed(float(np.sign(s) * np.sqrt(abs(s)))) for s in lengths]
    parts = [_percent(s, total * 1e6) for s in lengths.tolist()]
    trace = {
        "type": "bar",
        "orientation": "h",
        "y": names,
        "x": rounded(lengths, 5),
        "base": rounded(begins, 5),
        "text": [f"{root} mm ({part})" for root, part in zip(roots, parts, strict=True)],
        "textposition": "outside",
        "cliponaxis": False,
        "marker": {"color": [*(AFTER if s >= 0.0 else _NEGATIVE for s in squares), BEFORE], "line": {"width": 0}},
        "hovertemplate": "%{y}: %{text}<extra></extra>",
        "showlegend": False,
    }
    edges = np.concatenate([begins, begins + lengths])
    low, high = min(float(edges.min()), 0.0), float(edges.max())
    margin = 0.22 * max(high - low, 1e-12)
    return figure(
        [trace],
        _AROUND + _BAR * len(names),
        xaxis=axis("mean square [mm²]")
        | {"exponentformat": "none", "range": [low - (margin if low < 0.0 else 0.0), high + margin]},
        yaxis={**axis(""), "autorange": "reversed", "showgrid": False, "ticks": ""},
        bargap=0.3,
        margin={"l": 60, "r": 20, "t": 12, "b": 50},
    )


def _percent(square: float, total: float) -> str:
    text = f"{100.0 * square / total:.0f}" if total > 0.0 else "–"
    return f"{'0' if text == '-0' else text.replace('-', '−')} %"


def _signed(value: float) -> str:
    return f"−{significant(-value)}" if value < 0.0 else significant(value)


def _squares(square: float, deviation: float) -> str:
    sign = "−" if square < 0.0 else ""
    return f"{sign}{abs(square) * 1e6:.2g} ± {deviation * 1e6:.1g}" if deviation else f"{sign}{abs(square) * 1e6:.2g}"


# The curves of the joints, one picture a joint: millidegrees over the range of the joint, with their band of 95 %.
_BAND: Final = "#c3d5e3"
_UNMEASURED: Final = "#e4e6e8"
_PLACES: Final = "#646b72"
#: Width of an interval of 95 % to either side in standard deviations.
_NORMAL_95: Final = 1.959964
#: Beyond so many times the size of the measured part the picture ends, however wide the band.
_LARGEST_RATIO: Final = 4.0


def curve_name(curve: FittedCurve) -> str:
    """Return the name of the place of its picture."""
    return f"joint-curve-{curve.number}"


def curves_table(curves: Sequence[FittedCurve]) -> Table:
    """Return a row for each curve; its band is the median one where it was measured."""
    rows = []
    for curve in curves:
        groups = [f"{group.range} ({significant(mdeg(group.amplitude), 2, 1)} mdeg)" for group in curve.strongest]
        ranges = [f"{low:.0f} to {high:.0f}" for low, high in np.degrees(curve.measured).reshape(-1, 2).tolist()]
        inside = _measured(curve)
        half = _NORMAL_95 * np.median(curve.at(curve.angles[inside])[1]) if inside.any() else np.nan
        rows.append(
            (
                f"{curve.number}, {curve.name}",
                significant(mdeg(curve.rms), 2, 1),
                significant(mdeg(float(half)), 2, 1),
                ", ".join(groups),
                ", ".join(ranges) or "nowhere",
            )
        )
    heading = ("joint", "rms [mdeg]", "known to ± [mdeg]", "strongest periods in a turn", "measured [deg]")
    return Table(heading, rows, texts=(3, 4), name="curve-table", wide=True)


def curve_figure(curve: FittedCurve) -> Figure:
    """Show what a joint turns beyond its position, over its range; where nothing was measured the ground is grey."""
    value, deviation = (mdeg(1.0) * part for part in curve.at(curve.angles))
    low, high = value - _NORMAL_95 * deviation, value + _NORMAL_95 * deviation
    degrees = np.degrees(curve.angles)
    x = rounded_to(degrees, 2)
    inside = _measured(curve)
    shown = slice(None) if not inside.any() else inside
    ends = float(np.min(low[shown])), float(np.max(high[shown]))
    middle, half = sum(ends) / 2.0, max((ends[1] - ends[0]) / 2.0, 1e-3)
    bottom = max(float(low.min()), middle - _LARGEST_RATIO * half) - 0.16 * half
    top = min(float(high.max()), middle + _LARGEST_RATIO * half) + 0.08 * half
    spot: Figure = {"type": "scatter", "x": x, "hoverinfo": "skip", "showlegend": False}
    traces: list[Figure] = [
        spot | {"mode": "lines", "y": rounded_to(low, 3), "line": {"width": 0, "color": _BAND}},
        spot
        | {
            "mode": "lines",
            "name": "95 % band",
            "y": rounded_to(high, 3),
            "line": {"width": 0, "color": _BAND},
            "fill": "tonexty",
            "fillcolor": _BAND,
            "showlegend": True,
        },
        {
            "type": "scatter",
            "mode": "lines",
            "name": "curve",
            "x": x,
            "y": rounded_to(value, 3),
            "customdata": rounded_to(_NORMAL_95 * deviation, 2),
            "line": {"color": AFTER, "width": 1.5},
            "hovertemplate": "%{x:.1f} deg: %{y:.2f} mdeg, good to %{customdata:.2f} mdeg<extra></extra>",
        },
        {
            "type": "scatter",
            "mode": "markers",
            "name": "training configurations",
            "x": rounded_to(np.degrees(curve.places), 2),
            "y": [bottom + 0.05 * (top - bottom)] * len(curve.places),
            "marker": {"symbol": "line-ns", "size": 7, "color": _PLACES, "line": {"color": _PLACES, "width": 1}},
            "hovertemplate": "measured at %{x:.1f} deg<extra></extra>",
        },
    ]
    ground = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "layer": "below", "line": {"width": 0}}
    start, end = (round(float(v), 2) for v in (degrees[0], degrees[-1]))
    return figure(
        traces,
        250,
        xaxis={**axis(f"joint {curve.number} [deg]"), "range": [start, end]},
        yaxis={**axis("curve [mdeg]"), "range": [bottom, top]},
        legend={"orientation": "h", "x": 0, "y": 1.02, "xanchor": "left", "yanchor": "bottom", "traceorder": "normal"},
        shapes=[
            ground | {"x0": round(a, 2), "x1": round(b, 2), "fillcolor": _UNMEASURED}
            for a, b in _gaps(np.degrees(curve.measured).reshape(-1, 2), start, end)
        ],
    )


def _measured(curve: FittedCurve) -> Array:
    """Return at which of its angles a curve was measured."""
    inside = np.zeros(len(curve.angles), dtype=bool)
    for low, high in curve.measured:
        inside |= (curve.angles >= low) & (curve.angles <= high)
    return inside


def _gaps(measured: Array, start: float, end: float) -> list[tuple[float, float]]:
    """Return what lies between the measured ranges."""
    edges = [start, *measured.reshape(-1).tolist(), end]
    return [(a, b) for a, b in zip(edges[0::2], edges[1::2], strict=True) if b - a > 1e-6]


# Intervals by Monte Carlo beside the linear ones: how often these hold, as a picture, and both as rows of a table.

#: What the intervals are made to hold.
_CLAIMED = 0.95


def intervals_table(simulated: SimulatedCalibrations, robot: Robot) -> Table:
    """Return a row for each parameter that was free, in the order of the fit, but for terms of joint curves."""
    rows = []
    for i, name in enumerate(simulated.names):
        if robot.parameters[name].group == JointCurve.name:
            continue
        unit = SHOWN_AS[robot.parameters[name].unit]
        linear, deviation = (from_si(float(d[i]), unit) for d in (simulated.linear_deviation, simulated.deviation))
        places = decimals_of(deviation, 6)
        of_linear, of_trials = (
            " to ".join(f"{from_si(end, unit):.{places}f}" for end in interval[i].tolist())
            for interval in (simulated.linear_interval_95, simulated.interval_95)
        )
        deviations = (significant(linear, 2, 6), significant(deviation, 2, 6))
        coverage = f"{100.0 * float(simulated.coverage[i]):.1f} %"
        rows.append((Cell(name, code=True), unit, of_linear, of_trials, *deviations, coverage))
    heading = ("parameter", "unit", "linear", "by Monte Carlo", "deviation, linear", "by Monte Carlo")
    return Table((*heading, "linear interval held"), rows, texts=(1,), name="intervals", wide=True)


def coverage_figure(simulated: SimulatedCalibrations, robot: Robot) -> Figure:
    """Show the share of trials in which the linear interval of each of the arm's parameters held the truth.

    Between the dotted lines lie 95 of 100 shares of so many trials, if the intervals hold 95 % of the truths.
    """
    beside = (*PLACES, JointCurve.name)
    own = [i for i, name in enumerate(simulated.names) if robot.parameters[name].group not in beside]
    own = own or list(range(len(simulated.names)))
    shares = 100.0 * simulated.coverage[own]
    ratio = simulated.deviation[own] / np.where(
        simulated.linear_deviation[own] > 0.0, simulated.linear_deviation[own], np.nan
    )
    band = 196.0 * math.sqrt(_CLAIMED * (1.0 - _CLAIMED) / max(simulated.settled, 1))
    trace = {
        "type": "scatter",
        "mode": "markers",
        "x": [html.escape(simulated.names[i]) for i in own],
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


# How a model was chosen: what every joint effect gains, as a picture and as rows.

#: Gains are drawn in proportion up to this at least [mm].
_SMALLEST: Final = 1e-4


def choice_sentence(selection: Selection) -> str:
    """Return how the choice was made, in words."""
    held_out = (
        f"{counted(selection.blocks, 'block')} of neighbours, because the configurations {LAYOUT[selection.layout]}"
        if selection.blocks
        else "configurations drawn one by one"
    )
    elastic = "" if selection.elastic is None else f", that of the elastic model {selection.elastic * 1e3:.4f} mm"
    return (
        f"By {FOLDS}-fold cross-validation on the training configurations alone, holding out {held_out}. The mean "
        f"error of the geometric model there is {selection.geometric * 1e3:.4f} mm{elastic}, that of the chosen model "
        f"{selection.error * 1e3:.4f} mm. Errors of every choice follow in closed form from one fit; of those that are "
        "not worse than the best one by a standard error, the one with the fewest parameters was taken. Gains are "
        "those over the chosen model without the effect, or what it would gain with it. A fold trains on four fifths "
        "of the configurations, and what is chosen looked best in these folds; the error of held-out readings may be "
        "smaller or larger than the one here: believe the held-out one."
    )


def candidates_table(selection: Selection) -> Table:
    """Return a row for every joint effect that could be chosen."""
    rows = [
        (
            candidate.effect,
            "–" if candidate.gain is None else f"{candidate.gain.mean * 1e3:+.4f}",
            "–" if candidate.gain is None else f"{candidate.gain.error * 1e3:.4f}",
            "taken" if candidate.taken else f"left out: {candidate.reason}",
        )
        for candidate in selection.candidates
    ]
    taken = tuple("taken" if candidate.taken else "" for candidate in selection.candidates)
    heading = ("joint effect", "gain [mm]", "standard error [mm]", "")
    return Table(heading, rows, texts=(3,), name="selection", wide=True, marks=taken)


def confirmations_table(selection: Selection) -> Table:
    """Return a row for every model that was fitted in the folds."""
    rows = [
        (
            listed(confirmation.effects) or "geometric",
            f"{confirmation.error * 1e3:.4f}",
            listed(confirmation.smaller) or "geometric",
            f"{confirmation.smaller_error * 1e3:.4f}",
            f"{confirmation.gain.mean * 1e3:+.4f}",
            f"{confirmation.gain.error * 1e3:.4f}",
        )
        for confirmation in selection.confirmations
    ]
    heading = ("model", "error [mm]", "instead of", "error [mm]", "gain [mm]", "standard error [mm]")
    return Table(heading, rows, texts=(2,), name="confirmations", wide=True)


def candidates_figure(selection: Selection) -> Figure:
    """Show what every joint effect that was tried gains, with its standard error.

    The axis is linear near no gain and logarithmic beyond, so that what little effects gain is seen beside a large one.
    """
    tried = [candidate for candidate in reversed(selection.candidates) if candidate.gain is not None]
    errors = [
        1e3 * candidate.gain.error for candidate in tried if candidate.gain is not None and candidate.gain.error > 0.0
    ]
    linear = max(float(np.median(errors)) if errors else 0.0, _SMALLEST)
    ends: list[float] = [linear]
    traces = []
    for taken, name, colour in ((True, "taken", AFTER), (False, "left out", BEFORE)):
        of_kind = [candidate for candidate in tried if candidate.taken is taken]
        gains = np.array([1e3 * candidate.gain.mean for candidate in of_kind if candidate.gain is not None])
        error = np.array([1e3 * candidate.gain.error for candidate in of_kind if candidate.gain is not None])
        place = _on_axis(gains, linear)
        above, below = _on_axis(gains + error, linear), _on_axis(gains - error, linear)
        ends += [*(gains + error).tolist(), *(gains - error).tolist()]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": name,
                "y": [html.escape(candidate.effect) for candidate in of_kind],
                "x": rounded(place, 4),
                "customdata": rounded(gains, 4),
                "error_x": {
                    "type": "data",
                    "symmetric": False,
                    "array": rounded(above - place, 4),
                    "arrayminus": rounded(place - below, 4),
                },
                "marker": {"color": colour, "line": {"width": 0}},
                "hovertemplate": "%{y}: gains %{customdata} mm<extra></extra>",
            }
        )
    low, high = min(min(ends), -linear), max(max(ends), linear)
    left, right = _on_axis(np.array([low, high]), linear).tolist()
    margin = 0.2 * (right - left)
    marks = [0.0, *(sign * 10.0**power for power in range(-5, 3) for sign in (-1.0, 1.0))]
    marks = sorted(mark for mark in marks if low <= mark <= high and (mark == 0.0 or abs(mark) >= 0.5 * linear))
    labels = [
        {
            "x": 1.0,
            "xref": "paper",
            "y": html.escape(candidate.effect),
            "text": f"{candidate.gain.mean * 1e3:+.4f} ± {candidate.gain.error * 1e3:.4f}",
            "xanchor": "right",
            "showarrow": False,
            "font": {"size": 11},
        }
        for candidate in tried
        if candidate.gain is not None
    ]
    return figure(
        traces,
        120 + 26 * len(tried),
        xaxis={
            **axis("gain of the mean held-out error [mm], logarithmic beyond its usual standard error"),
            "range": [left - 0.02 * (right - left), right + margin],
            "tickvals": rounded(_on_axis(np.array(marks), linear), 4),
            "ticktext": [f"{mark:g}" for mark in marks],
        },
        yaxis={**axis(""), "type": "category", "categoryorder": "array", "categoryarray": [o.effect for o in tried]},
        margin={"l": 160, "r": 16, "t": 16, "b": 48},
        annotations=labels,
    )


def _on_axis(gain: Array, linear: float) -> Array:
    """Return where gains [mm] are drawn: in proportion up to about `linear`, by their logarithm beyond."""
    return np.asarray(np.sign(gain) * np.log10(1.0 + np.abs(gain) / linear))


def zones_table(choice: ZoneChoice) -> Table:
    """Return a row for each zone that was tried."""
    rows = [
        (
            verdict.box.name,
            box_words(verdict.box),
            str(verdict.training),
            str(verdict.held_out),
            _mm(verdict.whole),
            _mm(verdict.zone),
            _mm(verdict.error),
            f"{'kept' if verdict.kept else 'not kept'}: {verdict.why}",
        )
        for verdict in choice.verdicts
    ]
    marks = tuple("taken" if verdict.kept else "" for verdict in choice.verdicts)
    heading = ("zone", "x, y, z of the flange [mm]", "training", "held out", "one model [mm]", "own model [mm]")
    more = ("difference good to", "verdict")
    return Table((*heading, *more), rows, texts=(1, 7), name="zone-table", wide=True, marks=marks)


def _mm(value: float | None) -> str:
    return "–" if value is None else significant(value * 1e3)


def box_words(box: Box) -> str:
    """Return the limits of a box in words."""
    words = []
    for letter, ends in shown_box(box).items():
        low, high = (None if end is None else round(end) for end in ends)
        if low is None:
            words.append(f"{letter} below {high}")
        elif high is None:
            words.append(f"{letter} from {low}")
        else:
            words.append(f"{letter} {low} to {high}")
    return ", ".join(words)


def zones_figure(choice: ZoneChoice) -> Figure:
    """Show the mean held-out error of each zone with one model and with its own; what is not kept is faint."""
    judged = [verdict for verdict in choice.verdicts if verdict.whole is not None and verdict.zone is not None]
    names = [html.escape(f"{verdict.box.name}{'' if verdict.kept else ' (not kept)'}") for verdict in judged]
    error = rounded(np.array([(verdict.error or 0.0) * 1e3 for verdict in judged]), 3)
    traces = [
        {
            "type": "bar",
            "name": name,
            "x": names,
            "y": rounded(np.array([(value or 0.0) * 1e3 for value in values]), 4),
            "marker": {"color": colour, "line": {"width": 0}, "opacity": [1.0 if v.kept else 0.45 for v in judged]},
            "hovertemplate": f"%{{x}}: %{{y}} mm, {name}<extra></extra>",
            **bars,
        }
        for name, values, colour, bars in (
            ("one model for the whole", [v.whole for v in judged], BEFORE, {}),
            (
                "a model of its own, with the standard error of the difference",
                [v.zone for v in judged],
                AFTER,
                {"error_y": {"type": "data", "array": error, "thickness": 1.2, "width": 4}},
            ),
        )
    ]
    return figure(
        traces,
        340,
        xaxis={**axis("zone"), "type": "category"},
        yaxis=axis("mean held-out error [mm]") | {"rangemode": "tozero"},
        barmode="group",
    )
