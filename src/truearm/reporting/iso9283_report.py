"""The report of tests by ISO 9283."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from truearm.planning.iso9283.criteria import TESTS
from truearm.reporting.iso9283_figures import pose_pictures
from truearm.reporting.iso9283_path_figures import path_pictures
from truearm.reporting.picture_page import Figures, picture_page
from truearm.results.iso9283_table import (
    HEADING,
    UNITS,
    beside_words,
    conditions_words,
    number_words,
    test_name,
    worst_places,
)

if TYPE_CHECKING:
    from truearm.results.iso9283_evaluation import Iso9283Evaluation
    from truearm.validation.iso9283.comparison import Comparison
    from truearm.validation.iso9283.values import Component, Value

_AXES: tuple[Component, ...] = ("x", "y", "z")
_ANGLES: tuple[Component, ...] = ("a", "b", "c")


def iso9283_report(found: Iso9283Evaluation) -> str:
    """Return the report: the criteria at their worst places, pictures, and every value."""
    measured = [value for value in found.values if value.status != "not-measured"]
    worst = tuple(tuple(map(_unbroken, one.cells)) for one in worst_places(found.values))
    tables = [Figures("Criteria at their worst places", HEADING, worst, texts=(1, 4, 5))]
    if found.comparison is not None:
        tables.append(_compared(found.comparison))
    details: list[Figures] = []
    for name in dict.fromkeys(test_name(value) for value in found.values):
        details += _tables(name, [value for value in found.values if test_name(value) == name])
    evaluation = found.evaluation
    plan = found.plan
    unread = [test for test in plan.tests if not any(value.id in TESTS[test.id].criteria for value in measured)]
    words = [
        found.tied,
        f"Rated: {plan.rated_load:g} kg, {plan.rated_velocity * 1e3:g} mm/s along a path. A reading of the instrument "
        f"has a standard deviation of {found.instrument.sigma * 1e3:g} mm.",
        "Intervals are of 95 %. Criteria of three cycles have their range instead. Of several velocities the fastest "
        "is in the first table and in the pictures.",
        "Evaluated by what the literature says of ISO 9283:1998. Who wants to claim conformity needs the standard's "
        "own text.",
    ]
    if unread:
        words.append(f"Planned and not measured: {', '.join(TESTS[test.id].name for test in unread)}.")
    return picture_page(
        f"{plan.robot.title} by the criteria of ISO 9283",
        "Pose and path characteristics with their intervals.",
        words,
        found.command,
        found,
        pictures=[
            *pose_pictures(
                plan, evaluation.clouds, evaluation.drift, evaluation.settling, evaluation.pushes, found.comparison
            ),
            *path_pictures(evaluation, found.comparison),
        ],
        tables=tables,
        details=details,
        notices=found.warnings,
    )


def _unbroken(cell: str) -> str:
    """Return a cell that is broken behind commas alone, a no-break space in place of the others."""
    return ", ".join(part.replace(" ", "\u00a0") for part in cell.split(", "))


def _tables(name: str, values: Sequence[Value]) -> list[Figures]:
    """Return the table of a test, and one of its axes and angles where it has them."""
    title = name[0].upper() + name[1:]
    rows = tuple(
        (
            value.id,
            value.where,
            conditions_words(value),
            f"{number_words(value)} {UNITS[value.quantity][0]}" if math.isfinite(value.value) else "–",
            beside_words(value),
            str(value.cycles),
            value.status,
        )
        for value in values
        if value.component == "position"
    )
    heading = ("Criterion", "Where", "Velocity, load", "Value", "95 %, or range", "Cycles", "Status")
    made = [Figures(title, heading, rows)]
    for parts, words, unit in ((_AXES, "single axes", "mm"), (_ANGLES, "angles", "deg")):
        detail = _details([value for value in values if value.component in parts], parts)
        if detail:
            columns = tuple(f"{part} [{unit}]" for part in parts)
            made.append(Figures(f"{title}: {words}", ("Criterion", "Where", "Velocity, load", *columns), detail))
    return made


def _details(values: Sequence[Value], parts: Sequence[Component]) -> tuple[tuple[str, ...], ...]:
    """Return rows with a column for each part: the value, and its interval in brackets."""
    rows: dict[tuple[str, str, str], dict[Component, str]] = {}
    for value in values:
        if math.isfinite(value.value):
            beside = beside_words(value)
            text = f"{number_words(value)} ({beside})" if beside else number_words(value)
            rows.setdefault((value.id, value.where, conditions_words(value)), {})[value.component] = text
    return tuple((*key, *(row.get(part, "–") for part in parts)) for key, row in rows.items())


def _compared(comparison: Comparison) -> Figures:
    """Return what differs of position by more than its intervals leave open, and what does not."""
    rows = tuple(
        (
            row.id,
            row.where,
            row.under,
            f"{row.value:.4f} {row.unit}",
            f"{row.other:.4f} {row.unit}",
            row.verdict,
        )
        for row in comparison.rows
        if row.component == "position"
    )
    heading = ("Criterion", "Where", "Velocity, load", "This", "Other", "This one is")
    return Figures(f"Beside {comparison.other}", heading, rows)
