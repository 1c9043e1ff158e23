"""The criteria of ISO 9283 that a robot was tested by, each with its interval, and beside those of another result."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.notices import Notice
from truearm.planning.iso9283.criteria import TEST_OF, TESTS
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted
from truearm.validation.iso9283.comparison import Comparison
from truearm.validation.iso9283.evaluation import Evaluation
from truearm.validation.iso9283.values import Instrument, Quantity, Value
from truearm.writing import output_folder, write_files

RESULT: Final = "iso9283.json"
REPORT: Final = "report.html"
EVALUATION_FILES: Final = (RESULT, REPORT)
SCHEMA: Final = "truearm-iso9283-result/1"
#: Unit of each kind of number at the edges, and how many of it one SI unit is.
UNITS: Final[Mapping[Quantity, tuple[str, float]]] = {
    "length": ("mm", 1e3),
    "angle": ("deg", math.degrees(1.0)),
    "time": ("s", 1.0),
    "ratio": ("%", 100.0),
    "speed": ("mm/s", 1e3),
    "compliance": ("mm/N", 1e3),
}


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Evaluation(Record):
    """Tests of a robot's performance, evaluated.

    Attributes
    ----------
    plan
        What was commanded.
    evaluation
        All values, and what they come from.
    instrument
        What is not known of its readings.
    comparison
        Beside another result; None without one.
    command
        How to run it again.
    warnings
        What to know about it.
    inputs
        The files that were read: none of them is overwritten.
    """

    plan: PerformancePlan
    evaluation: Evaluation
    instrument: Instrument
    comparison: Comparison | None
    command: str
    warnings: tuple[Notice, ...] = ()
    inputs: tuple[Path, ...] = ()

    @property
    def values(self) -> tuple[Value, ...]:
        """All values, in the order of the standard's table."""
        return self.evaluation.values

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, units beside the values."""
        tie = self.evaluation.alignment
        return {
            "truearm": SCHEMA,
            "robot": self.plan.robot.name,
            "alignment": {
                "kind": tie.kind,
                "standard": tie.is_standard,
                "sigma_mm": tie.sigma * 1e3,
                "sigma_rot_deg": math.degrees(tie.sigma_rot),
            },
            "instrument": {
                "sigma_mm": self.instrument.sigma * 1e3,
                "sigma_rot_deg": None if self.instrument.sigma_rot is None else math.degrees(self.instrument.sigma_rot),
            },
            "rated": {"load_kg": self.plan.rated_load, "velocity_mm_s": self.plan.rated_velocity * 1e3},
            "criteria": [value_summary(value) for value in self.values],
            **({} if self.comparison is None else {"comparison": self.comparison.summary()}),
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return every value of position with its interval, and how many others there are."""
        measured = [value for value in self.values if value.status != "not-measured"]
        absent = list(dict.fromkeys(value.id for value in self.values if value.status == "not-measured"))
        shown = [value for value in measured if value.component == "position"]
        rows = [value_words(value) for value in shown]
        wide = [max((len(row[k]) for row in rows), default=0) for k in range(5)]
        table = ["  ".join(cell.ljust(wide[k]) for k, cell in enumerate(row)).rstrip() for row in rows]
        others = len(measured) - len(shown)
        criteria = len({value.id for value in measured})
        text = [f"{self.plan.robot.title}: {counted(len(measured), 'value')} of {criteria} criteria."]
        text += [self.tied, *table]
        if others:
            text.append(f"And {counted(others, 'value')} of single axes and of angles, in the report and in {RESULT}.")
        if absent:
            text.append(f"Not measured: {', '.join(absent)}.")
        if self.comparison is not None:
            text += self.comparison.lines()
        return [*text, *notice_lines(self.warnings)]

    @property
    def tied(self) -> str:
        """How the instrument was tied to the robot's base, in words."""
        tie = self.evaluation.alignment
        how = {
            "base-features": "measured features of the base",
            "controller-frame": "a frame of the controller",
            "best-fit": "a best fit of the attained poses to the commanded ones, which the standard does not allow",
        }[tie.kind]
        known = f", known to {tie.sigma * 1e3:.3f} mm and {math.degrees(tie.sigma_rot):.4f} deg" if tie.sigma else ""
        return f"The instrument was tied to the robot's base by {how}{known}."

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.reporting.iso9283_report import iso9283_report

        return {RESULT: json.dumps(self.summary(), indent=1) + "\n", REPORT: iso9283_report(self)}

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all files into a folder; return them."""
        contents = self.contents()
        out = output_folder(folder, contents, self.inputs, "folder")
        write_files(out, contents, self.command)
        return tuple(out / name for name in contents)


def value_summary(value: Value) -> dict[str, Any]:
    """Return a value as JSON holds it."""
    unit, per_si = UNITS[value.quantity]

    def shown(number: float | None) -> float | None:
        return None if number is None or not math.isfinite(number) else number * per_si

    conditions: dict[str, Any] = {}
    if value.conditions.velocity is not None:
        conditions["velocity_percent"] = round(100.0 * value.conditions.velocity, 6)
    if value.conditions.load is not None:
        conditions["load_percent"] = round(100.0 * value.conditions.load, 6)
    if value.conditions.robot:
        conditions["robot"] = value.conditions.robot
    least, largest = shown(value.least), shown(value.largest)
    return {
        "id": value.id,
        "component": value.component,
        "where": value.where,
        "value": shown(value.value),
        "unit": unit,
        "interval_95": None if value.interval is None else [shown(end) for end in value.interval],
        "cycles": value.cycles,
        "conditions": conditions,
        "status": value.status,
        **({} if least is None else {"range": [least, largest]}),
    }


def value_words(value: Value) -> tuple[str, str, str, str, str]:
    """Return a value as a row of text: id, where, conditions, the figure, its interval and whether it holds."""
    unit, per_si = UNITS[value.quantity]
    under = conditions_words(value)
    number = f"{_number(value.value * per_si, value.quantity)} {unit}"
    beside = ""
    if value.interval is not None:
        low, high = (_number(end * per_si, value.quantity) for end in value.interval)
        beside = f"95 %: {low} to {high}"
    elif value.least is not None and value.largest is not None:
        low, high = (_number(end * per_si, value.quantity) for end in (value.least, value.largest))
        beside = f"{counted(value.cycles, 'cycle')}: {low} to {high}"
    if value.status != "measured":
        beside = f"{beside}, {value.status}" if beside else value.status
    return value.id, value.where, under, number, beside


def conditions_words(value: Value) -> str:
    """Return under what a value was measured, in words."""
    parts = []
    if value.conditions.velocity is not None:
        parts.append(f"{100 * value.conditions.velocity:g} %")
    if value.conditions.load is not None:
        parts.append(f"load {100 * value.conditions.load:g} %")
    if value.conditions.robot:
        parts.append(value.conditions.robot)
    return ", ".join(parts)


def test_name(value: Value) -> str:
    """Return the name of the test that a value belongs to."""
    return TESTS[TEST_OF[value.id]].name


def _number(number: float, quantity: Quantity) -> str:
    decimals = {"length": 4, "angle": 4, "time": 3, "ratio": 3, "speed": 2, "compliance": 6}[quantity]
    return f"{number:.{decimals}f}"


def values_of(values: Sequence[Value], criterion: str) -> list[Value]:
    """Return the values of one criterion."""
    return [value for value in values if value.id == criterion]
