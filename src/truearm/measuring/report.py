"""The report of a plan that was measured: what is kept and why not, the nests, the dwells, the air."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.document.document import Document, answer, lines_of, pictured, tabled
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded_to
from truearm.engine.robot.chain import Array
from truearm.measuring.campaign import nest_drift
from truearm.measuring.session import REASONS, Session

if TYPE_CHECKING:
    from truearm.measuring.result import Measured


_HEIGHT: Final = 340
_TOGETHER: Final = "#2b2f33"


def drift_figure(session: Session) -> Figure | None:
    """Return how far the nests are from where they were first, over time; None before one was read."""
    drift = nest_drift(session)
    if drift is None:
        return None
    minutes = rounded_to(drift.time / 60.0, 3)
    traces = [
        _line(name, minutes, distance, COLOURS[number % len(COLOURS)], "dot")
        for number, (name, distance) in enumerate(zip(drift.names, drift.distance, strict=True))
    ]
    traces.append(_line("together", minutes, np.sqrt((drift.common**2).sum(axis=1)), _TOGETHER, "solid"))
    return figure(traces, _HEIGHT, xaxis=axis("time since the nests were read first [min]"), yaxis=axis("moved [mm]"))


def quality_figure(session: Session) -> Figure | None:
    """Return the scatter within the dwell of each reading, in the order of measuring; None where none tells it."""
    drawn = session.drawn()
    known = np.isfinite(drawn.deviation)
    if not known.any():
        return None
    number = np.arange(1, len(drawn.names) + 1)
    traces = []
    for is_kept, name, colour, symbol in ((True, "kept", AFTER, "circle"), (False, "set aside", COLOURS[0], "x")):
        chosen = np.flatnonzero(known & (drawn.kept == is_kept))
        if len(chosen):
            words = [
                html.escape(f"{drawn.labels[k]} {drawn.names[k]}{f', {drawn.reasons[k]}' if drawn.reasons[k] else ''}")
                for k in chosen.tolist()
            ]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": name,
                    "x": number[chosen].tolist(),
                    "y": rounded_to(drawn.deviation[chosen] * 1e3, 5),
                    "text": words,
                    "marker": {"color": colour, "size": 6, "symbol": symbol},
                    "hovertemplate": "%{text}: %{y:.4f} mm<extra></extra>",
                }
            )
    if (most := session.quality.deviation) is not None:
        ends = [1, len(drawn.names)]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": "allowed",
                "x": ends,
                "y": [most * 1e3] * 2,
                "line": {"color": BEFORE, "width": 1.2, "dash": "dash"},
                "hoverinfo": "skip",
            }
        )
    return figure(traces, _HEIGHT, xaxis=axis("reading"), yaxis=axis("deviation of a sample [mm]"))


def _line(name: str, x: list[float], distance: Array, colour: str, dash: str) -> Figure:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": html.escape(name),
        "x": x,
        "y": [None if np.isnan(value) else round(value * 1e3, 5) for value in distance.tolist()],
        "line": {"color": colour, "width": 1.4, "dash": dash},
        "marker": {"color": colour, "size": 5},
        "hovertemplate": f"{html.escape(name)}, %{{x:.1f}} min: %{{y:.4f}} mm<extra></extra>",
    }


def measure_report(measured: Measured) -> str:
    """Return the page."""
    session, quality = measured.session, measured.session.quality
    counts = session.aside_by_reason
    accepted = len(session.kept)
    states = [("kept", str(accepted), "")]
    states += [(reason, str(count), REASONS[reason]) for reason, count in counts.items()]
    asked = [
        (
            "deviation of a sample, at most",
            "not asked" if quality.deviation is None else f"{quality.deviation * 1e3:.4f} mm",
        ),
        (
            "between the halves of a dwell, at most",
            "not asked" if quality.settling is None else f"{quality.settling * 1e3:.4f} mm",
        ),
        ("samples, at least", str(quality.samples)),
    ]
    tables = [
        tabled("Readings", ("state", "count", "why"), tuple(states), (2,)),
        tabled(
            "Measured with", ("what", "value"), (("readings from", measured.instrument), *measured.about.rows()), (1,)
        ),
        tabled("Asked of a reading", ("what", "limit"), tuple(asked), (1,)),
    ]
    aside = [
        (str(entry.number), entry.label, entry.name, session.reason_of(entry), entry.words)
        for entry in session.entries
        if entry.event == "reading" and session.reason_of(entry)
    ]
    details = []
    if session.left_out:
        places: dict[str, list[str]] = {}
        for label, name in session.left_out:
            places.setdefault(name, []).append(label)
        rows = [(name, str(len(labels)), ", ".join(labels)) for name, labels in places.items()]
        details.append(tabled("Left out", ("target", "count", "at the configurations"), tuple(rows), (2,)))
    if aside:
        heading = ("number", "configuration", "point", "reason", "words")
        details.append(tabled("Set aside, one by one", heading, tuple(aside), (1, 2, 3, 4)))
    pictures = []
    if (drift := drift_figure(session)) is not None:
        words = (
            "How far each fixed nest is from where it was read first, and what all of them share: instrument or floor, "
            "not the robot. It is shown alone: no reading is corrected for it."
        )
        pictures.append(pictured("drift", "Nests", words, drift))
    if (scatter := quality_figure(session)) is not None:
        words = (
            "Scatter of the samples while the arm stood, reading by reading. It does not say how well a reading fits."
        )
        pictures.append(pictured("dwell", "Dwells", words, scatter))
    return Document(
        f"Measured: {measured.title}",
        [
            answer(lines_of(measured.blocks()), measured.warnings),
            *tables,
            *pictures,
            *details,
        ],
        measured.command,
        subtitle=f"The plan {measured.plan}. No reading was kept or set aside for how well it fits a model.",
    ).html(measured)
