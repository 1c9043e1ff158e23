"""The page of a plan of measurements, and the sheet that goes with one that is driven."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import worst_first
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.units import from_si
from truearm.engine.document.document import Block, Document, Section, Table, Words, answer, pictured
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    CAMERA,
    Figure,
    axis,
    base_axes,
    figure,
    rounded,
    rounded_to,
    scene_axis,
)
from truearm.engine.document.page import page
from truearm.engine.programs.program import written
from truearm.planning.choosing import plan_csv
from truearm.planning.plan_program import MARK

if TYPE_CHECKING:
    from truearm.engine.motion.tour import Tour
    from truearm.planning.accuracy import Prediction
    from truearm.planning.choosing import MeasurementPlan
    from truearm.planning.result import Plan


_INDEX_WORDS: Final = {
    "O1": "geometric mean of the singular values, per square root of the poses",
    "O2": "smallest by largest singular value",
    "O3": "smallest singular value",
    "O4": "noise amplification: smallest squared by largest",
    "O5": "inverse of the sum of the inverse singular values",
}


def plan_html(planned: Plan) -> str:
    """Return the page of a plan."""
    plan = planned.made
    number = (
        "Predicted mean error of readings that were not measured, elsewhere in the workspace. The dotted line is the "
        "noise of these readings."
    )
    space = "Predicted mean error of the calibrated model itself at random configurations, at the place of the flange."
    if plan.prediction.there:
        space += " The red diamonds are where it shall be accurate."
    return Document(
        f"Measurements of {plan.robot.title}",
        [
            answer((*planned.answer, *planned.driving), planned.own_notices),
            pictured("number", "How many poses", number, number_figure(plan.prediction, len(plan.joints))),
            pictured("workspace", "Where the robot will be accurate", space, workspace_figure(plan)),
            _observability(plan),
            _candidates(plan),
        ],
        planned.command,
        headline=f"Where to measure {plan.robot.title}",
        subtitle=f"{len(plan.joints)} configurations for the {plan.model.name} model, chosen by {planned.chosen_by} "
        f"from {plan.usable} usable ones of {plan.candidates} candidates.",
    ).html(planned)


def _observability(plan: MeasurementPlan) -> Section:
    rows = [(name, _INDEX_WORDS[name], f"{value:.4g}") for name, value in plan.indices.items()]
    words = (
        "Columns are parameters in their physical size (1 mm, 0.1 deg), rows are readings in their deviation; priors "
        "count as measurements. All indices depend on these units. The choice by O1 does not."
    )
    blocks: list[Block] = [Table(("index", "what it is", "value"), rows, texts=(1,)), Words(words)]
    if plan.left_out:
        without = ", ".join(plan.left_out)
        blocks.append(Words(f"Left out, because the candidates can hardly tell them from the others: {without}."))
    return Section("Observability", blocks, "indices")


def _candidates(plan: MeasurementPlan) -> Section:
    rows = [(name, str(count)) for name, count in plan.rejected.items()]
    blocks: list[Block] = [
        Table(("constraint", "configurations that break it"), rows),
        Words(f"{plan.usable} of {plan.candidates} candidates break none."),
    ]
    if plan.drawn:
        near = f" Too near to something, each counted once: {plan.drawn.words}." if plan.drawn.words else ""
        taken = f"{len(plan.drawn.joints)} of those that keep clear were taken."
        blocks.append(Words(f"{plan.drawn.tried} were drawn within the limits, {taken}{near}"))
    return Section("Candidates", blocks, "constraints")


def number_figure(prediction: Prediction, planned: int) -> Figure:
    """Show how the predicted error falls with the number of poses."""
    numbers = prediction.numbers.tolist()
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "x": numbers,
            "y": rounded(1e3 * errors, 4),
            "line": {"color": colour, "width": 2},
        }
        for name, errors, colour in (
            ("drawn at random", prediction.random, BEFORE),
            ("chosen", prediction.chosen, AFTER),
        )
    ]
    traces.append(
        {
            "type": "scatter",
            "mode": "markers",
            "name": "this plan",
            "x": [planned],
            "y": rounded(np.array([1e3 * prediction.planned]), 4),
            "marker": {"color": "#b3261e", "size": 10, "symbol": "diamond"},
        }
    )
    line = {"type": "line", "x0": 0, "x1": 1, "xref": "paper", "line": {"dash": "dot", "color": "#646b72"}}
    shapes = [line | {"y0": 1e3 * prediction.floor, "y1": 1e3 * prediction.floor}]
    highest = 1e3 * max([2.0 * prediction.floor, prediction.planned * 1.05])
    return figure(
        traces,
        420,
        xaxis=axis("poses") | {"rangemode": "tozero"},
        yaxis=axis("mean error of other readings [mm]") | {"range": [0.9e3 * prediction.floor, highest]},
        shapes=shapes,
    )


def workspace_figure(plan: MeasurementPlan) -> Figure:
    """Show where in the workspace the calibrated model will be good: its own error, without the noise of a reading."""
    prediction = plan.prediction
    base = plan.robot.base
    points = 1e3 * (prediction.places - np.array(base.translation)) @ base.rotation
    errors = rounded(1e3 * prediction.error, 3)
    trace = {
        "type": "scatter3d",
        "mode": "markers",
        **{letter: rounded_to(column, 1) for letter, column in zip("xyz", points.T, strict=True)},
        "marker": {
            "size": 4,
            "color": errors,
            "colorscale": "Viridis",
            "reversescale": True,
            "colorbar": {"title": {"text": "mm"}, "thickness": 14},
        },
        "customdata": errors,
        "hovertemplate": "flange at %{x}, %{y}, %{z} mm: %{customdata} mm<extra></extra>",
        "showlegend": False,
    }
    traces = [trace]
    if prediction.there is not None:
        places = 1e3 * (prediction.there.places - np.array(base.translation)) @ base.rotation
        trace["name"] = "elsewhere"
        traces.append(
            trace
            | {letter: rounded_to(column, 1) for letter, column in zip("xyz", places.T, strict=True)}
            | {
                "name": "where it shall be accurate",
                "marker": {"size": 5, "color": "#b3261e", "symbol": "diamond"},
                "customdata": rounded(1e3 * prediction.there.error, 3),
                "showlegend": True,
            }
        )
    length = float(10.0 ** math.floor(math.log10(max(float(np.abs(points).max()), 1.0) / 2.0)))
    axes = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    return figure([*traces, *base_axes(length)], 620, scene={**axes, "aspectmode": "data", "camera": CAMERA})


#: What a calibration needs to be repeated, and what explains it later.
_NOTED: Final = (
    "Date, place, operator",
    "Robot: serial number, hours in use, controller and its software",
    "Tool and load: what is mounted, mass, centre of gravity",
    "Instrument: serial number, calibrated when, standard deviation of a reading",
    "Instrument: where it stands, how it is fixed",
    "Environment: temperature at the start and at the end, draught, sun, vibration",
    "Warm-up: how long, with which motion",
    "First run step by step at reduced speed: when, by whom",
)

#: A row has no more boxes for targets.
_MOST_TICKED: Final = 8


@dataclass(frozen=True)
class _Row:
    label: str
    joints: list[str]
    reads: str


def plan_sheet(planned: Plan) -> str:
    """Return the sheet of a plan that is driven: Home, from which it is driven, and every configuration.

    Joint positions are those that the controller shows, or the model's where nobody said how it counts.
    """
    program, plan, tour = planned.program, planned.made, planned.tour
    assert tour is not None
    reads = dict(zip(plan.labels, plan.reads, strict=True)) if plan.reads else {}
    files = "" if program is None else f", {', '.join(program.files)}"
    mark = hash_of(plan_csv(plan, planned.joints_are).encode())[:MARK] if program is None else program.mark
    shown = "as the controller shows them"
    if program is None and not plan.robot.controller.counts_known:
        shown = "of the model: nobody said how the controller counts them. Compare every joint with the pendant first"
    return page(
        Path(__file__).with_name("plan-sheet.html.jinja"),
        {},
        planned,
        title=f"Measuring {plan.robot.title}",
        subtitle=f"Plan {mark}{files}: {len(tour.measured)} configurations, joint positions {shown}.",
        words=(*(() if program is None else program.answer), *planned.driving),
        notices=worst_first(planned.own_notices),
        command=planned.command,
        followed="plan" if program is None else "program",
        noted=_NOTED,
        headings=[
            f"J{k} [{'deg' if joint.kind == 'revolute' else 'mm'}]" for k, joint in enumerate(plan.robot.joints, 1)
        ],
        targets=_ticked([target.name for target in plan.robot.targets]),
        reads=bool(reads),
        rows=_rows(planned, tour, reads),
    )


def _ticked(targets: list[str]) -> list[str]:
    """Return what is ticked in a row: each target, or all together where they are many."""
    return targets if len(targets) <= _MOST_TICKED else [f"all {len(targets)}"]


def _rows(planned: Plan, tour: Tour, reads: dict[str, str]) -> list[_Row]:
    robot = planned.made.robot
    stops = (tour.stops[0], *tour.measured)
    shown = robot.controller.from_model(np.array([stop.joints for stop in stops]))
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    return [
        _Row(
            str(stop.label) if stop.kind == "measure" else "Home",
            [written(from_si(value, unit), 2) for value, unit in zip(values, units, strict=True)],
            reads.get(str(stop.label), ""),
        )
        for stop, values in zip(stops, shown.tolist(), strict=True)
    ]
