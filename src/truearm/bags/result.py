"""Measurements from a recording of a ROS cell."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.bags.standstills import Recording, Sighting, found_in
from truearm.bags.streams import read_streams
from truearm.engine.base.errors import InputError, Notice, counted, listed, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import file_for, files_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries

if TYPE_CHECKING:
    from truearm.bags.import_ros import ImportRos

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
    out: Path | None = None  #: The canonical CSV file that holds the measurements; None if none was written.

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
        from truearm.engine.document.drawing import significant

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
        written = [] if self.out is None else [f"Written: {self.out}, {self.out.with_suffix(PAGE)}"]
        return [*text, *notice_lines(self.warnings), *written]

    def save(self, file: str | Path) -> tuple[Path, Path]:
        """Write the measurements as canonical CSV, and a page with the same name that ends in ``.html``.

        Returns:
            The files written.
        """
        from truearm.bags.page import bag_html
        from truearm.engine.data.readers.canonical import csv_text

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


def of_bag(asked: ImportRos) -> ImportedBag:
    """Read the standstills in a bag, and write them as canonical CSV with a page."""
    bag = path_argument(asked.file, "file")
    out = None if asked.out is None else _table_for(asked.out, bag)
    with refusals_of("file"):
        found = _found(bag, asked)
    imported = ImportedBag(found, asked.again, files_of(bag))
    if out is None:
        return imported
    asked.progress("writing the files")
    imported.save(out)
    return replace(imported, out=out)


def _table_for(out: str | Path, bag: Path) -> Path:
    """Return where the measurements are written; the page stands beside them."""
    table = file_for(out, bag)
    if table.suffix == PAGE:
        raise InputError("the measurements are a CSV file", parameter="out", came=table.name, allowed="DATA.csv")
    file_for(table.with_suffix(PAGE), bag)
    return table


def _found(bag: Path, asked: ImportRos) -> Recording:
    """Return the standstills in a bag, and what was seen in them."""
    references = asked.references or {}
    asked.progress("reading the bag")
    topics = {**(asked.targets or {}), **references} or None
    named = None if asked.joint_names is None else tuple(asked.joint_names)
    joints, seen = read_streams(bag, topics, asked.joint_topic, named, asked.times)
    if unknown := [name for name in asked.prismatic if name not in joints.names]:
        raise InputError(
            "there is no such joint", parameter="prismatic", came=unknown[0], allowed=", ".join(joints.names)
        )
    asked.progress("looking for standstills")
    return found_in(
        bag,
        joints,
        seen,
        references=references,
        prismatic=tuple(asked.prismatic),
        joints_are=asked.joints_are or "model",
        still=asked.still,
        hold=asked.shortest_dwell,
        settle=asked.settle,
    )
