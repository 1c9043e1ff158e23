"""The picture of single joints of an IRB 120, as Figure 2.6."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.irb120_axes.run import Outcome
from papers.irb120_axes.single_joint import AxisTest
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to


def errors_picture(tests: Mapping[int, AxisTest], found: Outcome) -> Picture:
    """Draw the angular error while each joint turns, as one seed's noise makes it."""
    traces: list[Figure] = []
    layout: dict[str, Any] = {}
    labels = []
    for place, number in enumerate(tests):
        suffix = "" if place == 0 else str(place + 1)
        x, y = axis(""), axis("")
        row, column = divmod(place, 2)
        x["domain"] = [0.0, 0.46] if column == 0 else [0.54, 1.0]
        top = 1.0 - row * 0.35
        y["domain"] = [top - 0.25, top]
        x["anchor"], y["anchor"] = f"y{suffix}", f"x{suffix}"
        layout |= {f"xaxis{suffix}": x, f"yaxis{suffix}": y}
        alone, geared = found.compliance[number], found.gears[number]
        half = len(alone.angle) // 2
        labels.append(
            {
                "text": f"joint {number}",
                "xref": f"x{suffix} domain",
                "yref": f"y{suffix} domain",
                "x": 0.0,
                "y": 1.0,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
            }
        )
        for name, turn, part, colour in (
            ("compliance alone", alone, slice(0, half), BEFORE),
            ("forward", geared, slice(0, half), AFTER),
            ("backward", geared, slice(half, None), "#b3261e"),
        ):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": name,
                    "legendgroup": name,
                    "showlegend": place == 0,
                    "x": rounded_to(turn.angle[part], 1),
                    "y": rounded_to(turn.error[part], 5),
                    "xaxis": f"x{suffix}",
                    "yaxis": f"y{suffix}",
                    "line": {"color": colour, "width": 1.5, "dash": "solid"},
                    "hovertemplate": f"joint {number}, {name}<br>%{{x}} deg: %{{y:.4f}} deg<extra></extra>",
                }
            )
    drawn = figure(traces, 900, annotations=labels, **layout)
    drawn["layout"]["legend"]["y"] = 1.05
    return Picture(
        "angular-errors",
        "Angular error while one joint turns, as in Figure 2.6",
        "Error [deg] against the commanded angle [deg], first seed: compliance of Table 2.7 alone (forward run), and"
        " with run-out and backlash chosen to match, forward and backward.",
        drawn,
    )
