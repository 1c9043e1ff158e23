"""A small session to imitate, and a robot file to fill in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_yaml
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import write_files, write_new_text
from truearm.engine.command.arguments import folder_for, new_file_for
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record
from truearm.engine.robot.robot_file.reading import robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

if TYPE_CHECKING:
    from truearm.starting.jobs import NewRobot, WriteExample


@dataclass(frozen=True, eq=False, repr=False)
class ExampleSession(Record):
    """A small complete session to imitate."""

    files: tuple[Path, ...]  #: A robot, its data, data to check with, the commands.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``: a virtual instrument reads."""
        return ("data",)

    def blocks(self) -> Iterator[Block]:
        """Give the files."""
        files = [str(file) for file in self.files]
        yield say(*files, files=files)


@dataclass(frozen=True, eq=False, repr=False)
class RobotTemplate(Record):
    """A commented robot file to fill in."""

    file: Path  #: The file.

    def blocks(self) -> Iterator[Block]:
        """Give what to do with it."""
        yield say(f"{self.file}: fill it in, then look at it with 'truearm show {self.file}'.", file=str(self.file))


def new_file(asked: NewRobot) -> RobotTemplate:
    """Write the commented robot file."""
    path = new_file_for(asked.file, "file")
    write_new_text(path, robot_template())
    return RobotTemplate(path)


def robot_template() -> str:
    """Return the commented robot file."""
    return (files("truearm.starting.examples") / "new_robot.yaml").read_text("utf-8")


_FILES: Final = ("my_robot.yaml", "measurements.csv", "check.csv", "session.sh")


def session(asked: WriteExample) -> ExampleSession:
    """Write the session."""
    place = folder_for(_FILES, asked.folder, parameter="folder")
    for name in _FILES:
        if exists(place / name):
            raise InputError(
                "this exists already and is not overwritten",
                parameter="folder",
                where=str(place / name),
                cure="Choose another folder.",
            )
    rng = np.random.default_rng(7)
    template = Path(str(files("truearm.starting.examples") / "new_robot.yaml"))
    robot = robot_from_file(read_yaml(template, RobotFile), "my_robot.yaml")
    twin = truth_twin(robot, "random", rng)
    texts = (
        robot_template(),
        csv_text(measure(twin, robot.random_configurations(60, rng), 0.05e-3, rng)),
        csv_text(measure(twin, robot.random_configurations(15, rng), 0.05e-3, rng)),
        (files("truearm.starting.examples") / "session.sh").read_text("utf-8"),
    )
    write_files(place, dict(zip(_FILES, texts, strict=True)))
    return ExampleSession(tuple(place / name for name in _FILES))
