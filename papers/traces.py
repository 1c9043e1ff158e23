"""Traces that studies draw: what Plotly calls them, with the same entries in the same order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from truearm.engine.document.drawing import Figure, axis, figure, logarithmic_axis, rounded, rounded_to, scene_axis
from truearm.engine.robot.chain import Array


def scatter(name: str, mode: str, x: Sequence[Any], y: Sequence[Any], **more: object) -> Figure:
    """Return lines, markers or both in a plane; `more` follows as it is."""
    return {"type": "scatter", "mode": mode, "name": name, "x": x, "y": y, **more}


def in_space(name: str, mode: str, xyz: Iterable[Sequence[Any]], **more: object) -> Figure:
    """Return the same in space, through points of which `xyz` has the coordinates."""
    return {"type": "scatter3d", "mode": mode, "name": name, **dict(zip("xyz", xyz, strict=True)), **more}


def coordinates(points: Array, decimals: int) -> list[list[Any]]:
    """Return x, y and z of points ``(n, 3)`` with so many decimals."""
    return [rounded_to(points[:, k], decimals) for k in range(3)]


def scene(unit: str, **more: object) -> Figure:
    """Return the axes of a picture in space, a unit as long on each; `more` follows."""
    return {f"{letter}axis": scene_axis(f"{letter} [{unit}]") for letter in "xyz"} | {"aspectmode": "data", **more}


def histogram(
    shown: Iterable[tuple[str, str, Array]],
    ends: tuple[float, float],
    title: str,
    what: str,
    height: int,
    **more: object,
) -> Figure:
    """Draw how errors [mm] are distributed, over a logarithmic axis.

    Args:
        shown: Name, colour and errors of what is drawn over each other; errors beyond an end count there.
        ends: Of the axis [mm].
        title: Of the axis.
        what: What is counted.
        height: In pixels.
        more: What else each trace has.
    """
    edges = np.geomspace(*ends, 61)
    traces: list[Figure] = [
        {
            "type": "bar",
            "name": name,
            "x": rounded(np.sqrt(edges[:-1] * edges[1:]), 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(errors, *ends), edges)[0].tolist(),
            "marker": {"color": colour, "line": {"width": 0}},
            **more,
            "hovertemplate": f"{name}<br>%{{x:.3g}} mm: %{{y}} {what}<extra></extra>",
        }
        for name, colour, errors in shown
    ]
    across = logarithmic_axis(title, *ends)
    return figure(traces, height, xaxis=across, yaxis=axis(what), barmode="overlay", bargap=0)
