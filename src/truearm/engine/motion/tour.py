"""A tour: where the arm stops, from its safe configuration and back to it; as CSV, and in words."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from truearm.engine.base.errors import Notice, counted
from truearm.engine.motion.cell import FLOOR, stands
from truearm.engine.motion.collisions import KEPT_OUT, LINKS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings

#: Why the arm stops: in its safe configuration, on a way around something, right before a measurement, or to measure.
StopKind = Literal["home", "via", "approach", "measure"]
#: Name of the safe configuration in which every tour starts and ends.
HOME: Final = "home"


@dataclass(frozen=True, eq=False)
class Stop:
    """A configuration that is driven to with all joints moving at once, from the one before."""

    joints: Array  #: Joint positions of the model [rad or m], ``(joints,)``.
    kind: StopKind  #: Why the arm stops there.
    label: str | None = None  #: Name of the configuration that is measured; None for every other kind.


@dataclass(frozen=True, eq=False)
class Tour:
    """Stops in driving order; the first and the last are the safe configuration."""

    stops: tuple[Stop, ...]  #: Three or more.
    floor: float | None  #: Height of the floor in the base frame [m]; None if none is kept clear.
    clearance: float  #: What is kept between the arm and the floor, boxes and its own links [m].
    distance: float  #: The smallest such distance on the ways [m]; infinite if there is nothing to come close to.
    surface: str = FLOOR  #: What the plane at the height `floor` is called.
    #: How near the arm comes to each thing on the ways [m], the smallest first: ``floor``, ``keep_out`` and the name of
    #: a box, ``links`` for its own.
    distances: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()  #: What is to be known of what was kept clear.
    #: How much of the arm is left out of the distance of its links where two are connected, at most [m].
    connected: float = 0.0

    @property
    def joints(self) -> Array:
        """Joint positions of all stops, ``(stops, joints)`` [rad or m]."""
        return np.array([stop.joints for stop in self.stops])

    @property
    def home(self) -> Array:
        """The safe configuration, ``(joints,)`` [rad or m]."""
        return self.stops[0].joints

    @property
    def measured(self) -> tuple[Stop, ...]:
        """The stops at which something is measured, in driving order."""
        return tuple(stop for stop in self.stops if stop.kind == "measure")


def tour_csv(tour: Tour, robot: Robot, joints_are: JointsOf = "model") -> str:
    """Return every stop of a tour as CSV, one row a stop in driving order, joints in deg or mm.

    ``stop`` says why the arm stops: ``home``, ``via``, ``approach`` or ``measure``; ``configuration`` is what is
    measured there. Joints are ``joint_i``, or ``axis_i`` as the controller shows them.
    """
    controller = counting(robot, joints_are)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["stop", "configuration", *joint_headings(robot.joints, controller)])
    for stop, cells in zip(tour.stops, joint_cells(tour.joints, robot.joints, controller), strict=True):
        writer.writerow([stop.kind, stop.label or "", *cells])
    return stream.getvalue()


def home_shown(home: Array, robot: Robot, joints_are: JointsOf = "model") -> list[float]:
    """Return the safe configuration ``(joints,)`` of the model in deg or mm, as a person reads it."""
    return [float(cell) + 0.0 for cell in joint_cells(home[None], robot.joints, counting(robot, joints_are))[0]]


def tour_words(tour: Tour, robot: Robot, joints_are: JointsOf = "model") -> list[str]:
    """Return what is to know about a tour: where it starts and ends, and how near the arm comes to what."""
    home = ", ".join(f"{round(value, 1) + 0.0:g}" for value in home_shown(tour.home, robot, joints_are))
    vias = sum(stop.kind == "via" for stop in tour.stops)
    over = f", {counted(vias, 'via point')} among them" if vias else ""
    text = [f"Driven from home ({home}) and back in {counted(len(tour.stops) - 1, 'move')}{over}."]
    near = distance_words(tour.distances, tour.floor, tour.surface, tour.connected)
    if near:
        text.append(f"All the way the arm stays {near}.")
    if not stands(robot):
        mounted = "Its mounting surface is not" if tour.floor is None else "Only its mounting surface is"
        text.append(f"{mounted} kept clear: by its gravity the robot does not stand; boxes say what else is there.")
    return text


def distance_words(distances: Mapping[str, float], floor: float | None, surface: str, connected: float) -> str:
    """Return how near an arm comes to each thing, as ``nearest_on`` has it; nothing if to none.

    Args:
        floor: Its height [m]; None if none is kept clear.
        surface: What it is called.
        connected: How much of the arm is left out where two links are connected, at most [m].
    """
    # Down to a tenth of a millimetre: never more than there is.
    near = [
        (f"{math.floor(distance * 1e4) / 10:g} mm", _thing(thing, floor, surface, connected))
        for thing, distance in distances.items()
    ]
    return ", ".join(f"{distance}{'' if k else ' or more'} from {thing}" for k, (distance, thing) in enumerate(near))


def _thing(thing: str, floor: float | None, surface: str, connected: float) -> str:
    """Return what the arm comes near in words."""
    if thing == LINKS:
        stretch = math.ceil(connected * 100.0) * 10
        return f"its own links (but for up to {stretch} mm of the arm where two are connected)"
    if thing == FLOOR and floor is not None:
        return f"the {surface} at {floor * 1e3:g} mm"
    return f"the box '{thing.removeprefix(KEPT_OUT)}'"


def ways_beside(table: Path) -> Path:
    """Return where the stops of a plan are written, beside its table."""
    return table.with_name(f"{table.stem}-ways.csv")


def sheet_beside(table: Path) -> Path:
    """Return where the sheet for the operator of a plan is written, beside its table."""
    return table.with_name(f"{table.stem}-sheet.html")


def tour_summary(tour: Tour, robot: Robot, joints_are: JointsOf) -> dict[str, Any]:
    """Return a tour as JSON holds it: lengths in mm, joints in deg or mm as the file counts them."""
    return {
        "moves": len(tour.stops) - 1,
        "via_points": sum(stop.kind == "via" for stop in tour.stops),
        "home": home_shown(tour.home, robot, joints_are),
        "floor_mm": None if tour.floor is None else 1e3 * tour.floor,
        "clearance_mm": 1e3 * tour.clearance,
        "room_mm": 1e3 * tour.distance if math.isfinite(tour.distance) else None,
        "distances_mm": {thing: 1e3 * distance for thing, distance in tour.distances.items()},
    }
