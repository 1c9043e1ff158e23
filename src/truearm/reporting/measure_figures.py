"""Pictures of a plan that is measured: how the nests move, and how the readings were taken."""

from __future__ import annotations

import html
from typing import Final

import numpy as np

from truearm.measurement.measuring.nest_drift import nest_drift
from truearm.measurement.measuring.session import Session
from truearm.modeling.chain import Array
from truearm.reporting.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure
from truearm.reporting.numbers import rounded_to

_HEIGHT: Final = 340
_TOGETHER: Final = "#2b2f33"


def drift_figure(session: Session) -> Figure | None:
    """Return how far the nests are from where they were first, over time; None before one was read."""
    drift = nest_drift(session)
    if drift is None:
        return None
    minutes = rounded_to(drift.time / 60.0, 3)
    traces = [
        _line(name, minutes, distance, COLOURS[number % len(COLOURS)], "dot")
        for number, (name, distance) in enumerate(zip(drift.names, drift.distance, strict=True))
    ]
    traces.append(_line("together", minutes, np.sqrt((drift.common**2).sum(axis=1)), _TOGETHER, "solid"))
    return figure(traces, _HEIGHT, xaxis=axis("time since the nests were read first [min]"), yaxis=axis("moved [mm]"))


def quality_figure(session: Session) -> Figure | None:
    """Return the scatter within the dwell of each reading, in the order of measuring; None where none tells it."""
    drawn = session.drawn()
    known = np.isfinite(drawn.deviation)
    if not known.any():
        return None
    number = np.arange(1, len(drawn.names) + 1)
    traces = []
    for kept, name, colour, symbol in ((True, "kept", AFTER, "circle"), (False, "set aside", COLOURS[0], "x")):
        chosen = np.flatnonzero(known & (drawn.kept == kept))
        if len(chosen):
            words = [
                html.escape(f"{drawn.labels[k]} {drawn.names[k]}{f', {drawn.reasons[k]}' if drawn.reasons[k] else ''}")
                for k in chosen.tolist()
            ]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": name,
                    "x": number[chosen].tolist(),
                    "y": rounded_to(drawn.deviation[chosen] * 1e3, 5),
                    "text": words,
                    "marker": {"color": colour, "size": 6, "symbol": symbol},
                    "hovertemplate": "%{text}: %{y:.4f} mm<extra></extra>",
                }
            )
    if (most := session.quality.deviation) is not None:
        ends = [1, len(drawn.names)]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": "allowed",
                "x": ends,
                "y": [most * 1e3] * 2,
                "line": {"color": BEFORE, "width": 1.2, "dash": "dash"},
                "hoverinfo": "skip",
            }
        )
    return figure(traces, _HEIGHT, xaxis=axis("reading"), yaxis=axis("deviation of a sample [mm]"))


def _line(name: str, x: list[float], distance: Array, colour: str, dash: str) -> Figure:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": html.escape(name),
        "x": x,
        "y": [None if np.isnan(value) else round(value * 1e3, 5) for value in distance.tolist()],
        "line": {"color": colour, "width": 1.4, "dash": dash},
        "marker": {"color": colour, "size": 5},
        "hovertemplate": f"{html.escape(name)}, %{{x:.1f}} min: %{{y:.4f}} mm<extra></extra>",
    }
