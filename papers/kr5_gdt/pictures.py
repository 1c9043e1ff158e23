"""Pictures of the study kr5-gdt."""

from __future__ import annotations

from papers.kr5_gdt.run import LARGER, Outcome, Run
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to
from truearm.engine.motion.cube import DIRECTIONS


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


def circles_picture(found: Run) -> Picture:
    """Draw the nominal and the measured circle of joint 2, as Figure 7."""
    nominal, measured = found.circles
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": mode,
            "name": name,
            "x": rounded_to(1e3 * points[:, 1], 3),
            "y": rounded_to(1e3 * points[:, 2], 3),
            "line": {"color": colour, "width": 2},
            "marker": {"color": colour, "size": 5},
        }
        for name, points, colour, mode in (
            ("nominal, C1", nominal, BEFORE, "lines"),
            (f"{LARGER} times off, C2", measured, AFTER, "markers"),
        )
    ]
    return Picture(
        "circles",
        "Nominal and measured circle of joint 2, as in Figure 7",
        "Where the reflector is while joint 2 turns, seen along the axis: by the nominal robot, and by the twin, whose"
        f" errors of Table 3 are drawn {LARGER} times as large.",
        figure(traces, 420, xaxis=axis("y [mm]"), yaxis=axis("z [mm]") | {"scaleanchor": "x"}),
    )


def model_picture(first: Outcome) -> Picture:
    """Draw the difference between model and robot along each line, as Figure 8."""
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": direction,
            "x": list(range(1, len(first.model[first.before.lines.rows(direction)]) + 1)),
            "y": rounded_to(1e3 * first.model[first.before.lines.rows(direction)], 5),
            "marker": {"size": 4},
            "hovertemplate": f"{direction}, pose %{{x}}: %{{y:.4f}} mm<extra></extra>",
        }
        for direction in DIRECTIONS
    ]
    return Picture(
        "model",
        "Difference between model and robot along the lines, as in Figure 8",
        "First seed: where the model with the errors found says the flange is, and where the twin's is. The document's"
        " curves reach 0.52 to 0.84 mm: what its model of joint errors does not describe.",
        figure(traces, 380, xaxis=axis("pose on the line"), yaxis=axis("difference [mm]") | {"rangemode": "tozero"}),
    )
