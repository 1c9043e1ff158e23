"""Joints whose tilt, backlash and stiffness were found by inclinometers, and the geometry that was found after that."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.identification.inclinometers.fit import TiltingFit
from truearm.identification.inclinometers.judging import seen
from truearm.identification.inclinometers.mounting import Mounting
from truearm.measurement.inclinometer import Inclinations, InclinometerReadings
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.robot import Robot
from truearm.notices import Notice, has_error
from truearm.results.calibration import Calibration
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.results.summaries import error_line
from truearm.shown import counted
from truearm.units import SHOWN_AS, from_si
from truearm.writing import output_folder, write_files

#: What tilting writes into its folder, and the report of the geometry where poses were given.
TILTING_FILES: Final = ("calibrated.yaml", "result.json", "report.html", "calibrated.urdf")
GEOMETRY: Final = "geometry.html"

_SHOWN: Final = {"clearance": "tilt", "backlash": "backlash", "compliance": "compliance"}

#: Steps that only a calibration can take: here the effects are chosen.
_OF_CALIBRATE: Final = ("other-model", "give-loads")


@dataclass(frozen=True, eq=False, repr=False)
class Tilting(Record):
    """What inclinometers told of the joints, and what poses told of the geometry with that held."""

    fit: TiltingFit  #: The first stage: tilt, backlash and compliance of every joint.
    robot: Robot  #: With all that was found, and what is known about it.
    read: Inclinations  #: What the inclinometers read.
    changes: InclinometerReadings  #: By how much that changed within pairs.
    mounting: Mounting  #: How the instruments sit on their links.
    pushed: int  #: How many configurations with poses under loads there were beside.
    geometry: Calibration | None  #: The second stage, with tilt, backlash and compliance held; None without poses.
    geometry_alone: Calibration | None  #: The same calibration without them, for comparison; None without poses.
    notices: tuple[Notice, ...]  #: What to know about the first stage.
    command: str  #: How to run it again.
    urdf: bytes | None = None  #: The user's own URDF, if that is where the robot came from.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about both stages."""
        return self.notices if self.geometry is None else (*self.notices, *self.geometry.warnings)

    @property
    def finished(self) -> bool:
        """Whether the figures of both stages can be believed."""
        return not has_error(self.notices) and (self.geometry is None or self.geometry.finished)

    @property
    def used(self) -> int:
        """How many changes of inclination were used."""
        return int(np.isfinite(self.fit.left).sum())

    @cached_property
    def sizes(self) -> tuple[float, float]:
        """Root mean square of the changes that were used, and of what is left of them [rad]."""
        used = np.isfinite(self.fit.left)
        return tuple(float(np.sqrt(np.mean(values[used] ** 2))) for values in (self.changes.change, self.fit.left))  # type: ignore[return-value]

    def constants(self) -> list[dict[str, Any]]:
        """Return every constant of the joints, as JSON holds it."""
        rows = []
        for name in sorted(self.fit.names, key=lambda name: (_number(name), [*_SHOWN].index(name.rpartition("_")[0]))):
            p = self.fit.robot.parameters[name]
            unit = SHOWN_AS[p.unit]
            rows.append(
                {
                    "name": name,
                    "joint": _number(name),
                    "effect": name.rpartition("_")[0],
                    "unit": unit,
                    "value": from_si(p.value, unit),
                    "deviation": from_si(p.deviation or p.prior, unit),
                    "informed": p.informed,
                    "seen": seen(p),
                }
            )
        return rows

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``result.json`` begins with them."""
        changed, left = (math.degrees(size) for size in self.sizes)
        return {
            "status": "converged" if self.fit.converged else "not-converged",
            "warnings": notice_summaries(self.notices),
            "inclinations": {
                "pairs": len(self.read.pairs),
                "changes": self.used,
                "rms_deg": changed,
                "left_deg": left,
                "excess": self.fit.excess,
                "pushed": self.pushed,
            },
            "constants": self.constants(),
            "geometry": None if self.geometry is None else self.geometry.summary(),
            "geometry_alone": None if self.geometry_alone is None else self.geometry_alone.summary(),
        }

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds: the summary, how the instruments sit, and every parameter."""
        return {
            "truearm": "truearm-tilting/1",
            **self.summary(),
            "command": self.command,
            **({"notes": self.notes} if self.notes else {}),
            "instruments": self.seats(),
            **({} if self.geometry is None else {"calibration": self.geometry.result()}),
        }

    def seats(self) -> list[dict[str, Any]]:
        """Return how far each instrument is turned on its link, and its zeros, as JSON holds them."""
        return [
            {
                "name": name,
                "turned_deg": math.degrees(float(turn)),
                "zero_deg": {axis: math.degrees(z) for axis, z in zip("xyz", zero.tolist(), strict=True) if z == z},
            }
            for name, turn, zero in zip(
                self.read.instruments.names, self.mounting.turns, self.mounting.zeros, strict=True
            )
        ]

    def lines(self) -> list[str]:
        """Return what was found of every joint, then what that does to the errors of poses."""
        changed, left = (math.degrees(size) for size in self.sizes)
        beside = f" and {counted(self.pushed, 'configuration')} of poses under loads" if self.pushed else ""
        over = f"{self.fit.excess:.2f} times" if self.fit.excess > 1.0 else "no more than"
        text = [
            f"From {counted(self.used, 'change')} of inclination in {counted(len(self.read.pairs), 'pair')}{beside}:",
            f"  rms {changed:.4f} deg, left {left:.5f} deg, {over} what is declared",
        ]
        rows = self.constants()
        for joint in dict.fromkeys(row["joint"] for row in rows):
            parts = [_words(row) for row in rows if row["joint"] == joint]
            text.append(f"  joint {joint}: {', '.join(parts)}")
        if self.geometry is not None and self.geometry_alone is not None:
            after, alone = self.geometry, self.geometry_alone
            part = "the fit has not seen" if after.validation is not None else "it was trained on"
            judged = after.validation or after.train
            text.append(f"On {counted(judged.configurations, 'configuration')} {part}:")
            text.append(f"  nominal          {error_line(alone.nominal)}")
            text.append(f"  geometry alone   {error_line(alone.validation or alone.train)}")
            text.append(f"  tilting first    {error_line(judged)}")
            text.append(f"Status of the geometry: {after.status.value}. {after.advice}".rstrip())
            text += [step.line for step in after.next if step.code not in _OF_CALIBRATE]
        return text + notice_lines(self.warnings)

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write ``calibrated.yaml``, ``result.json``, ``report.html`` and ``calibrated.urdf`` into a folder.

        Where poses were given, ``geometry.html`` is the full report of the second stage.

        Returns:
            The files written.
        """
        from truearm.modeling.formats.urdf import calibrated_urdf
        from truearm.modeling.formats.urdf_writing import urdf_text
        from truearm.reporting.report import report_html
        from truearm.reporting.tilting_report import tilting_html

        folder = output_folder(folder, (*TILTING_FILES, GEOMETRY), self.inputs, ours=True)
        progress("drawing the report")
        files: dict[str, str | bytes] = {
            "calibrated.yaml": robot_text(self.robot),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": tilting_html(self),
            "calibrated.urdf": calibrated_urdf(self.urdf, self.robot)[0] if self.urdf else urdf_text(self.robot)[0],
        }
        if self.geometry is not None:
            files[GEOMETRY] = report_html(self.geometry)
        progress("writing the files")
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)


def _number(name: str) -> int:
    return int(name.rpartition("_")[2])


def _words(row: dict[str, Any]) -> str:
    """Return a constant in words, such as ``backlash 0.0609 deg (0.0001)``."""
    word = _SHOWN[row["effect"]]
    if not row["seen"]:
        return f"{word} not seen"
    places = max(0, 1 - math.floor(math.log10(max(row["deviation"], 1e-9))))
    return f"{word} {row['value']:.{places}f} ({row['deviation']:.{places}f}) {row['unit']}"
