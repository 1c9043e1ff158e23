"""What the demonstration shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.results.calibration import Calibration
from truearm.results.program_correction import REPORT, ProgramCorrection
from truearm.results.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class Demonstration(Record):
    """A calibration, and a program corrected with it."""

    folder: Path  #: Where data and results are.
    calibration: Calibration  #: Of a digital twin.
    correction: ProgramCorrection | None  #: Of a program; None if the fit did not converge.

    @property
    def corrected_folder(self) -> Path:
        """Where the corrected program is."""
        return self.folder / "corrected"

    def summary(self) -> dict[str, Any]:
        """Return both results as JSON holds them."""
        return {
            "calibration": self.calibration.summary(),
            "correction": None if self.correction is None else self.correction.summary(),
        }

    def lines(self) -> list[str]:
        """Return both results, and where their reports are."""
        text = self.calibration.lines()
        if self.correction is not None:
            text += self.correction.lines()
            text.append(f"The corrected program is in {self.corrected_folder}, with a report of its own, {REPORT}.")
        return [*text, f"The report is {self.folder / 'report.html'}; open it in a browser."]
