"""The report of tests by ISO 9283."""

from __future__ import annotations

from truearm.reporting.picture_page import Figures, picture_page
from truearm.results.iso9283_evaluation import Iso9283Evaluation, test_name, value_words


def iso9283_report(found: Iso9283Evaluation) -> str:
    """Return the report."""
    tables = []
    for name in dict.fromkeys(test_name(value) for value in found.values):
        rows = []
        for value in found.values:
            if test_name(value) == name:
                words = value_words(value)
                rows.append((f"{words[0]} {value.component}", *words[1:]))
        tables.append(
            Figures(name.capitalize(), ("Criterion", "Where", "Velocity, load", "Value", "95 %, or range"), tuple(rows))
        )
    return picture_page(
        f"{found.plan.robot.title} by the criteria of ISO 9283",
        "Every value with its interval.",
        [found.tied],
        found.command,
        pictures=[],
        tables=tables,
        notices=found.warnings,
    )
