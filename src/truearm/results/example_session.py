"""Files to begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.results.record import Record
from truearm.simulated import Marked


@dataclass(frozen=True, eq=False, repr=False)
class ExampleSession(Record):
    """A small complete session to imitate."""

    files: tuple[Path, ...]  #: A robot, its data, data to check with, the commands.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``: a virtual instrument reads."""
        return ("data",)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {"files": [str(file) for file in self.files]}

    def lines(self) -> list[str]:
        """Return a line for each file."""
        return [str(file) for file in self.files]


@dataclass(frozen=True, eq=False, repr=False)
class RobotTemplate(Record):
    """A commented robot file to fill in."""

    file: Path  #: The file.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {"file": str(self.file)}

    def lines(self) -> list[str]:
        """Return what to do with it."""
        return [f"{self.file}: fill it in, then look at it with 'truearm show {self.file}'."]
