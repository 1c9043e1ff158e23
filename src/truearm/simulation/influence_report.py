"""What each parameter does to the tip, and what identification by it is worth: one HTML file."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np

from truearm.engine.document.document import Cell, Document, Lead, Picture, Section, Table, Words, pictured, warned
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded, rounded_to, significant
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


def influence_html(result: InfluenceResult) -> str:
    """Return the page."""
    rows, tip = result.rows(), result.tip
    first = rows[0]
    moves = (
        f"On average {tip} moves so far if `{first['name']}`, the most influential parameter, is off by "
        f"{significant(first['change'], 3, 6)} {first['unit']}."
    )
    by_pose = (
        f"How far the same change moves {tip} at each configuration. The influence of angles depends on the posture, "
        "that of lengths hardly does."
    )
    lead = Lead([Words(moves)], now=significant(first["mean_mm"], 3, 5), unit="mm")
    return Document(
        f"Influence of the parameters of {result.robot.title}",
        [
            Section("", [lead, *warned(result.notices)], "result"),
            pictured(
                "influence",
                "Influence of each parameter",
                "Average over the configurations, and range.",
                influence_figure(result.made),
            ),
            pictured("map", "Pose by pose", by_pose, map_figure(result)),
            Section("", [_every_parameter(rows)], "table"),
            *_identified(result),
        ],
        result.command,
        headline=f"What each parameter of {result.robot.title} does to {tip}",
        subtitle=f"{len(result.labels)} configurations. Every parameter is changed alone, by what the table says.",
    ).html(result)


def _every_parameter(rows: list[dict[str, Any]]) -> Table:
    keys = ("mean_mm", "least_mm", "greatest_mm", "mean_deg", "greatest_deg")
    heading = ("mean [mm]", "least [mm]", "greatest [mm]", "turned, mean [deg]", "turned, greatest [deg]")
    return Table(
        ("parameter", "change", "unit", *heading),
        [
            (
                Cell(row["name"], code=True),
                significant(row["change"], 3, 6),
                row["unit"],
                *(significant(row[key], 3, 5) for key in keys),
            )
            for row in rows
        ],
        texts=(2,),
        look="parameters sortable",
    )


def _identified(result: InfluenceResult) -> list[Section]:
    """Return what identification by influence is worth, where it was tried."""
    tried = result.identified
    if tried is None:
        return []
    judged = "configurations that none of them has seen" if tried.held_out else "the same ones"
    frames_words = (
        "are those that fit the nominal robot best" if tried.frames == "placed" else "are where the robot file has them"
    )
    words = (
        f"From {tried.training} configurations; judged on {judged}. Bars are means, lines reach to where 95 % of the "
        "errors are below. Pose by pose, each pose is explained alone and one set is made of those of all poses. Base "
        f"and targets {frames_words}, except in the last way."
    )
    spread = [
        (WAYS[way], *(significant(v * 1e3, 3) for v in (s.mean, s.rms, s.p95, s.max)))
        for way, errors in tried.errors.items()
        if (s := errors.position) is not None
    ]
    ways = [
        (
            Cell(row["name"], code=True),
            row["unit"],
            *(f"{round(row[way], 4) + 0.0:.4f}" for way in WAYS),
            significant(row["deviation"] or 0.0, 2, 6),
        )
        for row in result.parameter_rows()
    ]
    return [
        Section(
            "Identification by influence, beside the standard one",
            [
                Words(words),
                Picture("errors", errors_figure(tried)),
                Table(("identified by", "mean [mm]", "RMS", "95 % below", "maximum"), spread, look="spread"),
                Table(
                    ("parameter", "unit", *WAYS, "deviation of the last"),
                    ways,
                    texts=(1,),
                    caption="What each way found",
                    look="parameters",
                    wide=True,
                ),
            ],
            "identified",
        )
    ]


def map_figure(result: InfluenceResult) -> Figure:
    """Show the influence of each parameter at each configuration, the most influential at the top."""
    order = np.argsort(result.made.mean, kind="stable")
    shown = np.unique(np.linspace(0, len(result.labels) - 1, min(len(result.labels), _SHOWN)).round().astype(int))
    trace = {
        "type": "heatmap",
        "x": [html.escape(result.labels[at]) for at in shown.tolist()],
        "y": [html.escape(result.made.names[index]) for index in order.tolist()],
        "z": [rounded_to(1e3 * result.made.size[index, shown], 4) for index in order.tolist()],
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


def errors_figure(identified: Identified) -> Figure:
    """Show what each way to identify leaves: mean error, with the 95 % below which errors are."""
    spreads = {way: errors.position for way, errors in identified.errors.items() if errors.position is not None}
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
