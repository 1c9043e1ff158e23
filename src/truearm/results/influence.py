"""What each parameter does to the pose of the tip, and what identification by it is worth."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.identification.solving.influence import WAYS, Influence, Way
from truearm.identification.solving.pose_by_pose import PoseByPose
from truearm.measurement.statistics import Errors
from truearm.modeling.robot import Robot
from truearm.notices import Notice, has_error
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.results.summaries import error_line, errors_summary
from truearm.shown import counted
from truearm.simulated import Marked
from truearm.units import SHOWN_AS, from_si
from truearm.writing import output_folder, write_files

#: What is written into a folder.
INFLUENCE_FILES: Final = ("influence.csv", "result.json", "report.html")


@dataclass(frozen=True, eq=False)
class Identified:
    """The same parameters, identified in several ways from the same readings."""

    robots: Mapping[Way, Robot]  #: By the way they were found.
    #: Of each on configurations that none of them was made from, or on those that all were.
    errors: Mapping[Way, Errors]
    held_out: bool  #: Whether it is the former.
    training: int  #: How many configurations they were made from.
    by_influence: PoseByPose  #: by_influence, by_norm: what single poses said.
    by_norm: PoseByPose
    #: ``placed`` if base and targets were fitted with the nominal robot and held, ``robot`` if they are the file's.
    frames: str


@dataclass(frozen=True, eq=False, repr=False)
class InfluenceResult(Record):
    """What parameters do to the tip, configuration by configuration, and identification by that."""

    robot: Robot  #: The robot that was perturbed.
    made: Influence  #: What each parameter does.
    labels: tuple[str, ...]  #: Names of the configurations.
    tip: str  #: The target whose pose is meant, or the flange.
    identified: Identified | None  #: From readings; None without any.
    notices: tuple[Notice, ...]  #: What to know about it.
    command: str  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the result."""
        return self.notices

    @property
    def finished(self) -> bool:
        """Whether no notice is an error."""
        return not has_error(self.notices)

    def rows(self) -> list[dict[str, Any]]:
        """Return each parameter with its change and its influence, the most influential first, as JSON holds them."""
        turn = np.zeros_like(self.made.size) if self.made.turn is None else self.made.turn
        rows = []
        for index in np.argsort(-self.made.mean, kind="stable").tolist():
            name = self.made.names[index]
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            size, turned = 1e3 * self.made.size[index], np.degrees(turn[index])
            rows.append(
                {
                    "name": name,
                    "change": from_si(float(self.made.perturbation[index]), unit),
                    "unit": unit,
                    "mean_mm": float(size.mean()),
                    "least_mm": float(size.min()),
                    "greatest_mm": float(size.max()),
                    "mean_deg": float(turned.mean()),
                    "greatest_deg": float(turned.max()),
                }
            )
        return rows

    def found(self) -> list[dict[str, Any]]:
        """Return what each way found of each parameter, as JSON holds it; nothing without readings."""
        if self.identified is None:
            return []
        rows = []
        for name in self.made.names:
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            values: dict[str, float] = {
                way: from_si(robot.values[name], unit) for way, robot in self.identified.robots.items()
            }
            deviation = self.identified.robots["calibrate"].parameters[name].deviation
            known = None if deviation is None else from_si(deviation, unit)
            rows.append({"name": name, "unit": unit, **values, "deviation": known})
        return rows

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``result.json`` begins with them: errors in mm and mrad."""
        told: dict[str, Any] = {
            "configurations": len(self.labels),
            "tip": self.tip,
            "warnings": notice_summaries(self.notices),
            "influence": self.rows(),
        }
        if self.identified is not None:
            told |= {
                "held_out": self.identified.held_out,
                "training": self.identified.training,
                "frames": self.identified.frames,
                "errors": {str(way): errors_summary(errors) for way, errors in self.identified.errors.items()},
            }
        return told

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds."""
        found = {} if self.identified is None else {"parameters": self.found()}
        return {"truearm": "truearm-influence/1", **self.summary(), "command": self.command, **found}

    def lines(self) -> list[str]:
        """Return the most influential parameters, then what identification by influence is worth."""
        rows = self.rows()
        width = max(len(row["name"]) for row in rows)
        text = [f"What a change of each parameter does to {self.tip} at {counted(len(self.labels), 'configuration')}:"]
        for row in rows:
            change = f"+{row['change']:.3g} {row['unit']}"
            text.append(
                f"  {row['name']:<{width}} {change:<22} mean {row['mean_mm']:.4f} mm, {row['least_mm']:.4f} to "
                f"{row['greatest_mm']:.4f} mm; turned by {row['mean_deg']:.4f} deg"
            )
        if self.identified is not None:
            found = self.identified
            part = "none of them has seen" if found.held_out else "all of them were made from"
            judged = next(iter(found.errors.values())).configurations
            text.append(f"On {counted(judged, 'configuration')} that {part}:")
            width = max(map(len, WAYS.values()))
            text += [f"  {WAYS[way]:<{width}}  {error_line(errors)}" for way, errors in found.errors.items()]
        return text + notice_lines(self.notices)

    def csv_text(self) -> str:
        """Return the influence of every parameter at every configuration as CSV."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["configuration", "parameter", "change", "unit", "moved [mm]", "turned [deg]"])
        turn = np.zeros_like(self.made.size) if self.made.turn is None else self.made.turn
        changes = []
        for name, change in zip(self.made.names, self.made.perturbation.tolist(), strict=True):
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            changes.append((name, f"{from_si(change, unit):.9g}", unit))
        for at, label in enumerate(self.labels):
            for index, change in enumerate(changes):
                moved, turned = 1e3 * self.made.size[index, at], math.degrees(turn[index, at])
                writer.writerow([label, *change, f"{moved:.7g}", f"{turned:.7g}"])
        return stream.getvalue()

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write ``influence.csv``, ``result.json`` and ``report.html`` into a folder.

        Returns:
            The files written.
        """
        from truearm.reporting.influence_report import influence_html

        folder = output_folder(folder, INFLUENCE_FILES, self.inputs, ours=True)
        files: dict[str, str | bytes] = {
            "influence.csv": self.csv_text(),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": influence_html(self),
        }
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)
