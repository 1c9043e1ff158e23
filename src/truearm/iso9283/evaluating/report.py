"""The report of tests by ISO 9283."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from truearm.engine.document.document import Document, Section, answer, pictured, tabled
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    COLOURS,
    HUES,
    INK,
    SHADE,
    Figure,
    Panel,
    axis,
    figure,
    line,
    panels,
    rounded_to,
)
from truearm.iso9283.criteria.corners import CornerCurves, WeaveCurves
from truearm.iso9283.criteria.paths import PathDeviations
from truearm.iso9283.criteria.runs import Run
from truearm.iso9283.criteria.streams import FoundStream
from truearm.iso9283.criteria.velocity import VelocityCurves
from truearm.iso9283.evaluating.comparison import Comparison, Course, key_of
from truearm.iso9283.evaluating.evaluation import Evaluation
from truearm.iso9283.evaluating.figures import pose_pictures, thinned
from truearm.iso9283.evaluating.table import (
    HEADING,
    UNITS,
    beside_words,
    conditions_summary,
    conditions_words,
    number_words,
    test_name,
    uncovered_tests,
    worst_places,
)

if TYPE_CHECKING:
    from truearm.iso9283.criteria.rows import Component, Value
    from truearm.iso9283.evaluating.evaluate import Iso9283Evaluation


#: A corner is drawn so many times the largest of its deviations about it.
_MARGIN: Final = 4.0
#: So many whole waves of a weave are drawn.
_WAVES: Final = 5
_STREAM_SAMPLES: Final = 1500
#: Of streams so many are drawn.
_STREAMS: Final = 3
_BAND: Final = "#c3d5e3"

_Curves = TypeVar("_Curves", PathDeviations, CornerCurves, VelocityCurves, WeaveCurves)


def path_pictures(evaluation: Evaluation, other: Comparison | None = None) -> list[Section]:
    """Return the pictures of what was measured along paths, those at the fastest velocity of each test.

    Args:
        other: Another result, whose deviations are drawn beside these.
    """
    drawings: list[Section] = []
    for test, name, title in (
        ("AT", "paths", "Deviation along the paths"),
        ("AT-reorientation", "paths-reoriented", "Deviation along the path on reorientation"),
    ):
        courses = _fastest([deviation for deviation in evaluation.deviations if deviation.run.test == test])
        if courses:
            words = (
                f"Distance from the command in planes at right angles to it, {_under(courses[0].run)}. "
                "AT is the largest of the barycentre's; the band is its 95 % interval at each station for itself."
            )
            beside = [_course(course, other) for course in courses]
            if any(beside):
                words += " Dashed: the barycentre of the other result."
            drawings.append(pictured(name, title, words, _deviations(courses, beside)))
    corners = _fastest(evaluation.corners)
    if corners:
        words = (
            f"In the plane of the two sides, {_under(corners[0].run)}. The commanded path comes from the left and goes "
            "on upwards. CR is the least distance to the corner, CO how far the tip goes beyond the second side."
        )
        drawings.append(pictured("corners", "Corners", words, _corners(corners)))
    velocities = _fastest(evaluation.velocities)
    if velocities:
        words = f"Each cycle, {_under(velocities[0].run)}. AV, RV and FV are read in the grey middle half."
        drawings.append(pictured("velocity", "Velocity along the path", words, _velocity(velocities)))
    weaves = _fastest(evaluation.weaves)
    if weaves:
        words = f"The first {_WAVES} waves of the first cycle beside the command, {_under(weaves[0].run)}."
        drawings.append(pictured("weave", "Weave", words, _weave(weaves[0])))
    streams = [run.stream for run in _runs(evaluation) if run.stream is not None]
    if streams:
        words = (
            "Speed of the tip in streams whose cycles are not numbered. Cycles found are blue, dwells grey; above "
            "the dashed line is motion."
        )
        drawings.append(pictured("streams", "What was found in streams", words, _streams(streams[:_STREAMS])))
    return drawings


def _runs(evaluation: Evaluation) -> list[Run]:
    runs = [
        *(deviation.run for deviation in evaluation.deviations),
        *(corner.run for corner in evaluation.corners),
        *(velocity.run for velocity in evaluation.velocities),
        *(weave.run for weave in evaluation.weaves),
    ]
    return list({id(run): run for run in runs}.values())


def _fastest(curves: Sequence[_Curves]) -> list[_Curves]:
    """Return those at the fastest velocity and the largest load."""

    def of(curve: _Curves) -> tuple[float, float]:
        return curve.run.conditions.velocity or 0.0, curve.run.conditions.load or 0.0

    most = max(map(of, curves), default=(0.0, 0.0))
    return [curve for curve in curves if of(curve) == most]


def _under(run: Run) -> str:
    under = run.conditions
    return f"at {100 * (under.velocity or 0.0):g} % of the rated velocity and {100 * (under.load or 0.0):g} % load"


def _course(course: PathDeviations, other: Comparison | None) -> Course | None:
    """Return the same of another result, None where it has none."""
    if other is None:
        return None
    return other.curves.get(key_of(course.run.test, course.path, conditions_summary(course.run.conditions)))


def _deviations(courses: Sequence[PathDeviations], others: Sequence[Course | None]) -> Figure:
    drawn = []
    for course, other in zip(courses, others, strict=True):
        along = course.along * 1e3
        low = np.maximum(course.distance - course.half_width, 0.0) * 1e3
        high = (course.distance + course.half_width) * 1e3
        traces = [
            line("", along, low, _BAND, 0),
            line("95 %", along, high, _BAND, 0, fill="tonexty", fillcolor=_BAND),
            *(line("cycles", along, np.linalg.norm(cycle, axis=1) * 1e3, BEFORE, 1) for cycle in course.deviation),
            line("barycentre", along, course.distance * 1e3, AFTER, 2.2),
        ]
        title = f"{html.escape(course.path)}: AT {np.nanmax(course.distance) * 1e3:.3f} mm"
        if other is not None:
            dashed = {"line": {"color": COLOURS[0], "width": 1.8, "dash": "dash"}}
            traces.append(line("other result", np.array(other.along), np.array(other.distance), COLOURS[0]) | dashed)
            title += f", other {np.nanmax(other.distance):.3f} mm"
        drawn.append(Panel(title, traces, "along the path [mm]", "distance [mm]"))
    return panels(drawn, 2 if len(drawn) > 1 else 1, 230)


def _corners(corners: Sequence[CornerCurves]) -> Figure:
    drawn = []
    for corner in corners:
        half_width = _MARGIN * 1e3 * float(max(corner.rounding.max(), corner.overshoot.max(), 1e-4))
        command = np.array([[-half_width, 0.0], [0.0, 0.0], [0.0, half_width]])
        traces = [line("command", command[:, 0], command[:, 1], INK, 1.5)]
        for number, points in enumerate(corner.attained):
            away = (points - corner.corner) * 1e3
            at = np.stack([away @ corner.before, away @ corner.after], axis=1)
            at = at[(np.abs(at) <= half_width).all(axis=1)]
            at = at[thinned(len(at))] if len(at) else at
            traces.append(line(f"cycle {number + 1}", at[:, 0], at[:, 1], HUES[number % len(HUES)], 1.5))
        rounding, overshoot = (1e3 * float(lengths.mean()) for lengths in (corner.rounding, corner.overshoot))
        title = f"{html.escape(corner.where)}: CR {rounding:.3f}, CO {overshoot:.3f} mm"
        limits = {"range": [-half_width, half_width]}
        drawn.append(
            Panel(title, traces, "way before [mm]", "way after [mm]", equal=True, more_x=limits, more_y=limits)
        )
    return panels(drawn, 3, 260)


def _velocity(curves: Sequence[VelocityCurves]) -> Figure:
    drawn = []
    for curve in curves:
        traces = []
        for along, velocity in zip(curve.along, curve.velocity, strict=True):
            rows = thinned(len(along))
            traces.append(line("cycles", along[rows] * 1e3, velocity[rows] * 1e3, BEFORE, 1))
        ends = np.array([0.0, curve.run.path.length]) * 1e3
        traces.append(line("commanded", ends, np.full(2, curve.commanded * 1e3), COLOURS[0], 1.5))
        middle = {
            "type": "rect",
            "yref": "paper",
            "x0": round(curve.middle[0] * 1e3, 3),
            "x1": round(curve.middle[1] * 1e3, 3),
            "y0": 0,
            "y1": 1,
            "fillcolor": SHADE,
            "line": {"width": 0},
            "layer": "below",
        }
        drawn.append(Panel(html.escape(curve.path), traces, "along the path [mm]", "velocity [mm/s]", shapes=[middle]))
    return panels(drawn, 1, 280)


def _weave(curve: WeaveCurves) -> Figure:
    path = curve.run.path.path
    reach = _WAVES * path.wavelength
    near = np.flatnonzero((curve.along[0] >= 0.0) & (curve.along[0] <= reach))
    rows = near[thinned(len(near), 800)] if len(near) else near
    half = path.stroke / 2.0 * 1e3
    edges = [
        line("commanded stroke", np.array([0.0, reach * 1e3]), np.full(2, side * half), INK, 1, hoverinfo="skip")
        | {"showlegend": side > 0}
        for side in (1.0, -1.0)
    ]
    attained = line("attained", curve.along[0][rows] * 1e3, curve.across[0][rows] * 1e3, AFTER)
    return figure([*edges, attained], 320, xaxis=axis("along [mm]"), yaxis=axis("to the side [mm]"))


def _streams(streams: Sequence[FoundStream]) -> Figure:
    drawn = []
    for stream in streams:
        rows = thinned(len(stream.time), _STREAM_SAMPLES)
        start = float(stream.time[0])
        time = stream.time - start
        limit = np.full(2, stream.threshold * 1e3)
        traces = [
            line("speed", time[rows], stream.speed[rows] * 1e3, BEFORE, 1.2),
            line("motion", time[[0, -1]], limit, COLOURS[0], 1)
            | {"line": {"color": COLOURS[0], "width": 1, "dash": "dash"}},
        ]
        shapes = [
            {
                "type": "rect",
                "yref": "paper",
                "x0": at[0],
                "x1": at[1],
                "y0": bottom,
                "y1": 1,
                "fillcolor": colour,
                "line": {"width": 0},
                "layer": "below",
            }
            for spans, colour, bottom in ((stream.cycles, _BAND, 0), (stream.dwells, "#9aa0a6", 0.94))
            for at in rounded_to(time[np.array(spans, dtype=int).reshape(-1, 2)], 4)
        ]
        title = f"{html.escape(stream.path)}: {len(stream.cycles)} cycles"
        drawn.append(Panel(title, traces, "time [s]", "speed [mm/s]", shapes=shapes))
    return panels(drawn, 1, 220)


_AXES: tuple[Component, ...] = ("x", "y", "z")
_ANGLES: tuple[Component, ...] = ("a", "b", "c")


def iso9283_report(result: Iso9283Evaluation) -> str:
    """Return the report: the criteria at their worst places, pictures, and every value."""
    worst = tuple(tuple(map(_unbroken, place.cells)) for place in worst_places(result.values))
    tables = [tabled("Criteria at their worst places", HEADING, worst, texts=(1, 4, 5))]
    if result.comparison is not None:
        tables.append(_compared(result.comparison))
    details: list[Section] = []
    for name in dict.fromkeys(test_name(value) for value in result.values):
        details += _tables(name, [value for value in result.values if test_name(value) == name])
    evaluation = result.evaluation
    plan = result.plan
    absent = uncovered_tests(result.values)
    words = [
        result.tied,
        f"Rated: {plan.rated_load:g} kg, {plan.rated_velocity * 1e3:g} mm/s along a path. A reading of the instrument "
        f"has a standard deviation of {result.instrument.sigma * 1e3:g} mm.",
        "Intervals are of 95 %. Criteria of three cycles are the mean of these, or the largest, and have their range "
        "instead. Of several velocities the fastest is in the first table and in the pictures.",
        "Evaluated by what the literature says of ISO 9283:1998. Who wants to claim conformity needs the standard's "
        "own text.",
    ]
    if absent:
        words.append(f"Not measured: {'; '.join(absent)}.")
    return Document(
        f"{plan.robot.title} by the criteria of ISO 9283",
        [
            answer(words, result.warnings),
            *tables,
            *pose_pictures(
                plan, evaluation.clouds, evaluation.drift, evaluation.settling, evaluation.pushes, result.comparison
            ),
            *path_pictures(evaluation, result.comparison),
            *details,
        ],
        result.command,
        subtitle="Pose and path characteristics with their intervals.",
    ).html(result)


def _unbroken(cell: str) -> str:
    """Return a cell that is broken behind commas alone, a no-break space in place of the others."""
    return ", ".join(part.replace(" ", "\u00a0") for part in cell.split(", "))


def _tables(name: str, values: Sequence[Value]) -> list[Section]:
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
    tables = [tabled(title, heading, rows)]
    for parts, words, unit in ((_AXES, "single axes", "mm"), (_ANGLES, "angles", "deg")):
        detail = _details([value for value in values if value.component in parts], parts)
        if detail:
            columns = tuple(f"{part} [{unit}]" for part in parts)
            tables.append(tabled(f"{title}: {words}", ("Criterion", "Where", "Velocity, load", *columns), detail))
    return tables


def _details(values: Sequence[Value], parts: Sequence[Component]) -> tuple[tuple[str, ...], ...]:
    """Return rows with a column for each part: the value, and its interval in brackets."""
    rows: dict[tuple[str, str, str], dict[Component, str]] = {}
    for value in values:
        if math.isfinite(value.value):
            beside = beside_words(value)
            text = f"{number_words(value)} ({beside})" if beside else number_words(value)
            rows.setdefault((value.id, value.where, conditions_words(value)), {})[value.component] = text
    return tuple((*key, *(row.get(part, "–") for part in parts)) for key, row in rows.items())


def _compared(comparison: Comparison) -> Section:
    """Return what differs of position by more than its intervals leave open, and what does not."""
    rows = tuple(
        (row.id, row.where, row.under, f"{row.value:.4f} {row.unit}", f"{row.other:.4f} {row.unit}", row.verdict)
        for row in comparison.rows
        if row.component == "position"
    )
    heading = ("Criterion", "Where", "Velocity, load", "This", "Other", "This one is")
    return tabled(f"Beside {comparison.other}", heading, rows)
