"""What parameters do to the tip, as a picture (Patel, figure 3.8)."""

from __future__ import annotations

import html

import numpy as np

from truearm.identification.solving.influence import Influence
from truearm.reporting.drawing import AFTER, Figure, axis, figure
from truearm.reporting.numbers import rounded


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
