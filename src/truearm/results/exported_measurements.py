"""Measurements for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.modeling.controller import JointsOf
from truearm.results.record import Record, joints_lines
from truearm.shown import counted
from truearm.simulated import Marked


@dataclass(frozen=True, eq=False, repr=False)
class ExportedMeasurements(Record):
    """Measurements for other programs."""

    text: str  #: Content of the file.
    configurations: int  #: configurations, readings: how many there are.
    readings: int
    joints_are: JointsOf  #: Whose joint positions the file holds.
    file: Path | None = None  #: The file; None if none was written.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "file": None if self.file is None else str(self.file),
            "configurations": self.configurations,
            "readings": self.readings,
            "joints_are": self.joints_are,
        }

    def lines(self) -> list[str]:
        """Return what was written."""
        where = "" if self.file is None else f"{self.file}: "
        many = f"{counted(self.configurations, 'configuration')}, {counted(self.readings, 'reading')}"
        return [f"{where}{many}", *joints_lines(self.joints_are)]
