"""What is planned, in pictures: poses in their cube (Patel, figure 4.8) and joint trajectories (figure 5.7)."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.document.drawing import (
    CAMERA,
    COLOURS,
    Figure,
    axis,
    base_axes,
    figure,
    rounded,
    rounded_to,
    scene_axis,
)
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.joint_motion import JointMotion
from truearm.engine.motion.largest_cube import PosePlan
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot

_PLANES: Final = (*COLOURS, "#8a6d1d")
_JOINTS: Final = (*_PLANES, "#5b3a8c", "#1d7f86", "#6b6f73")
_EDGE: Final = "#2b2f33"
#: The tails that show the tip's direction, by the side of the cube.
_TAIL: Final = 0.06
#: Curves are drawn through at most so many samples.
_SAMPLES: Final = 800
#: For each kind of joint, what turns SI into what is shown, and the unit.
_SHOWN: Final = {"revolute": (180.0 / np.pi, "deg"), "prismatic": (1e3, "mm")}


def pose_cube(plan: PosePlan, paths: Mapping[str, Array] | None = None) -> Figure:
    """Show a cube with its diagonal planes, the poses on them in their order, and the directions of the tip.

    Args:
        plan: The poses.
        paths: Points of paths to draw with them, by name, ``(n, 3)`` each [m].
    """
    traces = [_edges(plan.cube)]
    tails = plan.points - _TAIL * plan.cube.side * plan.approach
    for plane, colour in zip(plan.cube.planes, _PLANES, strict=True):
        rows = np.array([k for k, name in enumerate(plan.plane) if name == plane.name], dtype=int)
        corners = plane.points([1, -1, -1, 1], [1, 1, -1, -1])
        traces.append(
            {
                "type": "mesh3d",
                **_coordinates(corners),
                "i": [0, 0],
                "j": [1, 2],
                "k": [2, 3],
                "color": colour,
                "opacity": 0.12,
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
        if not len(rows):
            continue
        traces.append(_strokes(plan.points[rows], tails[rows], colour))
        traces.append(
            {
                "type": "scatter3d",
                "mode": "markers",
                "name": f"plane {plane.name}, {len(rows)} poses",
                **_coordinates(plan.points[rows]),
                "customdata": (rows + 1).tolist(),
                "marker": {"size": 3.5, "color": colour},
                "hovertemplate": "pose %{customdata}<br>x %{x:.1f}, y %{y:.1f}, z %{z:.1f} mm<extra></extra>",
            }
        )
    for (name, points), colour in zip((paths or {}).items(), _JOINTS[::-1], strict=False):
        traces.append(
            {
                "type": "scatter3d",
                "mode": "lines",
                "name": html.escape(name),
                **_coordinates(points[_thinned(len(points))]),
                "line": {"color": colour, "width": 5},
            }
        )
    scene = {name: scene_axis(f"{name[0]} [mm]") for name in ("xaxis", "yaxis", "zaxis")}
    return figure(
        [*traces, *base_axes(0.4e3 * plan.cube.side)],
        640,
        scene={"aspectmode": "data", "camera": CAMERA, **scene},
        margin={"l": 0, "r": 0, "t": 50, "b": 0},
    )


def joint_trajectories(motion: JointMotion, robot: Robot) -> Figure:
    """Show joint positions, velocities and accelerations of all joints over time, one below the other."""
    samples = _thinned(len(motion.time))
    traces: list[Figure] = []
    panels = ((motion.joints, "y", ""), (motion.velocity, "y2", "/s"), (motion.acceleration, "y3", "/s²"))
    for values, place, per in panels:
        for number, joint in enumerate(robot.joints):
            scale, unit = _SHOWN[joint.kind]
            name = html.escape(joint.name)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": name,
                    "legendgroup": str(number),
                    "showlegend": place == "y",
                    "x": rounded(motion.time[samples], 6),
                    "y": rounded(scale * values[samples, number], 6),
                    "yaxis": place,
                    "line": {"color": _JOINTS[number % len(_JOINTS)], "width": 1.8},
                    "hovertemplate": f"{name}: %{{y:.4g}} {unit}{per} at %{{x:.3f}} s<extra></extra>",
                }
            )
    kinds = dict.fromkeys(joint.kind for joint in robot.joints)
    units = [" or ".join(f"{_SHOWN[kind][1]}{per}" for kind in kinds) for _, _, per in panels]
    titles = ("position", "velocity", "acceleration")
    domains: Sequence[list[float]] = ([0.70, 1.0], [0.36, 0.66], [0.0, 0.30])
    axes = {
        f"yaxis{number or ''}": {**axis(f"{title} [{unit}]"), "domain": domain}
        for number, title, unit, domain in zip((0, 2, 3), titles, units, domains, strict=True)
    }
    return figure(traces, 640, xaxis={**axis("time [s]"), "anchor": "y3"}, **axes)


def _edges(cube: Cube) -> Figure:
    corners = cube.corners
    pairs = [*((k, (k + 1) % 4) for k in range(4)), *((k + 4, (k + 1) % 4 + 4) for k in range(4))]
    pairs += [(k, k + 4) for k in range(4)]
    first, second = zip(*pairs, strict=True)
    return _strokes(corners[list(first)], corners[list(second)], _EDGE)


def _strokes(start: Array, end: Array, colour: str) -> Figure:
    gaps = np.full(start.shape, np.nan)
    points = np.stack([start, end, gaps], axis=1).reshape(-1, 3)
    return {
        "type": "scatter3d",
        "mode": "lines",
        **_coordinates(points),
        "line": {"color": colour, "width": 2},
        "hoverinfo": "skip",
        "showlegend": False,
    }


def _coordinates(points: Array) -> Figure:
    """Return x, y and z [mm]; a gap where a point is NaN."""
    columns = [[None if np.isnan(value) else value for value in rounded_to(1e3 * column, 2)] for column in points.T]
    return dict(zip("xyz", columns, strict=True))


def _thinned(count: int) -> NDArray[np.intp]:
    """Return the indices of samples to draw, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, _SAMPLES)).round().astype(np.intp))
