"""The robot library, one YAML file a robot with its sources, and the one way to get a robot by name or file."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from truearm.errors import InputError, nearest_names
from truearm.modeling.formats.robot_file import read_robot
from truearm.modeling.robot import Robot


def library() -> tuple[str, ...]:
    """Return the ids of the library's robots."""
    return tuple(sorted(p.name.removesuffix(".yaml") for p in files(__package__).iterdir() if p.name.endswith(".yaml")))


def load_robot(robot: str | Path) -> Robot:
    """Return a robot.

    Parameters
    ----------
    robot
        The id of a library robot (``irb120``), a robot file (``my.yaml``) or a URDF (``my.urdf``, or
        ``my.urdf#tool0`` to name the link at the end of the chain).

    Raises
    ------
    InputError
        If there is no such robot, or its file cannot be used.
    """
    text = str(robot)
    if text in library():
        return read_robot(Path(str(files(__package__) / f"{text}.yaml")))
    name, _, tip = text.partition("#")
    if name.lower().endswith((".urdf", ".xml", ".xacro")):
        from truearm.modeling.formats.urdf import read_urdf

        return read_urdf(Path(name), tip or None)
    path = Path(text)
    if path.exists() or path.suffix or len(path.parts) > 1:
        return read_robot(path)
    near = nearest_names(text, library())
    raise InputError(
        "there is no such robot",
        where="ROBOT",
        came=text,
        allowed=f"a library id ({', '.join(library())}), a robot file or a URDF",
        cure=f"Did you mean {' or '.join(near)}?" if near else "Run 'truearm robots' for the library.",
    )
