"""Configurations that were recorded: a CSV of joint positions, and the way from one to the next."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import JOINT_COLUMN, counting, joint_cells, joint_headings, joint_names

#: The columns of labels that lists of configurations have, the better first.
_LABELS: Final = ("configuration", "pose")
#: The column that says why an arm stops on the ways of a plan.
_STOP: Final = "stop"


@dataclass(frozen=True, eq=False)
class Recorded:
    """Configurations in their order."""

    labels: tuple[str, ...]  #: One each.
    joints: Array  #: Of the model [rad or m], ``(n, joints)``.
    joints_are: JointsOf  #: Whose joint positions the file holds.

    def with_one(self, joints: Array) -> Recorded:
        """Return the list with a configuration behind the last, named by its number."""
        numbers = [int(label[1:]) for label in self.labels if label[:1] == "P" and label[1:].isdecimal()]
        label = f"P{max(numbers, default=0) + 1}"
        return Recorded((*self.labels, label), np.concatenate([self.joints, joints[None]]), self.joints_are)

    def without_last(self) -> Recorded:
        """Return the list without its last configuration."""
        return Recorded(self.labels[:-1], self.joints[:-1], self.joints_are)

    def text(self, robot: Robot) -> str:
        """Return the file: ``configuration`` and a column a joint, as plans have them."""
        controller = counting(robot, self.joints_are)
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["configuration", *joint_headings(robot.joints, controller)])
        for label, cells in zip(self.labels, joint_cells(self.joints, robot.joints, controller), strict=True):
            writer.writerow([label, *cells])
        return stream.getvalue()


def list_of(robot: Robot) -> str:
    """Return the name of the file into which configurations of a robot are recorded: joint positions name no arm."""
    return f"recorded-{re.sub('[^A-Za-z0-9_.-]+', '-', robot.name)}.csv"


def read_recorded(path: Path, robot: Robot) -> Recorded:
    """Read the configurations of any table of the commands: a plan, measurements, joints of poses, recorded ones.

    Of rows after each other with one label the first counts; of the ways of a plan, whose rows are stops, every one.
    Other columns are left aside.

    Raises:
        InputError: If the table has no joint positions, or those of another arm.
    """
    text = read_text(path)
    header = 1 + next((number for number, line in enumerate(lines_of(text)) if line.strip()), 0)
    if text.strip():
        refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    where = f"{path}, line {header}"
    columns = _joint_columns(cells, where)
    joints_are, names = joint_names(columns, where)
    if len(names) != len(robot.joints):
        raise InputError(
            "the file has joint positions of another arm",
            where=where,
            came=f"{len(names)} joints",
            allowed=f"the {len(robot.joints)} of {robot.name}",
        )
    if joints_are == "controller":
        robot.controller.check_counts(robot.name, where)
    units = [(*ANGLE_UNITS,) if joint.kind == "revolute" else (*LENGTH_UNITS,) for joint in robot.joints]
    for name, fitting in zip(names, units, strict=True):
        checked_unit(columns[name][1], fitting, f"{where}, {name}")
    values = np.column_stack([cells.numbers(place, unit) for place, unit in (columns[name] for name in names)])
    if joints_are == "controller":
        values = robot.controller.to_model(values)
    heading = next((name for name in _LABELS if name in cells.names), None)
    stops = cells.texts(cells.names.index(_STOP)) if _STOP in cells.names else None
    labels: Sequence[str] = [str(k + 1) for k in range(len(values))]
    if heading is not None:
        labels = cells.texts(cells.names.index(heading), missing=stops is not None)
    if stops is not None:
        labels = [f"{stop} {label}".strip() for stop, label in zip(stops, labels, strict=True)]
    kept = [k for k in range(len(labels)) if stops is not None or k == 0 or labels[k] != labels[k - 1]]
    return Recorded(tuple(labels[k] for k in kept), values[kept], joints_are)


def _joint_columns(cells: Cells, where: str) -> dict[str, tuple[int, str]]:
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        name, _, rest = heading.partition("[")
        if JOINT_COLUMN.fullmatch(name.strip()) is None:
            continue
        unit = checked_unit(rest.rstrip("] ").strip() or None, (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, {heading}")
        if name.strip() in columns:
            raise InputError(f"the column {name.strip()} appears twice", where=where, cure="Remove one of them.")
        columns[name.strip()] = (place, unit)
    return columns


@dataclass(frozen=True, eq=False)
class Motion:
    """A way through configurations, all joints in step, the fastest at one speed."""

    joints: Array  #: Configurations passed ``(n, joints)`` [rad or m].
    times: Array  #: When [s], ``(n,)``, from 0.

    @classmethod
    def through(cls, joints: Array, speed: float, robot: Robot) -> Motion:
        """Return the way through configurations.

        Args:
            speed: Of the fastest joint [deg/s, or mm/s for prismatic joints].

        Raises:
            InputError: If the speed is none.
        """
        if not 0.1 <= speed <= 1000.0:
            raise InputError(
                "this is no speed", parameter="speed", came=speed, allowed="0.1 to 1000 deg/s or mm/s of a joint"
            )
        shown = joints * np.array([np.rad2deg(1.0) if joint.kind == "revolute" else 1e3 for joint in robot.joints])
        steps = [float(np.abs(b - a).max()) / speed for a, b in pairwise(shown)]
        return cls(joints, np.concatenate([[0.0], np.cumsum(steps)]))

    def at(self, time: float) -> Array:
        """Return the joint positions ``(joints,)`` at a time [s]; at the ends before and behind it."""
        return np.array([np.interp(time, self.times, column) for column in self.joints.T])

    def on_the_way(self, steps: int = 20) -> Array:
        """Return configurations along the way, so many from each that is passed to the next, ``(n, joints)``."""
        places = np.arange(len(self.joints))
        along = np.linspace(0.0, float(places[-1]), steps * (len(places) - 1) + 1)
        return np.stack([np.interp(along, places, column) for column in self.joints.T], axis=1)

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.times[-1])


def labels_text(labels: Sequence[str], most: int = 6) -> str:
    """Return the last of some labels in a few words."""
    return ", ".join(labels) if len(labels) <= most else f"{len(labels)}, the last {', '.join(labels[-most:])}"
