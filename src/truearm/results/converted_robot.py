"""A robot in another kinematic convention."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.modeling.robot import Robot
from truearm.results.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class ConvertedRobot(Record):
    """A robot in another kinematic convention, every pose the same."""

    robot: Robot  #: In the other convention. Its history ends with what was done.
    file: Path | None = None  #: Its robot file; None if none was written.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "file": None if self.file is None else str(self.file),
            "robot": self.robot.name,
            "convention": self.robot.convention_name,
            "history": self.robot.history[-1],
        }

    def lines(self) -> list[str]:
        """Return what was done."""
        text = f"{self.robot.name}, {self.robot.history[-1]}."
        return [text if self.file is None else f"{self.file}: {text}"]
