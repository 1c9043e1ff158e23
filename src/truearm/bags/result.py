"""Measurements from a recording of a ROS cell."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.bags.standstills import Recording, Sighting, found_in
from truearm.bags.streams import TargetStream, read_streams
from truearm.engine.base.errors import InputError, Notice, Rule, counted, listed, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import file_for, files_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.document import Block, detail, each, say
from truearm.engine.document.records import Record, joints_lines

if TYPE_CHECKING:
    from truearm.bags.import_ros import ImportRos

#: What the page beside the measurements ends with.
PAGE: Final = ".html"
#: Fewer messages than this share are lost in ordinary recordings.
_LOST: Final = 0.05


MESSAGES_MISSING: Final = Rule(
    "messages-missing",
    "warning",
    "5 % of the joints' messages or more were lost, by the usual time between two of them; not told where their "
    "times are too uneven. What was found is usable, but motions shorter than the gaps are not seen. Usual causes "
    "are a recorder that is too slow and a topic that is published with *best effort*",
    cure="Lighten the load of the network or of the recorder, or let the topic be published reliably.",
    gravity=0,
)


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
        lost, received = self.found.lost, len(self.found.joints.times)
        if lost < _LOST * (lost + received):
            return ()
        return (
            MESSAGES_MISSING(
                f"About {lost} of {lost + received} messages of the joints are missing, by the times of the others. "
                "Motions shorter than the gaps are not seen."
            ),
        )

    def blocks(self) -> Iterator[Block]:
        """Give the standstills and what was seen in them, in s and mm."""
        recording = self.found
        lasted = [still.end - still.start for still in recording.standstills]
        yield say(
            f"{counted(len(lasted), 'standstill')} of {min(lasted):.1f} to {max(lasted):.1f} s, joints "
            f"{', '.join(recording.joints.names)}",
            configurations=self.data.configurations,
            joint_names=list(recording.joints.names),
            standstills_s=[[still.start, still.end] for still in recording.standstills],
        )
        yield each("targets", (_of_target(*pair) for pair in zip(recording.targets, recording.sightings, strict=True)))
        text = []
        if recording.missed:
            when = listed([f"{at:.1f} s" for at in recording.missed])
            text = [
                f"  {counted(len(recording.missed), 'pause')} without a standstill, at {when}: too short, creeping, or",
                "  the joints were not recorded. Each takes a number: the way to the next one is not known.",
            ]
        yield detail(*text, missed_pauses_s=list(recording.missed))
        words = "  No deviations are declared: in a standstill all samples are the same."
        yield detail("" if recording.declares_sigma else words, declares_sigma=recording.declares_sigma)
        yield detail(*joints_lines("controller" if self.data.joints_are == "controller" else "model"))

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it."""
        return f"Written: {out}, {Path(out).with_suffix(PAGE)}"

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


def _of_target(target: TargetStream, row: tuple[Sighting, ...]) -> Iterator[Block]:
    """Give what was seen of a target in each standstill."""
    from truearm.engine.document.drawing import significant

    seen = [sighting for sighting in row if math.isfinite(sighting.scatter)]
    samples = sorted(sighting.samples for sighting in seen)
    scatter = 1e3 * float(np.median([sighting.scatter for sighting in seen]))
    yield say(
        f"  {target.target}: {samples[0]} to {samples[-1]} samples a standstill, scattered by "
        f"{significant(scatter, 2)} mm, in frame {target.frame or '(none)'}",
        name=target.target,
        topic=target.topic,
        frame=target.frame,
        samples=[sighting.samples for sighting in row],
        scatter_mm=[_number(1e3 * sighting.scatter) for sighting in row],
        sigma_mm=[_number(1e3 * sighting.sigma) for sighting in row],
    )
    missing = sum(not np.isfinite(sighting.position).all() for sighting in row)
    aside = sum(sighting.set_aside for sighting in row)
    for key, count, words in (
        ("missing", missing, f"not seen in {counted(missing, 'standstill')}"),
        ("set_aside", aside, f"{counted(aside, 'sample')} set aside, far from the others of their standstill"),
        ("without_numbers", target.lost, f"{counted(target.lost, 'message')} without numbers"),
    ):
        yield detail(f"    {words}" if count else "", **{key: count})


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def of_bag(asked: ImportRos) -> ImportedBag:
    """Read the standstills in a bag, and write them as canonical CSV with a page."""
    bag = path_argument(asked.file, "file")
    out = None if asked.out is None else _table_for(asked.out, bag)
    with refusals_of("file"):
        recording = _recording_of(bag, asked)
    imported = ImportedBag(recording, asked.again, files_of(bag))
    if out is not None:
        asked.progress("writing the files")
        imported.save(out)
    return imported


def _table_for(out: str | Path, bag: Path) -> Path:
    """Return where the measurements are written; the page stands beside them."""
    table = file_for(out, bag)
    if table.suffix == PAGE:
        raise InputError("the measurements are a CSV file", parameter="out", came=table.name, allowed="DATA.csv")
    file_for(table.with_suffix(PAGE), bag)
    return table


def _recording_of(bag: Path, asked: ImportRos) -> Recording:
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
