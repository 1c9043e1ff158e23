"""The course of a fit as a picture: its cost and the error on what judges it, step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from truearm.calibration.calibrating import FitStep
from truearm.engine.document.drawing import AFTER, BEFORE, axis, figure, logarithmic_axis

#: Axes go beyond the values by this factor.
_ROOM: Final = 1.2


def fit_course(steps: Sequence[FitStep]) -> dict[str, Any]:
    """Return the picture of the steps of a fit, the cost above the error; both axes are logarithmic."""
    numbers = [step.number for step in steps]

    def line(name: str, values: list[float], colour: str, row: str) -> dict[str, Any]:
        return {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "x": numbers,
            "y": values,
            "line": {"color": colour, "width": 2},
            "marker": {"size": 5},
            "yaxis": row,
        }

    drawn = [
        line("cost", [step.cost for step in steps], BEFORE, "y2"),
        line("error", [step.error * 1e3 for step in steps], AFTER, "y"),
    ]
    cost, error = ([value for value in line["y"] if 0.0 < value < math.inf] or [1.0] for line in drawn)
    return figure(
        drawn,
        420,
        xaxis=axis("step (each round weighs the cost anew)"),
        yaxis=_above("error [mm]", error, [0.0, 0.46]),
        yaxis2=_above("cost", cost, [0.54, 1.0]),
    )


def _above(title: str, values: Sequence[float], share: list[float]) -> dict[str, Any]:
    """Return the logarithmic axis of some values, on a share of the height."""
    low, high = min(values) / _ROOM, max(values) * _ROOM
    return {
        **logarithmic_axis("", low, high),
        "range": [math.log10(low), math.log10(high)],
        "title": {"text": title},
        "domain": share,
    }
