"""Path files: lines, circles and Hermite sections through waypoints, one after the other, with their time law.

::

    truearm: truearm-path/1
    units: {length: mm, angle: deg, time: s}
    frame: nominal
    tip: [0, 0, 130]
    orientation: {axis: [0, 0, -1]}
    speed: 100
    acceleration: 500
    step: 0.02
    start: [300, 0, 300]
    sections:
      - line: [300, 100, 300]
      - circle: [[400, 100, 400], [300, 100, 500]]
      - {circle: {centre: [350, 100, 300], normal: [0, 0, 1]}, speed: 50}
      - hermite: [[320, 150, 320], [300, 200, 300]]

What keeps its orientation has an ``axis`` (the tip's z axis points along it) or a ``quaternion``; left out, the
orientation is free. Each section begins where the one before ended, at rest, and ends at rest. A circle comes back to
where it began. A section of Hermite cubics has the velocities of the natural spline, or its own ``velocities`` and
``times`` (Li, equation 3): then these say when it is where, and not speed and acceleration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Discriminator, Field, Tag, model_validator

from truearm.engine.base.errors import InputError, refusals_at
from truearm.engine.base.files import read_yaml
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import sized_si
from truearm.engine.motion.paths import Circle, Hermite, Line, Trajectory, timed
from truearm.engine.motion.paths import Path as Way
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.pose_solver import Orientation
from truearm.engine.robot.robot_file.entries import STRICT, NotNegative, Positive, Quaternion, Triple
from truearm.engine.robot.transform import rotation_from_quaternion

SCHEMA: Final = "truearm-path/1"
#: In what a path may be given.
PathFrame = Literal["nominal", "base", "world"]
#: Waypoints nearer to each other than this are one [m].
_SAME: Final = 1e-6


class _Units(BaseModel):
    model_config = STRICT
    length: Literal["mm", "m", "um", "in"]
    angle: Literal["deg", "rad"]
    time: Literal["s"]


class _About(BaseModel):
    model_config = STRICT
    centre: Triple
    normal: Triple


class _TipOrientation(BaseModel):
    model_config = STRICT
    axis: Triple | None = None
    quaternion: Quaternion | None = None

    @model_validator(mode="after")
    def _one_of_them(self) -> _TipOrientation:
        if (self.axis is None) == (self.quaternion is None):
            raise InputError("one orientation belongs here", allowed="axis: [x, y, z], or quaternion: [w, x, y, z]")
        return self


def _way_of_circle(value: object) -> str:
    return "about" if isinstance(value, Mapping | _About) else "points"


_Circle = Annotated[
    Annotated[tuple[Triple, Triple], Tag("points")] | Annotated[_About, Tag("about")], Discriminator(_way_of_circle)
]


class _Section(BaseModel):
    model_config = STRICT
    line: Triple | None = None
    circle: _Circle | None = None
    hermite: Annotated[tuple[Triple, ...], Field(min_length=1)] | None = None
    velocities: tuple[Triple, ...] | None = None
    times: tuple[NotNegative, ...] | None = None
    speed: Positive | None = None
    acceleration: Positive | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> _Section:
        kinds = [name for name in ("line", "circle", "hermite") if getattr(self, name) is not None]
        if len(kinds) != 1:
            raise InputError(
                "a section is of one kind", came=" and ".join(kinds) or "none", allowed="line, circle or hermite"
            )
        timed_itself = self.velocities is not None or self.times is not None
        if timed_itself and (self.velocities is None or self.times is None or self.hermite is None):
            raise InputError(
                "velocities and times belong together, to waypoints of a hermite section",
                came=", ".join(name for name in ("velocities", "times") if getattr(self, name) is not None),
                cure="Give both, or leave both out: speed and acceleration then say when the tip is where.",
            )
        if timed_itself and (self.speed is not None or self.acceleration is not None):
            raise InputError(
                "a section with times has no other time law", came="speed or acceleration", cure="Leave one out."
            )
        return self


class PathFile(BaseModel):
    """Schema ``truearm-path/1``."""

    model_config = STRICT
    truearm: Literal["truearm-path/1"]
    units: _Units
    frame: PathFrame = "nominal"
    tip: Triple | None = None
    target: str | None = None
    orientation: _TipOrientation | None = None
    speed: Positive
    acceleration: Positive
    step: Positive
    joint_speeds: Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    start: Triple
    sections: Annotated[tuple[_Section, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _one_tip(self) -> PathFile:
        if self.tip is not None and self.target is not None:
            raise InputError("only one of them can follow the path", came="tip and target", cure="Leave one out.")
        return self


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A path over time, as a file describes it."""

    trajectory: Trajectory  #: Where the tip shall be, in the axes of :attr:`frame`.
    section: NDArray[np.intp]  #: Number of the section of each sample, from 1, ``(n,)``.
    kinds: tuple[str, ...]  #: What each section is.
    frame: PathFrame  #: ``nominal``, ``base`` or ``world``.
    #: What follows the path, in the flange frame [m]; None for a target or the flange.
    tip: tuple[float, float, float] | None
    target: str | None  #: Name of the target that follows it; None for the tip or the flange.
    orientation: Orientation  #: orientation, rotation: how much of the orientation is kept, and which, ``(3, 3)``.
    rotation: Array
    #: Largest speed of each joint by the second, in the file's unit of angles, or of lengths for joints that slide;
    #: None if the file has none.
    joint_speeds: tuple[float, ...] | None
    units: tuple[str, str]  #: Length and angle of the file.
    source: str  #: The file, for messages.


def read_path(file: FilePath) -> PlannedPath:
    """Read a path file.

    Raises:
        InputError: If its entries cannot be, or as :func:`planned_path`.
    """
    return planned_path(read_yaml(file, PathFile), str(file))


def planned_path(content: PathFile, source: str) -> PlannedPath:
    """Return the path over time that the entries of a file describe.

    Args:
        source: The file, for messages.

    Raises:
        InputError: With the section, if a waypoint repeats, a circle has no radius or its points lie on a line, times
            do not rise, a section with times does not begin and end at rest, or there would be too many samples.
    """
    length = content.units.length

    def metres(value: float, where: str) -> float:
        return sized_si(value, length, where)

    def place(values: Triple, where: str) -> Array:
        return np.array([metres(value, where) for value in values])

    step = content.step
    at = place(content.start, f"{source}, start")
    parts: list[Trajectory] = []
    kinds, numbers, began = [], [], 0.0
    for number, section in enumerate(content.sections, 1):
        where = f"{source}, sections[{number}]"
        with refusals_at(where):
            if section.times is not None:
                part = _prescribed(section, at, step, length, where)
                kind = "hermite"
            else:
                kind, way = _way(section, at, length, where)
                speed = metres(section.speed if section.speed is not None else content.speed, where)
                own = section.acceleration if section.acceleration is not None else content.acceleration
                acceleration = metres(own, where)
                _refuse_too_many(way.length / speed, step)
                part = timed(way, speed, acceleration, step)
        new = slice(1 if parts else 0, None)  # where the section before ended
        moved = (part.position[new], part.velocity[new], part.acceleration[new])
        parts.append(Trajectory(part.time[new] + began, *moved))
        kinds.append(kind)
        numbers.append(np.full(len(parts[-1].time), number))
        began, at = float(parts[-1].time[-1]), parts[-1].position[-1]
        refuse_beyond("samples", sum(len(part.time) for part in parts), where=where)
    joined = [np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS]
    with refusals_at(f"{source}, orientation"):
        orientation, rotation = _orientation(content.orientation)
    tip = None
    if content.tip is not None:
        x, y, z = place(content.tip, f"{source}, tip")
        tip = (float(x), float(y), float(z))
    return PlannedPath(
        Trajectory(*joined),
        np.concatenate(numbers),
        tuple(kinds),
        content.frame,
        tip,
        content.target,
        orientation,
        rotation,
        content.joint_speeds,
        (length, content.units.angle),
        source,
    )


_FIELDS: Final = ("time", "position", "velocity", "acceleration")


def _way(section: _Section, start: Array, length: str, where: str) -> tuple[str, Way]:
    def place(values: Triple) -> Array:
        return np.array([sized_si(value, length, where) for value in values])

    if section.line is not None:
        return "line", Line(start, place(section.line))
    if isinstance(section.circle, _About):
        return "circle", Circle(place(section.circle.centre), start, _unit(section.circle.normal))
    if section.circle is not None:
        return "circle", Circle.through(start, *(place(point) for point in section.circle))
    assert section.hermite is not None
    return "hermite", Hermite(_waypoints(start, [place(point) for point in section.hermite], length))


def _prescribed(section: _Section, start: Array, step: float, length: str, where: str) -> Trajectory:
    """Return a section whose waypoints have times and velocities."""
    assert section.hermite is not None
    assert section.velocities is not None
    assert section.times is not None
    points = [np.array([sized_si(v, length, where) for v in point]) for point in section.hermite]
    waypoints = _waypoints(start, points, length)
    velocities = np.array([[sized_si(v, length, where) for v in velocity] for velocity in section.velocities])
    times = np.array(section.times)
    if velocities.shape != waypoints.shape or times.shape != waypoints.shape[:1]:
        raise InputError(
            "velocities and times are those of all waypoints, the start among them",
            came=f"{len(velocities)} velocities and {len(times)} times",
            allowed=f"{len(waypoints)} of each",
        )
    if velocities[0].any() or velocities[-1].any():
        raise InputError(
            "a section begins and ends at rest",
            came=f"{section.velocities[0 if velocities[0].any() else -1]}",
            allowed="[0, 0, 0] at its first and last waypoint",
        )
    if not (np.diff(times) > 0).all():
        raise InputError("times do not rise from waypoint to waypoint", came=list(section.times))
    _refuse_too_many(float(times[-1] - times[0]), step)
    return Hermite(waypoints, velocities, times).trajectory(step)


def _waypoints(start: Array, points: Sequence[Array], length: str) -> Array:
    waypoints = np.array([start, *points])
    for number, (waypoint, other) in enumerate(pairwise(waypoints), 1):
        if np.linalg.norm(other - waypoint) < _SAME:
            raise InputError(
                "a waypoint repeats the one before it",
                came=f"waypoint {number}, {np.round(other * 1e3, 3).tolist()} mm",
                cure="Leave it out: the section begins where the one before ended.",
            )
    return waypoints


def _refuse_too_many(duration: float, step: float) -> None:
    """Refuse a section of far too many samples before any of them is made."""
    refuse_beyond("samples", int(min(duration / step, 1e9)))


def _orientation(entry: _TipOrientation | None) -> tuple[Orientation, Array]:
    if entry is None:
        return "free", np.eye(3)
    if entry.quaternion is not None:
        return "full", np.asarray(rotation_from_quaternion(np.array([entry.quaternion]))[0])
    assert entry.axis is not None
    z = _unit(entry.axis)
    x = np.cross(np.eye(3)[int(np.abs(z).argmin())], z)
    x /= np.linalg.norm(x)
    return "axis", np.stack([x, np.cross(z, x), z], axis=1)


def _unit(direction: Triple) -> Array:
    largest = max(map(abs, direction))
    if largest == 0.0:
        raise InputError("a direction cannot be zero", came=list(direction))
    scaled = np.array(direction) / largest
    return np.asarray(scaled / np.linalg.norm(scaled))
