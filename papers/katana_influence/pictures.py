"""Pictures of the study katana-influence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from papers.katana.robot import DOCUMENT_NAMES
from papers.katana_influence.run import METHODS, TRUTHS, Outcome
from papers.katana_influence.tables import METHOD_WORDS, TRUTH_WORDS
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, axis, figure, rounded
from truearm.simulation.influence_report import influence_figure


def influence_picture(first: Outcome) -> Picture:
    """Draw the influence of each parameter for one seed, as in Figure 3.8."""
    return Picture(
        "influence",
        "Influence of each parameter, as in Figure 3.8",
        "How far the tip moves if one parameter is off by +0.05 deg or +0.1 mm: average over the poses of the first"
        " seed, and range. Names are the document's; those of the tool link, alpha 5 and d 6, are y and z of the tip in"
        " truearm.",
        influence_figure(replace(first.influence, names=DOCUMENT_NAMES)),
    )


def methods_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Draw what each method leaves on unseen poses."""
    colours = (BEFORE, "#8a6d1d", "#b3261e", AFTER)
    traces = [
        {
            "type": "bar",
            "name": METHOD_WORDS[method],
            "x": [TRUTH_WORDS[truth] for truth in TRUTHS],
            "y": rounded(
                np.array([np.median([one.left[truth, method].unseen for one in outcomes]) for truth in TRUTHS]), 4
            ),
            "marker": {"color": colour, "line": {"width": 0}},
            "hovertemplate": f"%{{x}}, {METHOD_WORDS[method]}: %{{y}} mm<extra></extra>",
        }
        for method, colour in zip(METHODS, colours, strict=True)
    ]
    drawn = figure(
        traces,
        380,
        xaxis={**axis("the truth"), "type": "category"},
        yaxis={**axis("mean |dP| on unseen poses [mm]"), "rangemode": "tozero"},
        barmode="group",
    )
    return Picture("methods", "What each method leaves", "Median over the seeds.", drawn)
