"""What was found wrong with measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from truearm.identification.judging.next_step import NextStep
from truearm.measurement.dataset import Dataset
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import listed
from truearm.simulated import Marked


@dataclass(frozen=True, eq=False, repr=False)
class DataCheck(Record):
    """What was found wrong with measurements."""

    data: Dataset  #: The measurements.
    warnings: tuple[Notice, ...]  #: One notice for each kind of fault; none for believable data.
    next: tuple[NextStep, ...] = ()  #: What to do next, three steps at most, the most useful first.
    simulated_from: tuple[Marked, ...] = ()  #: What of measurements and robot comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "configurations": self.data.configurations,
            "targets": list(self.data.targets),
            "warnings": notice_summaries(self.warnings),
            "next": [step.summary() for step in self.next],
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        data = self.data
        text = [f"{data.source}: {data.configurations} configurations, targets {listed(data.targets)}"]
        text += notice_lines(self.warnings) or [self._clean]
        return text + [step.line for step in self.next]

    @property
    def _clean(self) -> str:
        """What is said where nothing has a name; configurations may be off all the same."""
        if any(step.gain is not None and step.code == "measure-again" for step in self.next):
            return "Nothing looks wrong but the configurations named next."
        return "Nothing looks wrong."
