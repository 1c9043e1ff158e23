"""The robot library: one YAML file a robot, with its sources."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from truearm.modeling.formats.robot_file import read_robot
from truearm.modeling.robot import Robot


def library() -> tuple[str, ...]:
    """Return the ids of the library's robots."""
    return tuple(sorted(p.name.removesuffix(".yaml") for p in files(__package__).iterdir() if p.name.endswith(".yaml")))


def library_robot(robot_id: str) -> Robot:
    """Return a robot of the library."""
    return read_robot(Path(str(files(__package__) / f"{robot_id}.yaml")))
