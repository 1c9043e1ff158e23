"""A path file that grows point by point: lines, circles and curves through waypoints, where the tip of an arm is."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Final

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import confined_reads
from truearm.engine.base.schemas import validated
from truearm.engine.motion.path_file import SCHEMA, PathFile
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.studio.recorded import Motion
from truearm.studio.tasks import Outcome, Progress

Point = tuple[float, float, float]
#: Time between samples of a path that is made here [s].
_STEP: Final = 0.02
#: Acceleration by the speed [1/s]: full speed after a fifth of a second.
_RAMP: Final = 5.0
_KINDS: Final = ("line", "circle", "hermite")


@dataclass(frozen=True, eq=False)
class PlayedPath:
    """A path as an arm follows it."""

    outcome: Outcome  #: What its command prints.
    motion: Motion  #: Joint positions over time.


def new_path(start: Point, speed: float, *, frame: str, target: str | None, axis: Point | None) -> dict[str, Any]:
    """Return the entries of a path that only begins.

    Args:
        start: Where [mm].
        speed: [mm/s]
        frame: ``base`` or ``world``.
        target: What follows it, by its name; None for the flange.
        axis: Where the tip's z axis points all along it; None where its orientation is free.
    """
    made: dict[str, Any] = {"truearm": SCHEMA, "units": {"length": "mm", "angle": "deg", "time": "s"}, "frame": frame}
    made |= {} if target is None else {"target": target}
    made |= {"speed": speed, "acceleration": _RAMP * speed, "step": _STEP}
    return with_orientation({**made, "start": _rounded(start), "sections": []}, axis)


def with_section(path: dict[str, Any], kind: str, points: Sequence[Point]) -> dict[str, Any]:
    """Return a path with another section; a waypoint behind waypoints is one more of theirs.

    Args:
        kind: ``line`` to a point, ``circle`` through two and back, or ``hermite`` through waypoints [mm].
    """
    sections, at = list(path["sections"]), [_rounded(point) for point in points]
    if kind == "hermite" and sections and "hermite" in sections[-1]:
        sections[-1] = {"hermite": [*sections[-1]["hermite"], *at]}
    else:
        sections.append({kind: at[0] if kind == "line" else at})
    return {**path, "sections": sections}


def without_last(path: dict[str, Any]) -> dict[str, Any] | None:
    """Return a path without its last section, or waypoint; None if it only begins."""
    *sections, last = path["sections"] or [None]
    if last is None:
        return None
    if len(last.get("hermite", ())) > 1:
        sections.append({"hermite": last["hermite"][:-1]})
    return {**path, "sections": sections}


def with_speed(path: dict[str, Any], speed: float) -> dict[str, Any]:
    """Return a path at another speed [mm/s]."""
    return {**path, "speed": speed, "acceleration": _RAMP * speed}


def with_orientation(path: dict[str, Any], axis: Point | None) -> dict[str, Any]:
    """Return a path along which the tip's z axis points there; None where its orientation is free."""
    names = [name for name in path if name != "orientation"]
    kept = {} if axis is None else {"orientation": {"axis": _rounded(axis, 9)}}
    before = names.index("speed")
    return {**{name: path[name] for name in names[:before]}, **kept, **{name: path[name] for name in names[before:]}}


def path_text(path: dict[str, Any]) -> str:
    """Return the path file of such entries.

    Raises:
        InputError: If they are none, as without sections.
    """
    validated(path, PathFile, "path")
    yaml, stream = YAML(), StringIO()
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.dump(_flowing(path), stream)
    return stream.getvalue()


def entries_of(text: str) -> dict[str, Any] | None:
    """Return the entries of a file that was made here; None of any other path file."""
    content = YAML(typ="safe", pure=True).load(text)
    try:
        validated(content, PathFile, "path")
        return content if path_text(content) == text else None
    except InputError:
        return None


def in_words(path: dict[str, Any]) -> list[str]:
    """Return a path section by section, for reading [mm]."""
    lines = [f"from ({_numbers(path['start'])})"]
    for section in path["sections"]:
        kind = next(kind for kind in _KINDS if kind in section)
        points = [section[kind]] if kind == "line" else section[kind]
        word = {"line": "line to", "circle": "circle through", "hermite": "curve through"}[kind]
        lines.append(f"{word} {', '.join(f'({_numbers(point)})' for point in points)}")
    return lines


def played_path(folder: Path, robot: Robot, file: str, seed: Array, progress: Progress) -> PlayedPath:
    """Return the motion of an arm along a path: :func:`truearm.path`.

    Args:
        robot: A nominal one follows the path as its controller would; a calibrated one with the corrected joint
            positions.
        seed: Joint positions near which it begins ``(joints,)`` [rad or m].
    """
    from truearm.compensation.jobs import path as job

    os.chdir(folder)
    progress("following the path")
    with confined_reads(folder):
        made = job(robot, file, seed_joints=seed)
    followed = made.path
    motion = Motion(followed.joints[followed.best], np.asarray(followed.motion.time - followed.motion.time[0]))
    return PlayedPath(Outcome(tuple(made.lines()), made.warnings), motion)


def _rounded(point: Sequence[float], digits: int = 3) -> list[float]:
    return [round(float(value), digits) + 0.0 for value in point]


def _numbers(point: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in point)


def _flowing(entry: Any) -> Any:
    """Return entries whose points stand on one line each."""
    if isinstance(entry, dict):
        return {name: _flowing(part) for name, part in entry.items()}
    if isinstance(entry, list) and entry and not isinstance(entry[0], dict):
        made = CommentedSeq(_flowing(part) for part in entry)
        made.fa.set_flow_style()
        return made
    return [_flowing(part) for part in entry] if isinstance(entry, list) else entry
