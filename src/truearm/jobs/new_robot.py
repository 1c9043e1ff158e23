"""A robot file to fill in."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from truearm.jobs.arguments import new_file_for
from truearm.results.example_session import RobotTemplate
from truearm.writing import write_new_text


def new_robot(file: str | Path) -> RobotTemplate:
    """Write a commented robot file to fill in.

    Parameters
    ----------
    file
        The file to write, which must not exist yet.

    Raises
    ------
    InputError
        If the file exists or cannot be written.
    """
    path = new_file_for(file, "file")
    write_new_text(path, robot_template())
    return RobotTemplate(path)


def robot_template() -> str:
    """Return the commented robot file."""
    return (files("truearm.examples") / "new_robot.yaml").read_text("utf-8")
