"""Pictures of what the hexapod device can measure (Nubiola, Figures 3.6 and 3.7)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from papers.study import Picture
from truearm.engine.data.hexapod import DEVICE, HexapodPose, distance, distinct, near_equal, triangle
from truearm.engine.document.drawing import AFTER, BEFORE, CAMERA, Figure, axis, figure, rounded, rounded_to, scene_axis
from truearm.engine.robot.chain import Array

_BASE: Final = "#2b2f33"
_NEAR: Final = "#b3261e"


def poses_figure(groups: Sequence[tuple[str, str, Sequence[HexapodPose]]]) -> Figure:
    """Draw the tool of poses over the base fixture, from each flange to its three cups.

    Args:
        groups: Name, colour and poses of what is drawn alike.
    """
    traces = [_triangles("base fixture", _BASE, [triangle([DEVICE.base] * 3, "B")], 6)]
    for name, colour, found in groups:
        traces.append(_triangles(f"{name}: tool", colour, [pose.cups for pose in found], 2))
        flanges = 1e3 * np.array([pose.position for pose in found])
        traces.append(
            {
                "type": "scatter3d",
                "mode": "markers",
                "name": f"{name}: flange",
                **{letter: rounded_to(flanges[:, n], 1) for n, letter in enumerate("xyz")},
                "text": [f"pose {pose.number}" for pose in found],
                "hovertemplate": "%{text}<extra></extra>",
                "marker": {"color": colour, "size": 4},
            }
        )
    scene = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    return figure(traces, 480, scene={**scene, "aspectmode": "data", "camera": CAMERA})


def poses_picture(found: Sequence[HexapodPose]) -> Picture:
    """Draw the 72 poses, the superfluous ones apart."""
    kept = {pose.number for pose in distinct(found)}
    groups = [
        (name, colour, [pose for pose in found if (pose.number in kept) == inside])
        for name, colour, inside in (("kept", AFTER, True), ("superfluous", BEFORE, False))
    ]
    words = "Triangles are the tool's cups, dots the flange. One of each near-equal pair is superfluous."
    return Picture("poses", "The poses that can be measured (Figure 3.6)", words, poses_figure(groups))


def distances_picture(found: Sequence[HexapodPose]) -> Picture:
    """Draw angle and distance between all pairs of poses."""
    near = set(near_equal(found))
    pairs = [(a, b) for n, a in enumerate(found) for b in found[n + 1 :]]
    apart = np.array([distance(a, b) for a, b in pairs]) * [np.degrees(1.0), 1e3]
    is_near = np.array([(a.number, b.number) in near for a, b in pairs])
    traces = [
        _cloud(name, colour, apart[mask])
        for name, colour, mask in (("pairs", AFTER, ~is_near), ("near-equal pairs", _NEAR, is_near))
    ]
    drawn = figure(traces, 380, xaxis=axis("distance of the flanges [mm]"), yaxis=axis("angle between them [deg]"))
    words = "Because the device is symmetric, every point stands for several pairs."
    return Picture("distances", "How different two poses are (Figure 3.7)", words, drawn)


def _cloud(name: str, colour: str, apart: Array) -> dict[str, Any]:
    points, counts = np.unique(np.round(apart, 2), axis=0, return_counts=True)
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": rounded(points[:, 1], 6),
        "y": rounded(points[:, 0], 6),
        "text": [f"{count} pairs" for count in counts.tolist()],
        "hovertemplate": "%{x} mm, %{y} deg: %{text}<extra></extra>",
        "marker": {"color": colour, "size": 5},
    }


def _triangles(name: str, colour: str, triangles: Sequence[Array], width: int) -> dict[str, Any]:
    """Return closed triangles ``(3, 3)`` [m] as one trace with gaps between them."""
    line: dict[str, list[float | None]] = {"x": [], "y": [], "z": []}
    for cups in triangles:
        for n, letter in enumerate("xyz"):
            line[letter] += [*rounded_to(1e3 * cups[[0, 1, 2, 0], n], 1), None]
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": name,
        **line,
        "line": {"color": colour, "width": width},
        "hoverinfo": "skip",
    }
