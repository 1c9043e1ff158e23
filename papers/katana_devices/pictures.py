"""Pictures of the study katana-devices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from papers.katana_devices.run import Outcome
from papers.katana_devices.setup import INSTRUMENTS, STARTS
from papers.katana_devices.tables import instrument_words
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, logarithmic_axis, rounded

_COLOURS: Final = dict(zip(STARTS, ("#b3261e", AFTER), strict=True))


def devices_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Draw the error on unseen configurations by device."""
    values = {
        start: np.array([np.median([one.reached[name, start].moved.mean for one in outcomes]) for name in INSTRUMENTS])
        for start in STARTS
    }
    order = np.argsort(values["tilting first"])[::-1]
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": start,
            "x": rounded(values[start][order], 3),
            "y": [instrument_words(INSTRUMENTS[k]).partition(":")[0] for k in order.tolist()],
            "marker": {"color": _COLOURS[start], "size": 9},
            "hovertemplate": f"{start}<br>%{{y}}: %{{x:.3g}} mm<extra></extra>",
        }
        for start in STARTS
    ]
    drawn = figure(traces, 480, xaxis=logarithmic_axis("mean error [mm]", 0.01, 5.0), yaxis={"automargin": True})
    return Picture(
        "devices",
        "Error on unseen configurations, by device",
        "Median of the seeds, after the best rigid motion.",
        drawn,
    )


def page_picture(first: Outcome) -> Picture:
    """Draw what the page shows, as in Figure 5.13."""
    pages = {"before": first.pages.before} | {f"low-cost, {s}": first.pages.after["low-cost", s] for s in STARTS}
    traces: list[Figure] = []
    for (words, page), colour in zip(pages.items(), (BEFORE, *_COLOURS.values()), strict=True):
        for values, part, dash in ((page.outward, "outward", "solid"), (page.height, "height", "dot")):
            name = f"{words}: {part}"
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": name,
                    "x": rounded(page.along, 4),
                    "y": rounded(values, 4),
                    "line": {"color": colour, "width": 1.8, "dash": dash},
                    "hovertemplate": f"{name} %{{y:.3g}} mm at %{{x:.0f}} deg<extra></extra>",
                }
            )
    drawn = figure(traces, 420, xaxis=axis("round the circle [deg]"), yaxis=axis("beside the circle [mm]"))
    return Picture(
        "page",
        "What the page shows, as in Figure 5.13",
        "First seed: the line beside a circle of the right size about its own middle, and the height over its plane.",
        drawn,
    )
