"""The picture of a measured IRB 120: every model at every split."""

from __future__ import annotations

import numpy as np

from papers.irb120_faro.run import DOCUMENT, FEW, Run, cases
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, axis, figure, rounded


def models_picture(found: Run) -> Picture:
    """Draw the mean error of every model at every split."""
    shown = cases(found.together)[1:]
    traces = [
        {
            "type": "box",
            "name": f"{count} training configurations",
            "orientation": "h",
            "y": [case.name for case in shown for _ in found.outcomes],
            "x": rounded(np.array([one[case].mean for case in shown for one in errors]), 4),
            "marker": {"color": colour, "size": 4},
            "line": {"width": 1.5},
            "boxpoints": "all",
            "jitter": 0.4,
            "pointpos": 0,
        }
        for count, errors, colour in (
            (DOCUMENT, [one.document for one in found.outcomes], "#b3261e"),
            (FEW, [one.few for one in found.outcomes], BEFORE),
            (found.many, [one.many for one in found.outcomes], AFTER),
        )
    ]
    x = axis("mean position error on configurations that the fit has not seen [mm]") | {"rangemode": "tozero"}
    y = axis("") | {"autorange": "reversed"}
    mark = {"type": "line", "x0": 0.146, "x1": 0.146, "y0": 0, "y1": 1, "yref": "paper", "line": {"dash": "dot"}}
    words = {
        "text": "document, 38 configurations",
        "x": 0.15,
        "y": 0.0,
        "yref": "paper",
        "xanchor": "left",
        "yanchor": "bottom",
        "showarrow": False,
    }
    drawn = figure(traces, 620, xaxis=x, yaxis=y, boxmode="group", shapes=[mark], annotations=[words])
    return Picture(
        "models",
        "Every split",
        "One point a split. The dotted line is the document's 0.146 mm.",
        drawn,
    )
