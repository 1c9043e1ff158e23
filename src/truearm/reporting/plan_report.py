"""What a plan of measurements is good for: one HTML file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.notices import worst_first
from truearm.reporting.drawing import AFTER, BEFORE, CAMERA, Figure, axis, base_axes, figure, scene_axis
from truearm.reporting.numbers import rounded, rounded_to
from truearm.reporting.page import page

if TYPE_CHECKING:
    from truearm.planning.choosing.measurement_plan import MeasurementPlan
    from truearm.planning.choosing.prediction import Prediction
    from truearm.results.plan import Plan

_INDEX_WORDS: Final = {
    "O1": "geometric mean of the singular values, per square root of the poses",
    "O2": "smallest by largest singular value",
    "O3": "smallest singular value",
    "O4": "noise amplification: smallest squared by largest",
    "O5": "inverse of the sum of the inverse singular values",
}


def plan_html(planned: Plan) -> str:
    """Return the page of a plan."""
    plan = planned.made
    figures = {"number": number_figure(plan.prediction, len(plan.joints)), "workspace": workspace_figure(plan)}
    return page(
        "plan.html.jinja",
        figures,
        planned,
        plan=plan,
        chosen_by=planned.chosen_by,
        command=planned.command,
        words=(*planned.answer, *planned.driving),
        notices=worst_first(planned.warnings),
        indices=[(name, _INDEX_WORDS[name], f"{value:.4g}") for name, value in plan.indices.items()],
    )


def number_figure(prediction: Prediction, planned: int) -> Figure:
    """Show how the predicted error falls with the number of poses."""
    numbers = prediction.numbers.tolist()
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "x": numbers,
            "y": rounded(1e3 * errors, 4),
            "line": {"color": colour, "width": 2},
        }
        for name, errors, colour in (
            ("drawn at random", prediction.random, BEFORE),
            ("chosen", prediction.chosen, AFTER),
        )
    ]
    traces.append(
        {
            "type": "scatter",
            "mode": "markers",
            "name": "this plan",
            "x": [planned],
            "y": rounded(np.array([1e3 * prediction.planned]), 4),
            "marker": {"color": "#b3261e", "size": 10, "symbol": "diamond"},
        }
    )
    line = {"type": "line", "x0": 0, "x1": 1, "xref": "paper", "line": {"dash": "dot", "color": "#646b72"}}
    shapes = [line | {"y0": 1e3 * prediction.floor, "y1": 1e3 * prediction.floor}]
    highest = 1e3 * max([2.0 * prediction.floor, prediction.planned * 1.05])
    return figure(
        traces,
        420,
        xaxis=axis("poses") | {"rangemode": "tozero"},
        yaxis=axis("mean error of other readings [mm]") | {"range": [0.9e3 * prediction.floor, highest]},
        shapes=shapes,
    )


def workspace_figure(plan: MeasurementPlan) -> Figure:
    """Show where in the workspace the calibrated model will be good: its own error, without the noise of a reading."""
    prediction = plan.prediction
    base = plan.robot.base
    points = 1e3 * (prediction.places - np.array(base.translation)) @ base.rotation
    errors = rounded(1e3 * prediction.error, 3)
    trace = {
        "type": "scatter3d",
        "mode": "markers",
        **{letter: rounded_to(column, 1) for letter, column in zip("xyz", points.T, strict=True)},
        "marker": {
            "size": 4,
            "color": errors,
            "colorscale": "Viridis",
            "reversescale": True,
            "colorbar": {"title": {"text": "mm"}, "thickness": 14},
        },
        "customdata": errors,
        "hovertemplate": "flange at %{x}, %{y}, %{z} mm: %{customdata} mm<extra></extra>",
        "showlegend": False,
    }
    traces = [trace]
    if prediction.there is not None:
        there = 1e3 * (prediction.there.places - np.array(base.translation)) @ base.rotation
        trace["name"] = "elsewhere"
        traces.append(
            trace
            | {letter: rounded_to(column, 1) for letter, column in zip("xyz", there.T, strict=True)}
            | {
                "name": "where it shall be accurate",
                "marker": {"size": 5, "color": "#b3261e", "symbol": "diamond"},
                "customdata": rounded(1e3 * prediction.there.error, 3),
                "showlegend": True,
            }
        )
    length = float(10.0 ** math.floor(math.log10(max(float(np.abs(points).max()), 1.0) / 2.0)))
    axes = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    return figure([*traces, *base_axes(length)], 620, scene={**axes, "aspectmode": "data", "camera": CAMERA})
