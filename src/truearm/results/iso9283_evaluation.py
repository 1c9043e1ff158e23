"""The criteria of ISO 9283 that a robot was tested by, each with its interval, and beside those of another result."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.results.iso9283_table import HEADING, UNITS, conditions_summary, counted_criteria, worst_places
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted
from truearm.validation.iso9283.comparable import plan_summary
from truearm.validation.iso9283.comparison import Comparison
from truearm.validation.iso9283.evaluation import Evaluation
from truearm.validation.iso9283.result_file import ReadFile
from truearm.validation.iso9283.values import Conditions, Instrument, Value
from truearm.writing import output_folder, write_files

RESULT: Final = "iso9283.json"
REPORT: Final = "report.html"
EVALUATION_FILES: Final = (RESULT, REPORT)
SCHEMA: Final = "truearm-iso9283-result/1"


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Evaluation(Record):
    """Tests of a robot's performance, evaluated."""

    plan: PerformancePlan  #: What was commanded.
    evaluation: Evaluation  #: All values, and what they come from.
    instrument: Instrument  #: What is not known of its readings.
    comparison: Comparison | None  #: Beside another result; None without one.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Their names and hashes, by the parameters that named them; ``robot`` is the robot file of the plan.
    read: Mapping[str, ReadFile] = field(default_factory=dict)

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
            "inputs": {name: one.model_dump() for name, one in self.read.items()},
            "rated": {"load_kg": self.plan.rated_load, "velocity_mm_s": self.plan.rated_velocity * 1e3},
            "plan": plan_summary(self.plan),
            "criteria": [value_summary(value) for value in self.values],
            **self._drawn(),
            **({} if self.comparison is None else {"comparison": self.comparison.summary()}),
            "warnings": notice_summaries(self.warnings),
        }

    def _drawn(self) -> dict[str, Any]:
        """Return what another result draws beside its own: deviations along paths, and barycentres from commands."""
        curves = [
            {
                "id": course.run.test,
                "where": course.path,
                "conditions": conditions_summary(course.run.conditions),
                "along_mm": _millimetres(course.along),
                "distance_mm": _millimetres(course.distance),
            }
            for course in self.evaluation.deviations
        ]
        offsets = [
            {
                "id": cloud.test,
                "where": cloud.pose,
                "conditions": conditions_summary(Conditions(cloud.velocity, cloud.load, cloud.robot)),
                "offset_mm": _millimetres(cloud.barycentre - cloud.command),
            }
            for cloud in self.evaluation.clouds
            if cloud.test == "AP"
        ]
        return {**({"curves": curves} if curves else {}), **({"offsets": offsets} if offsets else {})}

    def lines(self) -> list[str]:
        """Return each criterion at its worst place, at the fastest velocity and at others; the rest is in the files."""
        measured = [value for value in self.values if value.status != "not-measured"]
        absent = list(dict.fromkeys(value.id for value in self.values if value.status == "not-measured"))
        absent = [id_ for id_ in absent if id_ not in {value.id for value in measured}]
        criteria = len({value.id for value in measured})
        text = [f"{self.plan.robot.title}: {counted(len(measured), 'value')} of {counted_criteria(criteria)}."]
        text.append(self.tied)
        rows = [worst.cells for worst in worst_places(self.values)]
        if rows:
            text.append(
                "Each at its worst place and fastest velocity, with its 95 % interval or the range of its cycles."
            )
        wide = [max((len(row[k]) for row in rows), default=0) for k in range(len(HEADING))]
        text += ["  " + "  ".join(cell.ljust(wide[k]) for k, cell in enumerate(row)).rstrip() for row in rows]
        if rows:
            text.append(f"All places, axes and angles are in the report and in {RESULT}.")
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


def _millimetres(metres: Array) -> list[float | None]:
    """Return lengths as JSON holds them, None where there is none."""
    return [round(1e3 * value, 6) if math.isfinite(value) else None for value in metres.tolist()]


def value_summary(value: Value) -> dict[str, Any]:
    """Return a value as JSON holds it."""
    unit, per_si = UNITS[value.quantity]

    def shown(number: float | None) -> float | None:
        return None if number is None or not math.isfinite(number) else number * per_si

    least, largest = shown(value.least), shown(value.largest)
    return {
        "id": value.id,
        "component": value.component,
        "where": value.where,
        "value": shown(value.value),
        "unit": unit,
        "interval_95": None if value.interval is None else [shown(end) for end in value.interval],
        "cycles": value.cycles,
        "conditions": conditions_summary(value.conditions),
        "status": value.status,
        **({} if least is None else {"range": [least, largest]}),
        **({} if value.bandwidth is None else {"bandwidth_hz": value.bandwidth}),
    }
