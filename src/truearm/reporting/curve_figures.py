"""The curves of the joints, one picture a joint: millidegrees over the range of the joint, with their band of 95 %."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.judging.found_curves import FoundCurve
from truearm.modeling.chain import Array
from truearm.reporting.drawing import AFTER, Figure, axis, figure
from truearm.reporting.numbers import rounded_to, significant
from truearm.results.curves import mdeg

_BAND: Final = "#c3d5e3"
_UNMEASURED: Final = "#e4e6e8"
_PLACES: Final = "#646b72"
_INK: Final = "#2b2f33"
#: Width of an interval of 95 % to either side in standard deviations.
_NORMAL_95: Final = 1.959964
#: Beyond so many times the size of the measured part the picture ends, however wide the band.
_ROOM: Final = 4.0


@dataclass(frozen=True)
class CurveRow:
    """One joint's curve as it is printed."""

    joint: str
    rms: str
    band: str
    strongest: str
    measured: str


def curve_name(curve: FoundCurve) -> str:
    """Return the name of the place of its picture."""
    return f"joint-curve-{curve.number}"


def curve_rows(curves: Sequence[FoundCurve]) -> tuple[CurveRow, ...]:
    """Return a row for each curve; its band is the median one where it was measured."""
    rows = []
    for curve in curves:
        groups = [f"{one.range} ({significant(mdeg(one.amplitude), 2, 1)} mdeg)" for one in curve.strongest]
        ranges = [f"{low:.0f} to {high:.0f}" for low, high in np.degrees(curve.measured).reshape(-1, 2).tolist()]
        inside = _measured(curve)
        half = _NORMAL_95 * np.median(curve.at(curve.angles[inside])[1]) if inside.any() else np.nan
        rows.append(
            CurveRow(
                f"{curve.number}, {curve.name}",
                significant(mdeg(curve.rms), 2, 1),
                significant(mdeg(float(half)), 2, 1),
                ", ".join(groups),
                ", ".join(ranges) or "nowhere",
            )
        )
    return tuple(rows)


def curve_figure(curve: FoundCurve) -> Figure:
    """Show what a joint turns beyond its position, over its range; where nothing was measured the ground is grey."""
    value, deviation = (mdeg(1.0) * part for part in curve.at(curve.angles))
    low, high = value - _NORMAL_95 * deviation, value + _NORMAL_95 * deviation
    degrees = np.degrees(curve.angles)
    x = rounded_to(degrees, 2)
    inside = _measured(curve)
    here = slice(None) if not inside.any() else inside
    ends = float(np.min(low[here])), float(np.max(high[here]))
    middle, half = sum(ends) / 2.0, max((ends[1] - ends[0]) / 2.0, 1e-3)
    bottom = max(float(low.min()), middle - _ROOM * half) - 0.16 * half
    top = min(float(high.max()), middle + _ROOM * half) + 0.08 * half
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


def _measured(curve: FoundCurve) -> Array:
    """Return at which of its angles a curve was measured."""
    inside = np.zeros(len(curve.angles), dtype=bool)
    for low, high in curve.measured:
        inside |= (curve.angles >= low) & (curve.angles <= high)
    return inside


def _gaps(measured: Array, start: float, end: float) -> list[tuple[float, float]]:
    """Return what lies between the measured ranges."""
    edges = [start, *measured.reshape(-1).tolist(), end]
    return [(a, b) for a, b in zip(edges[0::2], edges[1::2], strict=True) if b - a > 1e-6]
