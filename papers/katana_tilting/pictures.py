"""Pictures of the study katana-tilting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from papers.katana_tilting.run import COLUMNS, Outcome
from papers.katana_tilting.tables import METHOD_WORDS
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, axis, figure, logarithmic_axis, rounded
from truearm.engine.document.planning_figures import pose_cube
from truearm.engine.motion.cube import Cube


def poses_picture(cube: Cube, first: Outcome) -> Picture:
    """Draw the poses of one seed in their cube, as in Figure 4.8."""
    return Picture(
        "poses",
        "The poses, as in Figure 4.8",
        f"First seed: the largest cube in front of the arm (side {cube.side * 1e3:.0f} mm), its diagonal planes and the"
        " poses on them; tails show the direction of the tip. The construction is ours: the document does not print its"
        " poses.",
        pose_cube(first.plan),
    )


def errors_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Draw how errors on unseen poses are distributed."""
    errors = {method: np.concatenate([one.left[method].unseen["dP"] for one in outcomes]) for method in COLUMNS}
    low, high = 1e-3, 3.0
    edges = np.geomspace(low, high, 61)
    traces = [
        {
            "type": "bar",
            "name": METHOD_WORDS[method],
            "x": rounded(np.sqrt(edges[:-1] * edges[1:]), 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(errors[method], low, high), edges)[0].tolist(),
            "marker": {"color": colour, "line": {"width": 0}},
            "opacity": 0.75,
            "hovertemplate": f"{METHOD_WORDS[method]}<br>%{{x:.3g}} mm: %{{y}} configurations<extra></extra>",
        }
        for method, colour in zip(COLUMNS, (BEFORE, "#b3261e", AFTER), strict=True)
    ]
    drawn = figure(
        traces,
        360,
        xaxis=logarithmic_axis("|dP| [mm]", low, high),
        yaxis=axis("configurations"),
        barmode="overlay",
        bargap=0,
    )
    return Picture("errors", "Errors on unseen poses", "All seeds together, against the true positions.", drawn)
