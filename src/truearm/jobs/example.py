"""A small session to imitate."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.files import exists, read_yaml
from truearm.jobs.arguments import folder_for
from truearm.jobs.new_robot import robot_template
from truearm.measurement.readers.canonical import csv_text
from truearm.modeling.formats.robot_file import RobotFile, robot_from_file
from truearm.results.example_session import ExampleSession
from truearm.simulation.truths import truth_twin
from truearm.simulation.twin import measure
from truearm.writing import write_files

_FILES: Final = ("my_robot.yaml", "measurements.csv", "check.csv", "session.sh")


def example(folder: str | Path) -> ExampleSession:
    """Write a small complete session to imitate: a robot, its data, data to check with, the commands.

    Parameters
    ----------
    folder
        Folder to write into; nothing in it is overwritten.

    Raises
    ------
    InputError
        If one of the files exists.
    """
    place = folder_for(_FILES, folder, parameter="folder")
    for name in _FILES:
        if exists(place / name):
            raise InputError(
                "this exists already and is not overwritten",
                parameter="folder",
                where=str(place / name),
                cure="Choose another folder.",
            )
    rng = np.random.default_rng(7)
    template = Path(str(files("truearm.examples") / "new_robot.yaml"))
    robot = robot_from_file(read_yaml(template, RobotFile), "my_robot.yaml")
    twin = truth_twin(robot, "random", rng)
    texts = (
        robot_template(),
        csv_text(measure(twin, robot.random_configurations(60, rng), 0.05e-3, rng)),
        csv_text(measure(twin, robot.random_configurations(15, rng), 0.05e-3, rng)),
        (files("truearm.examples") / "session.sh").read_text("utf-8"),
    )
    write_files(place, dict(zip(_FILES, texts, strict=True)))
    return ExampleSession(tuple(place / name for name in _FILES))
