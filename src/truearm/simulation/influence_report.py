"""What each parameter does to the tip, and what identification by it is worth: one HTML file."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truearm.engine.base.errors import worst_first
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded, rounded_to, significant
from truearm.engine.document.page import page
from truearm.simulation.influences import WAYS, Influence

if TYPE_CHECKING:
    from truearm.simulation.influence import Identified, InfluenceResult


# What parameters do to the tip, as a picture (Patel, figure 3.8).


def influence_figure(influence: Influence) -> Figure:
    """Show the average influence of each parameter, with its range over the configurations."""
    mean, least, greatest = (1e3 * sizes for sizes in (influence.mean, influence.least, influence.greatest))
    shown = [rounded(sizes, 4) for sizes in (least, greatest, 1e3 * np.median(influence.size, axis=1))]
    trace = {
        "type": "bar",
        "name": "average, with the range over the configurations",
        "x": [html.escape(name) for name in influence.names],
        "y": rounded(mean, 4),
        "error_y": {
            "type": "data",
            "symmetric": False,
            "array": rounded(np.maximum(greatest - mean, 0.0), 4),
            "arrayminus": rounded(np.maximum(mean - least, 0.0), 4),
            "thickness": 1.2,
            "width": 4,
        },
        "customdata": [list(row) for row in zip(*shown, strict=True)],
        "marker": {"color": AFTER, "line": {"width": 0}},
        "opacity": 0.75,
        "hovertemplate": "%{x}: average %{y} mm, %{customdata[0]} to %{customdata[1]} mm, "
        "median %{customdata[2]} mm<extra></extra>",
    }
    return figure(
        [trace],
        400,
        xaxis={**axis("parameter"), "tickangle": -60, "type": "category"},
        yaxis={**axis("the tip moves by [mm]"), "rangemode": "tozero"},
        showlegend=True,
    )


#: Configurations in the picture pose by pose: more are not told apart.
_SHOWN = 400
_COLOURS = (BEFORE, "#8a6d1d", "#b3261e", AFTER, "#3b7d3b")


def influence_html(found: InfluenceResult) -> str:
    """Return the page."""
    figures = {"influence": influence_figure(found.made), "map": map_figure(found)}
    spread: list[dict[str, Any]] = []
    if found.identified is not None:
        figures["errors"] = errors_figure(found.identified)
        spread = [
            {"words": WAYS[way], "figures": [significant(v * 1e3, 3) for v in (s.mean, s.rms, s.p95, s.max)]}
            for way, errors in found.identified.errors.items()
            if (s := errors.position) is not None
        ]
    return page(
        Path(__file__).with_name("influence.html.jinja"),
        figures,
        found,
        found=found,
        rows=[
            row
            | {
                "texts": {key: significant(row[key], 3, 5) for key in row if key.endswith(("_mm", "_deg"))},
                "by": significant(row["change"], 3, 6),
            }
            for row in found.rows()
        ],
        parameters=[_texts(row) for row in found.found()],
        ways=WAYS,
        spread=spread,
        notices=worst_first(found.notices),
    )


def _texts(row: dict[str, Any]) -> dict[str, Any]:
    return row | {
        "texts": {way: f"{round(row[way], 4) + 0.0:.4f}" for way in WAYS},
        "known": significant(row["deviation"] or 0.0, 2, 6),
    }


def map_figure(found: InfluenceResult) -> Figure:
    """Show the influence of each parameter at each configuration, the most influential at the top."""
    order = np.argsort(found.made.mean, kind="stable")
    kept = np.unique(np.linspace(0, len(found.labels) - 1, min(len(found.labels), _SHOWN)).round().astype(int))
    trace = {
        "type": "heatmap",
        "x": [html.escape(found.labels[at]) for at in kept.tolist()],
        "y": [html.escape(found.made.names[index]) for index in order.tolist()],
        "z": [rounded_to(1e3 * found.made.size[index, kept], 4) for index in order.tolist()],
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": "mm"}, "thickness": 14},
        "hovertemplate": "%{y} at configuration %{x}: %{z} mm<extra></extra>",
    }
    return figure(
        [trace],
        max(320, 70 + 17 * len(order)),
        xaxis=axis("configuration") | {"type": "category"},
        yaxis=axis("") | {"type": "category", "dtick": 1},
    )


def errors_figure(found: Identified) -> Figure:
    """Show what each way to identify leaves: mean error, with the 95 % below which errors are."""
    spreads = {way: errors.position for way, errors in found.errors.items() if errors.position is not None}
    means = np.array([spread.mean for spread in spreads.values()]) * 1e3
    p95 = np.array([spread.p95 for spread in spreads.values()]) * 1e3
    trace = {
        "type": "bar",
        "x": [WAYS[way] for way in spreads],
        "y": rounded(means, 4),
        "customdata": rounded(p95, 4),
        "error_y": {
            "type": "data",
            "symmetric": False,
            "array": rounded(p95 - means, 4),
            "arrayminus": [0.0] * len(means),
        },
        "marker": {"color": list(_COLOURS[: len(means)]), "line": {"width": 0}},
        "hovertemplate": "%{x}: mean %{y} mm, 95 % below %{customdata} mm<extra></extra>",
    }
    return figure(
        [trace], 380, xaxis=axis("") | {"type": "category"}, yaxis=axis("position error [mm]") | {"rangemode": "tozero"}
    )
