"""The picture of a simulated IRB 120's errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from papers.irb120_simulation.run import Outcome
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, axis, figure, logarithmic_axis, rounded


def errors_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Draw the errors before and after the calibration with noise, of all seeds together."""
    low, high = 1e-3, 10.0
    edges = np.geomspace(low, high, 61)
    traces = [
        {
            "type": "bar",
            "name": name,
            "x": rounded(np.sqrt(edges[:-1] * edges[1:]), 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(errors, low, high), edges)[0].tolist(),
            "marker": {"color": colour, "line": {"width": 0}},
            "hovertemplate": f"{name}<br>%{{x:.3g}} mm: %{{y}} readings<extra></extra>",
        }
        for name, colour, errors in (
            ("nominal, before", BEFORE, np.concatenate([one.errors_before for one in outcomes])),
            ("0.070 mm noise, masses 10 % off, after", AFTER, np.concatenate([one.errors_noisy for one in outcomes])),
        )
    ]
    drawn = figure(
        traces,
        340,
        xaxis=logarithmic_axis("position error [mm]", low, high),
        yaxis=axis("readings"),
        barmode="overlay",
        bargap=0,
    )
    return Picture(
        "errors",
        "Errors on unseen configurations",
        "All seeds together, truth of Tables 2.6 and 2.7, against the true positions.",
        drawn,
    )
