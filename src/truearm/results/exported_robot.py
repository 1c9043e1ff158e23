"""A robot for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries


@dataclass(frozen=True, eq=False, repr=False)
class ExportedRobot(Record):
    """A robot for other programs, and what the format cannot hold."""

    robot: Robot  #: The robot.
    format: str  #: Name of the format.
    text: str  #: Content of the file.
    frames: str  #: Which frames its numbers refer to.
    left_out: tuple[str, ...]  #: What the format cannot hold, one sentence each.
    file: Path | None = None  #: The file; None if none was written.
    told: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about it: what the format cannot hold, and what speaks against the calibration."""
        return (*(Notice("left-out", message) for message in self.left_out), *self.told)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "file": None if self.file is None else str(self.file),
            "format": self.format,
            "frames": self.frames,
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what was written, and then what was left out."""
        text = f"{self.robot.name} as {self.format}. {self.frames}"
        return [text if self.file is None else f"{self.file}: {text}", *self.left_out, *notice_lines(self.told)]
