"""How a robot agrees with measurements it was not identified from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from truearm.identification.refit import Refit
from truearm.measurement.statistics import Errors, Spread
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.results.summaries import error_line, errors_summary, refit_lines, refit_summary
from truearm.shown import counted


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """Errors of a robot on measurements.

    Attributes
    ----------
    source
        The measurements, for messages.
    errors
        Predicted minus measured, reading by reading.
    warnings
        What to know about them, in plain words.
    refit
        What was found anew from these measurements, if anything was; `errors` then judge each configuration by what is
        found without it.
    notes
        What the user noted, by its name.
    """

    source: str
    errors: Errors
    warnings: tuple[Notice, ...] = ()
    refit: Refit | None = None
    notes: dict[str, str] = field(default_factory=dict)

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
            **({} if self.refit is None else {"refit": refit_summary(self.refit)}),
            **({"notes": self.notes} if self.notes else {}),
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        return [
            f"On {counted(self.errors.configurations, 'configuration')} of {self.source}:",
            f"  {error_line(self.errors)}",
            *([] if self.refit is None else refit_lines(self.refit)),
            *(f"{name}: {said}" for name, said in self.notes.items()),
            *notice_lines(self.warnings),
        ]
