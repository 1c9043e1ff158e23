"""What came of measuring a plan: what is kept, what was set aside and why, and how the nests moved."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import write_files
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.rows import Configurations
from truearm.engine.document.document import Block, Words, detail, say, under
from truearm.engine.document.records import Record
from truearm.measuring.campaign import NestDrift, nest_drift
from truearm.measuring.kept_readings import StatedSigma, kept_readings, stated_sigma
from truearm.measuring.reading_log import About
from truearm.measuring.session import REASONS, Session

DATA: Final = "measurements.csv"
PAGE: Final = "measure.html"
#: How a measuring goes on that is not finished.
GOES_ON: Final = "The same command goes on there."


UNFINISHED: Final = Rule("unfinished", "warning", "readings are still to be taken", gravity=2)
NESTS_MOVED: Final = Rule(
    "nests-moved",
    "warning",
    "the nests moved together by more than five times what noise explains",
    cure="Wait until the instrument is warm, fix its stand, and measure again.",
    gravity=2,
)


@dataclass(frozen=True, eq=False, repr=False)
class Measured(Record):
    """A plan as it was measured so far."""

    title: str  #: What the robot is called.
    plan: str  #: The plan, for messages.
    session: Session  #: All readings.
    configurations: Configurations  #: Those of the plan.
    about: About  #: What it was measured with.
    instrument: str  #: Where the readings came from, in words.
    folder: Path  #: In which the files are.
    command: str  #: How to go on, or to write the files again.
    measuring_notices: tuple[Notice, ...] = ()  #: What to know about how it was measured.
    simulated: bool = False  #: Whether a virtual instrument reads.

    @property
    def data(self) -> Dataset | None:
        """The readings that are kept; None if there is none of a target."""
        return kept_readings(self.session, self.configurations, str(self.folder / DATA), self.simulated)

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, if a virtual instrument reads."""
        return ("data",) if self.simulated else ()

    @property
    def drift(self) -> NestDrift | None:
        """How the nests moved; None before one was read."""
        return nest_drift(self.session)

    @property
    def sigma(self) -> StatedSigma:
        """With which standard deviation the measurements are written."""
        return stated_sigma(self.session)

    @property
    def finished(self) -> bool:
        """Whether nothing is left to be measured."""
        return self.session.done

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the measurements."""
        return (*self._unfinished(), *self._moved(), *self.measuring_notices, *self.about.notices())

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that are written: none before a reading of a target is kept."""
        return () if self.data is None else (DATA, PAGE)

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it; empty before a reading of a target is kept."""
        return f"Written to {out}: {', '.join(self.files)}, and the log readings.csv" if self.files else ""

    def write(self) -> None:
        """Write measurements and report into the folder, if there are any."""
        from truearm.measuring.report import measure_report

        data = self.data
        if data is not None:
            write_files(self.folder, {DATA: csv_text(data), PAGE: measure_report(self)}, self.command)

    def blocks(self) -> Iterator[Block]:
        """Give what is kept, what is not and why, how the nests moved, and the standard deviation, in mm."""
        session = self.session
        measured = len({entry.label for entry in session.kept if not entry.is_nest})
        accepted = sum(not entry.is_nest for entry in session.kept)
        yield say(
            f"{measured} of {counted(len(session.labels), 'configuration')} measured, "
            f"{counted(accepted, 'reading')} of {counted(len(session.targets), 'target')} kept.",
            finished=self.finished,
            configurations={"measured": measured, "planned": len(session.labels)},
            targets=list(session.targets),
            kept={"targets": accepted, "nests": len(session.kept) - accepted},
            outstanding=session.outstanding,
            files=list(self.files),
        )
        counts: Mapping[str, int] = session.aside_by_reason
        total = sum(counts.values())
        why = ", ".join(f"{count} {reason} ({REASONS[reason]})" for reason, count in counts.items())
        yield say(f"{counted(total, 'reading')} set aside: {why}." if total else "", set_aside=counts)
        left_out = session.left_out
        places = listed([f"{label}/{name}" for label, name in left_out])
        words = f"{counted(len(left_out), 'reading')} left out (configuration/target): {places}."
        yield detail(words if left_out else "", left_out=len(left_out))
        yield say(nests=None) if (drift := self.drift) is None else under("nests", [self._nests(drift)])
        size = None if self.sigma.value is None else self.sigma.value * 1e3
        shown = "" if size is None else f"{size:.4f} mm, "
        yield detail(
            *([f"Standard deviation in the file: {shown}{self.sigma.words}."] if accepted else []),
            sigma_mm=size,
            sigma_from=self.sigma.words,
            about={**self.about.fixed, "environment": [air.__dict__ for air in self.about.environment]},
        )

    def _nests(self, drift: NestDrift) -> Words:
        together, sigma = self._together(drift) * 1e3, None if drift.sigma is None else drift.sigma * 1e3
        movement = "whether they move shows from the second round on"
        if len(drift.rounds) > 1:
            repeat = "" if sigma is None else f"; they repeat to {sigma:.4f} mm in a coordinate"
            movement = (
                f"moved by up to {drift.largest * 1e3:.4f} mm, together by up to {together:.4f} mm{repeat}. No reading "
                "is corrected for it"
            )
        return say(
            f"Nests {listed(drift.names)} in {counted(len(drift.rounds), 'round')}: {movement}.",
            names=list(drift.names),
            rounds=len(drift.rounds),
            largest_mm=drift.largest * 1e3,
            together_mm=together,
            sigma_mm=sigma,
        )

    @staticmethod
    def _together(drift: NestDrift) -> float:
        return float((drift.common**2).sum(axis=1).max() ** 0.5)

    def _unfinished(self) -> list[Notice]:
        step = self.session.next
        if step is None:
            return []
        return [
            UNFINISHED(
                f"{counted(self.session.outstanding, 'reading')} are still to be taken; next is {step.label}, "
                f"{step.names[0]}. {GOES_ON}"
            )
        ]

    def _moved(self) -> list[Notice]:
        drift = self.drift
        if drift is None or (noise := drift.noise((self.sigma.own and self._stated()) or None)) is None:
            return []
        far = self._together(drift)
        if far <= 5.0 * noise * math.sqrt(2.0 / len(drift.names)):
            return []
        return [
            NESTS_MOVED(
                f"The nests moved together by up to {far * 1e3:.3f} mm, and by chance a coordinate of a reading is off "
                f"by no more than {noise * 1e3:.4f} mm: instrument or floor moved. The readings are not corrected for "
                "it."
            )
        ]

    def _stated(self) -> float:
        sigmas = [e.reading.sigma for e in self.session.kept if e.reading is not None and e.reading.sigma is not None]
        return math.sqrt(sum(value**2 for value in sigmas) / len(sigmas)) if sigmas else 0.0
