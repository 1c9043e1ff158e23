"""A tour as CSV, and in words."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping

from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting, joint_cells, joint_headings
from truearm.modeling.robot import Robot
from truearm.planning.driving.cell import FLOOR, stands
from truearm.planning.driving.collisions import KEPT_OUT, LINKS
from truearm.planning.driving.tour import Tour
from truearm.shown import counted


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
    """Return how near an arm comes to each thing, as :func:`~.nearest.nearest_on` has it; nothing if to none.

    Args:
        floor: Its height [m]; None if none is kept clear.
        surface: What it is called.
        connected: How much of the arm is left out where two links are connected, at most [m].
    """
    # Down to a tenth of a millimetre: never more than there is.
    near = [
        (f"{math.floor(room * 1e4) / 10:g} mm", _thing(what, floor, surface, connected))
        for what, room in distances.items()
    ]
    return ", ".join(f"{room}{'' if k else ' or more'} from {thing}" for k, (room, thing) in enumerate(near))


def _thing(what: str, floor: float | None, surface: str, connected: float) -> str:
    """Return what the arm comes near in words."""
    if what == LINKS:
        stretch = math.ceil(connected * 100.0) * 10
        return f"its own links (but for up to {stretch} mm of the arm where two are connected)"
    if what == FLOOR and floor is not None:
        return f"the {surface} at {floor * 1e3:g} mm"
    return f"the box '{what.removeprefix(KEPT_OUT)}'"
