"""The base fixture in the studies of the hexapod device: where it stands, which is invented, and poses over it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from papers.campaign import touching
from papers.traces import coordinates, in_space, scene
from truearm.engine.data.hexapod import DEVICE, HexapodPose, triangle
from truearm.engine.document.drawing import CAMERA, Figure, figure, rounded_to
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

_DOWN: Final = np.diag([1.0, -1.0, -1.0])


def fixture_at(centre: tuple[float, float, float], turn: float, tilt: float = 0.0, towards: float = 0.0) -> Transform:
    """Return the fixture whose triangle has its centre at a point.

    Args:
        centre: In the robot's base frame [m].
        turn: About its own normal [deg].
        tilt, towards: How far the normal leans from the vertical, and in which direction [deg].
    """
    lean = _turned_about_z(towards) @ _turned_about_y(tilt) @ _turned_about_z(turn - towards)
    middle = triangle([DEVICE.base] * 3, "B").mean(axis=0)
    return Transform.from_matrix(lean, np.array(centre) - lean @ middle)


def placed(outer: Transform, inner: Transform) -> Transform:
    """Return a frame that is given in another one, where that one stands."""
    R = outer.rotation
    return Transform.from_matrix(R @ inner.rotation, R @ np.array(inner.translation) + np.array(outer.translation))


def touched(robot: Robot, fixture: Transform) -> Array:
    """Return joint positions that bring the robot's first cup to the base cups, the flange looking at the fixture."""
    down = fixture.rotation @ _DOWN
    return touching(robot, robot.targets[0].name, fixture, DEVICE.base, down)


def _turned_about_z(angle: float) -> Array:
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _turned_about_y(angle: float) -> Array:
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


#: At this place an IRB 120 reaches 22 poses with its elbow up, 17 of them with two wrist configurations: the counts of
#: Nubiola, 3.5.
PLACE: Final = fixture_at((0.30, 0.05, 0.25), 4.0, 51.0, -43.0)


def poses_figure(groups: Sequence[tuple[str, str, Sequence[HexapodPose]]]) -> Figure:
    """Draw the tool of poses over the base fixture, from each flange to its three cups.

    Args:
        groups: Name, colour and poses of what is drawn alike.
    """
    traces = [_triangles("base fixture", "#2b2f33", [triangle([DEVICE.base] * 3, "B")], 6)]
    for name, colour, found in groups:
        traces.append(_triangles(f"{name}: tool", colour, [pose.cups for pose in found], 2))
        flanges = 1e3 * np.array([pose.position for pose in found])
        said = {"text": [f"pose {pose.number}" for pose in found], "hovertemplate": "%{text}<extra></extra>"}
        traces.append(
            in_space(f"{name}: flange", "markers", coordinates(flanges, 1), **said, marker={"color": colour, "size": 4})
        )
    return figure(traces, 480, scene=scene("mm", camera=CAMERA))


def _triangles(name: str, colour: str, triangles: Sequence[Array], width: int) -> Figure:
    """Return closed triangles ``(3, 3)`` [m] as one trace with gaps between them."""
    closed = [[[*rounded_to(1e3 * cups[[0, 1, 2, 0], n], 1), None] for cups in triangles] for n in range(3)]
    places = [[place for cups in one for place in cups] for one in closed]
    return in_space(name, "lines", places, line={"color": colour, "width": width}, hoverinfo="skip")
