"""The sheet that goes with a plan that is driven: what is measured in which order, and what to write down beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.compensation.programs.numbers import written
from truearm.manifest import hash_of
from truearm.notices import worst_first
from truearm.planning.choosing.plan_table import plan_csv
from truearm.reporting.page import page
from truearm.results.plan_program import MARK
from truearm.units import from_si

if TYPE_CHECKING:
    from truearm.planning.driving.tour import Tour
    from truearm.results.plan import Plan

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
    program, made, tour = planned.program, planned.made, planned.tour
    assert tour is not None
    reads = dict(zip(made.labels, made.reads, strict=True)) if made.reads else {}
    files = "" if program is None else f", {', '.join(program.files)}"
    mark = hash_of(plan_csv(made, planned.joints_are).encode())[:MARK] if program is None else program.mark
    shown = "as the controller shows them"
    if program is None and not made.robot.controller.counts_known:
        shown = "of the model: nobody said how the controller counts them. Compare every joint with the pendant first"
    return page(
        "plan-sheet.html.jinja",
        {},
        planned,
        title=f"Measuring {made.robot.title}",
        subtitle=f"Plan {mark}{files}: {len(tour.measured)} configurations, joint positions {shown}.",
        words=(*(() if program is None else program.answer), *planned.driving),
        notices=worst_first(planned.warnings),
        command=planned.command,
        followed="plan" if program is None else "program",
        noted=_NOTED,
        headings=[
            f"J{k} [{'deg' if joint.kind == 'revolute' else 'mm'}]" for k, joint in enumerate(made.robot.joints, 1)
        ],
        targets=_ticked([target.name for target in made.robot.targets]),
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
