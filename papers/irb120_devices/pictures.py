"""Pictures of the document's three set-ups, and of every instrument."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from papers.irb120_devices.run import COUNT, Outcome, by_instrument
from papers.irb120_devices.setups import SETUPS
from papers.seeds import median_of
from papers.study import Picture
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    COLOURS,
    axis,
    figure,
    logarithmic_axis,
    rounded,
    rounded_to,
    scene_axis,
)


def places_picture(first: Outcome) -> Picture:
    """Return where nests were measured (Figure 2.7)."""
    traces = [
        {
            "type": "scatter3d",
            "mode": "markers",
            "name": f"{name}, {len(made.places)}",
            **{letter: rounded_to(made.places[:, k], 4) for k, letter in enumerate("xyz")},
            "marker": {"size": 4, "color": colour},
        }
        for (name, made), colour in zip(first.setups.items(), COLOURS, strict=True)
    ]
    scene = {f"{letter}axis": scene_axis(f"{letter} [m]") for letter in "xyz"} | {"aspectmode": "data"}
    return Picture(
        "places",
        "Where nest 1 was (Figure 2.7)",
        "Configurations chosen by O1 among those that the set-up sees, first seed, seen from the instrument.",
        figure(traces, 460, scene=scene),
    )


def errors_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Return histograms of the errors after calibration (Figures 2.9 to 2.11)."""
    edges = np.linspace(0.0, 0.6, 41)
    traces = []
    for setup, colour in zip(SETUPS, COLOURS, strict=True):
        every = np.concatenate([one.setups[setup.name].errors for one in outcomes])
        share = 100.0 * np.histogram(np.clip(every, 0.0, edges[-1]), edges)[0] / len(every)
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": f"{setup.name}, {setup.configurations} configurations",
                "x": rounded(0.5 * (edges[:-1] + edges[1:]), 4),
                "y": rounded(share, 4),
                "line": {"color": colour, "shape": "hvh"},
            }
        )
    return Picture(
        "errors",
        "Errors after calibration (Figures 2.9 to 2.11)",
        "Of the nests at unseen configurations, gears that run out, all seeds together; larger errors in the last bin.",
        figure(traces, 340, xaxis=axis("position error [mm]"), yaxis=axis("share [%]")),
    )


def instruments_picture(outcomes: Sequence[Outcome]) -> Picture:
    """Return what every instrument leaves, as bars."""
    found = by_instrument(outcomes)
    traces = []
    for count, colour in ((COUNT, AFTER), (3 * COUNT, BEFORE)):
        mine = [made for made in found if made[0].configurations == count]
        means = [median_of(made, lambda one: 1e3 * one.after.mean()) for made in mine]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": f"{count} configurations",
                "y": [made[0].device.name for made in mine],
                "x": rounded(np.array(means), 4),
                "marker": {"color": colour},
                "hovertemplate": "%{y}: %{x:.3g} mm<extra></extra>",
            }
        )
    across = logarithmic_axis("mean position error [mm]", 1e-3, 1.0)
    down = axis("") | {"autorange": "reversed"}
    return Picture(
        "instruments",
        "What every instrument leaves",
        "At unseen configurations, of a robot that the model can follow; closed loops up to a rigid motion.",
        figure(traces, 520, xaxis=across, yaxis=down, barmode="group"),
    )
