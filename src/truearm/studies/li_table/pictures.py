"""Pictures of the study li-table."""

from __future__ import annotations

from truearm.reporting.drawing import AFTER, BEFORE, COLOURS, axis, figure
from truearm.reporting.numbers import rounded
from truearm.studies.li_table.run import Outcome
from truearm.studies.li_table.tables import SURFACE_WORDS
from truearm.studies.study import Picture


def trajectory_picture(first: Outcome) -> Picture:
    """Draw errors along the other trajectory."""
    followed = {"before": first.following.before}
    followed |= {SURFACE_WORDS[surface]: found for surface, found in first.following.after.items()}
    colours = (BEFORE, *COLOURS, AFTER)
    traces = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "x": list(range(1, len(one.path) + 1)),
            "y": rounded(one.path, 4),
            "line": {"color": colour},
            "marker": {"size": 4},
        }
        for (name, one), colour in zip(followed.items(), colours, strict=True)
    ]
    drawn = figure(traces, 340, xaxis=axis("point of the trajectory"), yaxis=axis("error [mm]"))
    return Picture(
        "trajectory",
        "Along the other trajectory",
        "First seed, with play: the twin sent along it by the nominal arm, and by the arm calibrated on each table.",
        drawn,
    )
