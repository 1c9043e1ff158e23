"""The robot library, one YAML file a robot with its sources, and the one way to get a robot by name or file."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.files import exists, path_argument
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot

#: How much of a file is looked at to tell what it is [bytes].
_BEGINNING: Final = 4096
#: Of an id that was half given, how many letters and digits are needed, and of one that stands in a longer name; how
#: many ids are offered at most.
_SHORTEST_CONTAINED: Final = 2
_SHORTEST_WITHIN: Final = 3
_MOST_OFFERED: Final = 8
_URDF: Final = re.compile(r".*\.(?:urdf|xml|xacro)", re.I | re.S)
#: The ending of a file: letters, where names of arms that have a point go on in digits (`IRB 1200-5/0.9`).
_ENDING: Final = re.compile(r"\.[A-Za-z]\w*")


@cache
def library() -> tuple[str, ...]:
    """Return the ids of the library's robots."""
    return tuple(sorted(p.name.removesuffix(".yaml") for p in files(__package__).iterdir() if p.name.endswith(".yaml")))


def urdf_source(robot: str | Path) -> tuple[Path, str | None] | None:
    """Return the URDF file that `robot` names and the link behind its ``#``, or None if it names no URDF.

    A path that exists is taken whole, whatever ``#`` are in it; else the last ``#`` behind the ending of a URDF
    parts file and link.
    """
    text = str(robot)
    if not exists(Path(text)):
        for place in reversed([m.start() for m in re.finditer("#", text)]):
            if _URDF.fullmatch(text, 0, place):
                return Path(text[:place]), text[place + 1 :] or None
    return (Path(text), None) if _URDF.fullmatch(text) else None


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
    choice = f"a library id ('truearm robots' lists all {len(library())}), a robot file or a URDF"
    if not text.strip():
        raise InputError("no robot is given", parameter="robot", came=text, allowed=choice)
    if text in library():
        return _of_library(text)
    source = urdf_source(robot)
    if source is not None:
        from truearm.engine.robot.urdf import read_urdf

        return read_urdf(*source)
    path = path_argument(text, "robot")
    if is_zones(path):
        raise InputError(
            "this file names the robots of zones, and one robot belongs here",
            parameter="robot",
            came=text,
            cure="Give calibrated.yaml, or the file of the zone in which the flange stays; only 'truearm validate' "
            "takes all zones together.",
        )
    near = [f"{name} ({_of_library(name).title})" for name in close_names(text)]
    in_a_folder = len(path.parts) > 1 and (exists(path.parent) or not near)
    if exists(path) or in_a_folder or _ENDING.fullmatch(path.suffix):
        return read_robot(path)
    raise InputError(
        "there is no such robot",
        parameter="robot",
        came=text,
        allowed=choice,
        cure=f"Did you mean {' or '.join(near)}?" if near else "Run 'truearm robots' for the library.",
    )


def close_names(text: str) -> list[str]:
    """Return the ids of the library that somebody may have meant.

    Those that hold the text; else those that the text holds (``LR Mate 200iD/7L`` holds `lrmate200id`), the longest
    first; else those like it. Letters and digits count: ``IRB 1200`` is close to every IRB 1200. None of them is ever
    taken for it, since arms of one series differ in their lengths.
    """
    asked = letters(text)
    similar = [name for name in library() if len(asked) >= _SHORTEST_CONTAINED and asked in letters(name)]
    if not similar:
        similar = [name for name in library() if len(name) >= _SHORTEST_WITHIN and letters(name) in asked]
        similar.sort(key=len, reverse=True)
    return similar[:_MOST_OFFERED] or nearest_names(text, library())


def letters(text: str) -> str:
    """Return the letters and digits of a name in small letters, without accents, by which names are compared."""
    return re.sub(r"[^a-z0-9]", "", unicodedata.normalize("NFKD", text).lower())


@cache
def _of_library(name: str) -> Robot:
    """Return a robot of the library. Its file does not change and is read once: that takes longer than a small fit."""
    return read_robot(Path(str(files(__package__) / f"{name}.yaml")))


def is_zones(name: str | Path) -> bool:
    """Return whether a file begins as those do that name the robots of zones."""
    path = Path(name)
    if not exists(path) or not path.is_file():
        return False
    with path.open("rb") as stream:
        return re.search(rb"^truearm: *truearm-zones/", stream.read(_BEGINNING), re.M) is not None


def is_robot(name: str | Path) -> bool:
    """Return whether a name is a library id, a URDF, or a file that begins as robot files do."""
    path = Path(name)
    if exists(path) and path.is_file() and urdf_source(name) is None:
        with path.open("rb") as stream:
            return re.search(rb"^truearm: *truearm-robot/", stream.read(_BEGINNING), re.M) is not None
    return str(name) in library() or urdf_source(name) is not None
