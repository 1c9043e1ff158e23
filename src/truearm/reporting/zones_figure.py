"""Zones of the workspace: their held-out errors with one model and with their own, as a picture and as rows."""

from __future__ import annotations

import html
from dataclasses import dataclass

import numpy as np

from truearm.identification.choosing.zone_boxes import Box, shown_box
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import rounded, significant
from truearm.results.zones import ZoneChoice


@dataclass(frozen=True)
class ZoneRow:
    """One zone as it is printed."""

    name: str
    box: str
    training: int
    held_out: int
    whole: str
    zone: str
    error: str
    verdict: str
    kept: bool


def zone_rows(choice: ZoneChoice) -> tuple[ZoneRow, ...]:
    """Return a row for each zone that was tried."""
    return tuple(
        ZoneRow(
            verdict.box.name,
            box_words(verdict.box),
            verdict.training,
            verdict.held_out,
            _mm(verdict.whole),
            _mm(verdict.zone),
            _mm(verdict.error),
            f"{'kept' if verdict.kept else 'not kept'}: {verdict.why}",
            verdict.kept,
        )
        for verdict in choice.verdicts
    )


def _mm(value: float | None) -> str:
    return "–" if value is None else significant(value * 1e3)


def box_words(box: Box) -> str:
    """Return the limits of a box in words."""
    words = []
    for letter, ends in shown_box(box).items():
        low, high = (None if end is None else round(end) for end in ends)
        if low is None:
            words.append(f"{letter} below {high}")
        elif high is None:
            words.append(f"{letter} from {low}")
        else:
            words.append(f"{letter} {low} to {high}")
    return ", ".join(words)


def zones_figure(choice: ZoneChoice) -> Figure:
    """Show the mean held-out error of each zone with one model and with its own; what is not kept is faint."""
    judged = [verdict for verdict in choice.verdicts if verdict.whole is not None and verdict.zone is not None]
    names = [html.escape(f"{verdict.box.name}{'' if verdict.kept else ' (not kept)'}") for verdict in judged]
    error = rounded(np.array([(verdict.error or 0.0) * 1e3 for verdict in judged]), 3)
    traces = [
        {
            "type": "bar",
            "name": name,
            "x": names,
            "y": rounded(np.array([(value or 0.0) * 1e3 for value in values]), 4),
            "marker": {"color": colour, "line": {"width": 0}, "opacity": [1.0 if v.kept else 0.45 for v in judged]},
            "hovertemplate": f"%{{x}}: %{{y}} mm, {name}<extra></extra>",
            **bars,
        }
        for name, values, colour, bars in (
            ("one model for the whole", [v.whole for v in judged], BEFORE, {}),
            (
                "a model of its own, with the standard error of the difference",
                [v.zone for v in judged],
                AFTER,
                {"error_y": {"type": "data", "array": error, "thickness": 1.2, "width": 4}},
            ),
        )
    ]
    return figure(
        traces,
        340,
        xaxis={**axis("zone"), "type": "category"},
        yaxis=axis("mean held-out error [mm]") | {"rangemode": "tozero"},
        barmode="group",
    )
