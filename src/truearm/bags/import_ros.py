"""Measurements from a recording of a ROS cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.bags.standstills import Recording, Sighting, found_in
from truearm.bags.streams import TIMES, Times, read_streams
from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError, Notice, counted, listed, refusals_of, wrong_kind
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import (
    JOINTS_OF,
    choice_argument,
    command_argument,
    file_for,
    files_of,
    name_argument,
    names_argument,
    progress_argument,
    python_call,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.robot.controller import JointsOf

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
        return text + notice_lines(self.warnings)

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


#: How long a standstill may be asked to last [s].
_LONGEST: Final = 3600.0


def import_ros(
    file: str | Path,
    *,
    targets: Mapping[str, str] | None = None,
    references: Mapping[str, str] | None = None,
    joint_topic: str | None = None,
    joint_names: Sequence[str] | None = None,
    prismatic: Sequence[str] = (),
    joints_are: JointsOf = "model",
    times: Times = "stamp",
    still: float = 3.5e-4,
    hold: float = 1.0,
    settle: float = 0.3,
    out: str | Path | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> ImportedBag:
    """Read the standstills in a ROS 1 or ROS 2 bag: joint positions, and what an instrument saw of targets.

    Parameters
    ----------
    file
        A ``.bag`` file of ROS 1, or the folder of a bag of ROS 2.
    targets
        The topic of each target by its name; None for the only topic that holds points or poses.
    references
        The same of points beside the robot.
    joint_topic
        Topic of the joint positions; None for the only one.
    joint_names
        Names of the robot's joints in its order; None where numbers at their ends tell it.
    prismatic
        Those of them that slide.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the robot's ``controller`` shows them.
    times
        When a message was: the ``stamp`` of its header, or as the recorder of the ``bag`` noted it.
    still
        How far a joint may move in a standstill [rad; m for those that slide].
    hold
        The shortest standstill [s].
    settle
        What is left out at its beginning and its end [s].
    out
        Canonical CSV file to write, and a page beside it; None writes nothing, see :meth:`ImportedBag.save`.
    command
        How to run it again, for the page; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If the bag cannot be read, or holds no standstill in which a target was seen.
    """
    progress_argument(progress)
    bag = path_argument(file, "file")
    of_targets, of_references = _topics(targets, "targets"), _topics(references, "references")
    if both := [name for name in of_references if name in of_targets]:
        raise InputError(
            "a name stands for a target and for a point beside the robot", parameter="references", came=both[0]
        )
    if of_references and not of_targets:
        raise InputError("a point beside the robot is given, and no target", parameter="targets")
    allowed = "names of joints"
    named = None if joint_names is None else names_argument(joint_names, "joint_names", allowed)
    given = () if joint_names is None else joint_names  # may be an array, which is neither true nor false
    if named is not None and (not named or len(named) != len(given)):
        raise InputError("each joint has one name", parameter="joint_names", came=", ".join(map(str, given)))
    sliding = names_argument(prismatic, "prismatic", allowed)
    if joint_topic is not None:
        name_argument(joint_topic, "joint_topic")
    whose = choice_argument(joints_are, "joints_are", JOINTS_OF)
    clock = choice_argument(times, "times", {name: name for name in TIMES})
    within = finite_number(still, "still", lowest=1e-9, allowed="an angle above zero")
    shortest = finite_number(hold, "hold", lowest=0.05, allowed=f"0.05 s to {_LONGEST:g} s")
    left_out = finite_number(settle, "settle", lowest=0.0, allowed="0 s or more")
    if shortest > _LONGEST:
        raise InputError(
            "a standstill of this length is out of range",
            parameter="hold",
            came=f"{shortest:g} s",
            allowed=f"0.05 s to {_LONGEST:g} s",
        )
    if 2.0 * left_out >= shortest:
        raise InputError(
            "nothing is left of the shortest standstill",
            parameter="settle",
            came=f"{left_out:g} s at either end of {shortest:g} s",
            allowed=f"less than {shortest / 2:g} s",
            cure="Leave out less, or ask for longer standstills with `hold`.",
        )
    call = command_argument(command) or python_call(
        "import_ros",
        bag,
        targets=targets,
        references=references,
        joint_topic=joint_topic,
        joint_names=joint_names,
        prismatic=sliding or None,
        joints_are=whose,
        times=clock,
        still=within,
        hold=shortest,
        settle=left_out,
    )
    if out is not None:
        table = file_for(out, bag)
        if table.suffix == PAGE:
            raise InputError("the measurements are a CSV file", parameter="out", came=table.name, allowed="DATA.csv")
        file_for(table.with_suffix(PAGE), bag)
    with refusals_of("file"):
        progress("reading the bag")
        joints, seen = read_streams(bag, {**of_targets, **of_references} or None, joint_topic, named, clock)
        if unknown := [name for name in sliding if name not in joints.names]:
            raise InputError(
                "there is no such joint", parameter="prismatic", came=unknown[0], allowed=", ".join(joints.names)
            )
        progress("looking for standstills")
        found = found_in(
            bag,
            joints,
            seen,
            references=of_references,
            prismatic=sliding,
            joints_are=whose,
            still=within,
            hold=shortest,
            settle=left_out,
        )
    imported = ImportedBag(found, call, files_of(bag))
    if out is not None:
        progress("writing the files")
        imported.save(table)
    return imported


def _topics(topics: object, parameter: str) -> dict[str, str]:
    """Return topics by the names of what they show."""
    if topics is None:
        return {}
    if not isinstance(topics, Mapping):
        raise wrong_kind("topics by name belong here", topics, parameter, "a dict of names and topics")
    for name, topic in topics.items():
        if not isinstance(name, str) or not isinstance(topic, str):
            raise wrong_kind(
                "a name and a topic belong here", topic if isinstance(name, str) else name, parameter, "texts"
            )
    if len(set(topics.values())) < len(topics):
        raise InputError("one topic has two names", parameter=parameter, came=", ".join(topics.values()))
    return dict(topics)
