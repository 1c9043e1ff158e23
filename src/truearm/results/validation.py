"""How a robot agrees with measurements it was not identified from."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from truearm.errors import InputError
from truearm.identification.judging.next_step import NextStep
from truearm.identification.refit import Refit
from truearm.manifest import sets_in
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors, Spread
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.results.summaries import error_line, errors_summary, refit_lines, refit_summary
from truearm.results.validation_parts import distance_lines, distance_summary, orientation_lines, orientation_summary
from truearm.shown import counted
from truearm.validation.orientation_errors import OrientationErrors
from truearm.validation.region_distances import RegionDistances
from truearm.writing import output_folder, write_files

#: What a validation writes into its folder.
VALIDATION_FILES: Final = ("result.json", "report.html")


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """Errors of a robot on measurements."""

    source: str  #: The measurements, for messages.
    errors: Errors  #: Predicted minus measured, reading by reading.
    warnings: tuple[Notice, ...] = ()  #: What to know about them, in plain words.
    #: What was found anew from these measurements, if anything was; `errors` then judge each configuration by what is
    #: found without it.
    refit: Refit | None = None
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.
    #: Orientation errors by their parts; None if no orientation was read.
    orientations: OrientationErrors | None = None
    #: How far the readings lie from where the robot was calibrated; None where it does not know.
    distances: RegionDistances | None = None
    next: tuple[NextStep, ...] = ()  #: What to do next.
    robot: Robot | None = None  #: robot, data: what was compared.
    data: Dataset | None = None
    #: For each zone, and for elsewhere by an empty name, how many configurations lie in it and their mean error [m];
    #: None of a robot without zones.
    zones: dict[str, tuple[int, float]] | None = None
    command: str = ""  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.

    @property
    def position(self) -> Spread | None:
        """Statistics of position errors over single readings [m]; None where no position was read."""
        return self.errors.position

    @property
    def orientation(self) -> Spread | None:
        """Statistics of orientation errors over single readings [rad]; None where no orientation was read."""
        return self.errors.orientation

    @property
    def length(self) -> Spread | None:
        """Statistics of errors of distances and heights [m]; None where none was read."""
        return self.errors.length

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm and mrad."""
        return {
            **errors_summary(self.errors),
            **({} if self.orientations is None else {"orientation_parts_deg": orientation_summary(self.orientations)}),
            **({} if self.distances is None else {"distance_from_training": distance_summary(self.distances)}),
            **({} if self.zones is None else {"zones": self._zones()}),
            **({} if self.refit is None else {"refit": refit_summary(self.refit)}),
            **({"notes": self.notes} if self.notes else {}),
            "next": [step.summary() for step in self.next],
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        return [
            f"On {counted(self.errors.configurations, 'configuration')} of {self.source}:",
            f"  {error_line(self.errors)}",
            *orientation_lines(self.orientations),
            *distance_lines(self.distances),
            *(
                f"  {'elsewhere' if row['zone'] is None else 'zone ' + row['zone']}: {row['mean_mm']:.3f} mm on "
                f"{counted(row['configurations'], 'configuration')}"
                for row in self._zones()
            ),
            *([] if self.refit is None else refit_lines(self.refit)),
            *(f"{name}: {said}" for name, said in self.notes.items()),
            *(step.line for step in self.next),
            *notice_lines(self.warnings),
        ]

    def _zones(self) -> list[dict[str, Any]]:
        return [
            {"zone": name or None, "configurations": count, "mean_mm": mean * 1e3}
            for name, (count, mean) in (self.zones or {}).items()
        ]

    @staticmethod
    def folder(out: str | Path, inputs: Iterable[Path] = (), parameter: str = "folder") -> Path:
        """Return the folder for a validation, or refuse one whose result.json or report.html are of something else."""
        folder = output_folder(out, VALIDATION_FILES, tuple(inputs), parameter, ours=True)
        for one in sets_in(folder):
            others = [name for name in one.files if name not in VALIDATION_FILES]
            if others and any(name in one.files for name in VALIDATION_FILES):
                raise InputError(
                    "result.json and report.html there belong to another result",
                    parameter=parameter,
                    where=str(folder),
                    came=f"the folder of {others[0]}",
                    cure="Choose another folder.",
                )
        return folder

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write ``result.json`` and ``report.html`` into a folder.

        Returns:
            The files written.
        """
        from truearm.reporting.validation_report import validation_html

        folder = self.folder(folder, self.inputs)
        progress("drawing the report")
        content = {"truearm": "truearm-validation/1", "source": self.source, **self.summary(), "command": self.command}
        files = {
            "result.json": json.dumps(content, indent=2, allow_nan=False) + "\n",
            "report.html": validation_html(self),
        }
        progress("writing the files")
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)
