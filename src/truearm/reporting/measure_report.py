"""The report of a plan that was measured: what is kept and why not, the nests, the dwells, the air."""

from __future__ import annotations

from typing import TYPE_CHECKING

from truearm.measurement.measuring.readings import REASONS
from truearm.reporting.measure_figures import drift_figure, quality_figure
from truearm.reporting.picture_page import Drawing, Figures, picture_page
from truearm.results.record import notice_lines

if TYPE_CHECKING:
    from truearm.results.measured import Measured


def measure_report(measured: Measured) -> str:
    """Return the page."""
    session, quality = measured.session, measured.session.quality
    counts = session.aside_by_reason
    kept = len(session.kept)
    states = [("kept", str(kept), "")]
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
        Figures("Readings", ("state", "count", "why"), tuple(states), (2,)),
        Figures(
            "Measured with", ("what", "value"), (("readings from", measured.instrument), *measured.about.rows()), (1,)
        ),
        Figures("Asked of a reading", ("what", "limit"), tuple(asked), (1,)),
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
        details.append(Figures("Left out", ("target", "count", "at the configurations"), tuple(rows), (2,)))
    if aside:
        heading = ("number", "configuration", "point", "reason", "words")
        details.append(Figures("Set aside, one by one", heading, tuple(aside), (1, 2, 3, 4)))
    pictures = []
    if (drift := drift_figure(session)) is not None:
        words = (
            "How far each fixed nest is from where it was read first, and what all of them share: instrument or floor, "
            "not the robot. It is shown alone: no reading is corrected for it."
        )
        pictures.append(Drawing("drift", "Nests", words, drift))
    if (scatter := quality_figure(session)) is not None:
        words = (
            "Scatter of the samples while the arm stood, reading by reading. It does not say how well a reading fits."
        )
        pictures.append(Drawing("dwell", "Dwells", words, scatter))
    said = notice_lines(measured.warnings)
    return picture_page(
        f"Measured: {measured.title}",
        f"The plan {measured.plan}. No reading was kept or set aside for how well it fits a model.",
        [line for line in measured.lines() if line not in said],
        measured.command,
        measured,
        pictures=pictures,
        tables=tables,
        details=details,
        notices=measured.warnings,
    )
