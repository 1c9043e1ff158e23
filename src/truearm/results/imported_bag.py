"""Measurements that came from a recording of a ROS cell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.measurement.bags.recording import Recording
from truearm.measurement.bags.standstills import Sighting
from truearm.measurement.dataset import Dataset
from truearm.notices import Notice
from truearm.results.record import Record, joints_lines, notice_lines, notice_summaries
from truearm.shown import counted, listed
from truearm.writing import output_file, write_files

#: What the page beside the measurements ends with.
PAGE: Final = ".html"
#: Fewer messages than this share are lost in ordinary recordings.
_LOST: Final = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class ImportedBag(Record):
    """Measurements that came from a recording of a ROS cell."""

    found: Recording  #: Standstills, and what was seen in them.
    command: str  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.

    @property
    def data(self) -> Dataset:
        """The measurements."""
        return self.found.data

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the recording."""
        lost, kept = self.found.lost, len(self.found.joints.times)
        if lost < _LOST * (lost + kept):
            return ()
        return (
            Notice(
                "messages-missing",
                f"About {lost} of {lost + kept} messages of the joints are missing, by the times of the others. "
                "Motions shorter than the gaps are not seen. Lighten the load of the network or of the recorder, or "
                "let the topic be published reliably.",
            ),
        )

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        found = self.found
        return {
            "configurations": self.data.configurations,
            "joint_names": list(found.joints.names),
            "targets": [
                {
                    "name": target.target,
                    "topic": target.topic,
                    "frame": target.frame,
                    "missing": sum(not np.isfinite(one.position).all() for one in row),
                    "samples": [one.samples for one in row],
                    "set_aside": sum(one.set_aside for one in row),
                    "without_numbers": target.lost,
                    "scatter_mm": [_number(1e3 * one.scatter) for one in row],
                    "sigma_mm": [_number(1e3 * one.sigma) for one in row],
                }
                for target, row in zip(found.targets, found.sightings, strict=True)
            ],
            "standstills_s": [[still.start, still.end] for still in found.standstills],
            "missed_pauses_s": list(found.missed),
            "warnings": notice_summaries(self.warnings),
            "declares_sigma": found.declares_sigma,
        }

    def lines(self) -> list[str]:
        """Return what was found."""
        from truearm.reporting.numbers import significant

        found = self.found
        lasted = [still.end - still.start for still in found.standstills]
        text = [
            f"{counted(len(lasted), 'standstill')} of {min(lasted):.1f} to {max(lasted):.1f} s, joints "
            f"{', '.join(found.joints.names)}"
        ]
        for target, row in zip(found.targets, found.sightings, strict=True):
            text.append(f"  {target.target}: {_told(row, significant)}, in frame {target.frame or '(none)'}")
            if missing := sum(not np.isfinite(one.position).all() for one in row):
                text.append(f"    not seen in {counted(missing, 'standstill')}")
            if aside := sum(one.set_aside for one in row):
                text.append(f"    {counted(aside, 'sample')} set aside, far from the others of their standstill")
            if target.lost:
                text.append(f"    {counted(target.lost, 'message')} without numbers")
        if found.missed:
            when = listed([f"{at:.1f} s" for at in found.missed])
            text.append(
                f"  {counted(len(found.missed), 'pause')} without a standstill, at {when}: too short, creeping, or"
            )
            text.append("  the joints were not recorded. Each takes a number: the way to the next one is not known.")
        if not found.declares_sigma:
            text.append("  No deviations are declared: in a standstill all samples are the same.")
        text += joints_lines("controller" if self.data.joints_are == "controller" else "model")
        return text + notice_lines(self.warnings)

    def save(self, file: str | Path) -> tuple[Path, Path]:
        """Write the measurements as canonical CSV, and a page with the same name that ends in ``.html``.

        Returns:
            The files written.
        """
        from truearm.measurement.readers.canonical import csv_text
        from truearm.reporting.bag_page import bag_html

        table = output_file(file, self.inputs)
        page = output_file(table.with_suffix(PAGE), self.inputs)
        write_files(table.parent, {table.name: csv_text(self.data), page.name: bag_html(self)}, self.command)
        return table, page


def _told(row: tuple[Sighting, ...], significant: Any) -> str:
    seen = [one for one in row if math.isfinite(one.scatter)]
    samples = sorted(one.samples for one in seen)
    scatter = 1e3 * float(np.median([one.scatter for one in seen]))
    return f"{samples[0]} to {samples[-1]} samples a standstill, scattered by {significant(scatter, 2)} mm"


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
