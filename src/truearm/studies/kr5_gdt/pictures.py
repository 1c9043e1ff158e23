"""Pictures of the study kr5-gdt."""

from __future__ import annotations

from truearm.planning.poses.seven_lines import DIRECTIONS
from truearm.reporting.drawing import AFTER, BEFORE, axis, figure
from truearm.reporting.numbers import rounded_to
from truearm.studies.kr5_gdt.run import Outcome
from truearm.studies.study import Picture


def lines_picture(first: Outcome) -> Picture:
    """Draw errors on the seven lines, before and after compensation."""
    traces = []
    for name, errors, colour in (
        ("uncompensated", first.before, BEFORE),
        ("compensated", first.after, AFTER),
    ):
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": list(errors.lines.labels),
                "y": rounded_to(1e3 * errors.error, 4),
                "marker": {"color": colour, "size": 6},
                "hovertemplate": f"%{{x}}, {name}: %{{y:.4f}} mm<extra></extra>",
            }
        )
    across = axis("pose") | {"tickvals": [f"{d}-1" for d in DIRECTIONS], "ticktext": list(DIRECTIONS)}
    up = axis("error [mm], logarithmic") | {"type": "log"}
    return Picture(
        "lines",
        "Errors on the seven lines, before and after",
        "Mean distance over the repetitions, line after line, first seed.",
        figure(traces, 380, xaxis=across, yaxis=up),
    )
