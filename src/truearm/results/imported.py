"""Measurements that came from files of other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Record):
    """Measurements that came from files of other programs."""

    data: Dataset  #: The measurements.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.
    #: How many readings are missing of each point, where the file has places for them.
    missing: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[Notice, ...] = ()  #: What the data cannot hold of the files.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "configurations": self.data.configurations,
            "targets": list(self.data.targets),
            "missing": dict(self.missing),
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        where = "" if self.out is None else f": {self.out}"
        many = counted(self.data.configurations, "configuration")
        text = [f"{many}, targets {', '.join(self.data.targets)}{where}"]
        text += [f"  {name}: {count} missing {_nouns('reading', count)}" for name, count in self.missing.items()]
        return text + notice_lines(self.warnings)


@dataclass(frozen=True, eq=False, repr=False)
class ImportedRoboDK(Record):
    """Measurements that came from a table of RoboDK."""

    data: Dataset  #: The measurements.
    tool_points: Array  #: Where each target is in the flange frame, as RoboDK was told [m], ``(targets, 3)``.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.
    missing: int = 0  #: How many readings are missing.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "configurations": self.data.configurations,
            "tool_points_mm": {
                name: (1e3 * point).tolist() for name, point in zip(self.data.targets, self.tool_points, strict=True)
            },
            "missing": self.missing,
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        where = "" if self.out is None else f": {self.out}"
        text = [f"{counted(self.data.configurations, 'configuration')}{where}"]
        for name, point in zip(self.data.targets, self.tool_points, strict=True):
            text.append(f"  target {name}: tool point ({', '.join(f'{1e3 * v:g}' for v in point)}) mm")
        return text + ([f"  {self.missing} missing {_nouns('reading', self.missing)}"] if self.missing else [])


@dataclass(frozen=True, eq=False, repr=False)
class ImportedCircles(Record):
    """Circles that a robot drew, as distances and heights."""

    data: Dataset  #: The measurements.
    pages: tuple[str, ...]  #: Names of the pages.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.

    @property
    def gaps(self) -> int:
        """How many distances are missing, where the line has gaps."""
        return int(np.sum(~self.data.has_reading))

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {"configurations": self.data.configurations, "pages": list(self.pages), "missing": self.gaps}

    def lines(self) -> list[str]:
        """Return what was read."""
        where = "" if self.out is None else f": {self.out}"
        many = counted(self.data.configurations, "configuration")
        text = [f"{many} on {counted(len(self.pages), 'page')}{where}"]
        if self.gaps:
            text.append(f"  {self.gaps} missing {_nouns('distance', self.gaps)}, where the line has gaps")
        return text


def _nouns(noun: str, count: int) -> str:
    return noun if count == 1 else f"{noun}s"
