"""The page of a path: how far the robot is from it before and after correction, and what its joints do."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.compensation.corrected_path import STAGES
from truearm.engine.document.document import Document, Section, answer, pictured, tabled
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    CAMERA,
    COLOURS,
    Figure,
    axis,
    figure,
    rounded,
    rounded_to,
    scene_axis,
)
from truearm.engine.document.planning_figures import joint_trajectories

if TYPE_CHECKING:
    from truearm.compensation.corrected_path import Knowledge
    from truearm.compensation.path import FollowedPath

_COLOURS: Final[dict[Knowledge, str]] = {
    "nothing": BEFORE,
    "geometry": "#8a6d1d",
    "deflection": "#3b7d3b",
    "motion": AFTER,
}
_JOINTS: Final = (*COLOURS, "#8a6d1d", "#5b3a8c", "#1d7f86", "#6b6f73")
#: The errors are drawn so many times larger than they are, as a share of the path's size.
_DRAWN: Final = 0.06
_SAMPLES: Final = 800


def path_page(followed: FollowedPath) -> str:
    """Return the page."""
    path = followed.path
    pictures = []
    tables = []
    if path.calibrated:
        rows = tuple(
            (STAGES[name], f"{path.errors[name].mean() * 1e3:.3f}", f"{path.errors[name].max() * 1e3:.3f}")
            for name in followed.stages
        )
        tables.append(tabled("Distance from the path", ("correction", "mean [mm]", "largest [mm]"), rows))
        pictures.append(
            pictured(
                "errors",
                "Distance from the path",
                "As the calibrated robot predicts it in motion, for corrections that know more and more.",
                _errors(followed),
            )
        )
    pictures.append(_space(followed))
    pictures.append(
        pictured(
            "joints",
            "Joint motion",
            "Joint positions, velocities and accelerations of the controller's robot.",
            joint_trajectories(path.motion, followed.robot),
        )
    )
    if path.loads is not None:
        pictures.append(
            pictured(
                "loads",
                "Moments about the joints' axes",
                "Of the load, in motion: weight and inertia of all that lies beyond each joint.",
                _moments(followed),
            )
        )
    return Document(
        f"A path of {followed.robot.title}",
        [
            answer(followed.answer, followed.warnings),
            *tables,
            *pictures,
        ],
        followed.command,
        subtitle=f"{', '.join(path.planned.kinds)}; {path.planned.source}.",
    ).html(followed)


def _errors(followed: FollowedPath) -> Figure:
    path = followed.path
    rows = _thinned(len(path.motion.time))
    along = rounded_to(path.planned.trajectory.distance[rows] * 1e3, 2)
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": STAGES[name],
            "x": along,
            "y": rounded(path.errors[name][rows] * 1e3, 5),
            "line": {"color": _COLOURS[name], "width": 1.8},
            "hovertemplate": f"{STAGES[name]}: %{{y:.3g}} mm at %{{x:.0f}} mm<extra></extra>",
        }
        for name in followed.stages
    ]
    return figure(traces, 380, xaxis=axis("along the path [mm]"), yaxis=axis("distance from the path [mm]"))


def _space(followed: FollowedPath) -> Section:
    """Draw the path, and how far beside it the robot goes, enlarged."""
    path = followed.path
    rows = _thinned(len(path.motion.time))
    wanted = path.planned.trajectory.position[rows]
    traces = [_curve("path", wanted, "#2b2f33", 4)]
    words = "In the frame of the path."
    if path.calibrated:
        beside = path.tips["nothing"][rows] - wanted
        largest = float(np.linalg.norm(beside, axis=1).max())
        size = float(np.ptp(wanted, axis=0).max())
        times = 10.0 ** np.floor(np.log10(_DRAWN * size / largest)) if largest > 0.0 and size > 0.0 else 1.0
        traces.append(_curve(f"without correction, error times {times:g}", wanted + times * beside, "#b3261e", 3))
        words = f"In the frame of the path. What the robot misses it by is drawn {times:g} times as large."
    scene = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    drawn = figure(
        traces, 560, scene={**scene, "aspectmode": "data", "camera": CAMERA}, margin={"l": 0, "r": 0, "t": 40, "b": 0}
    )
    return pictured("space", "The path", words, drawn)


def _curve(name: str, points: np.ndarray, colour: str, width: int) -> Figure:
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": name,
        **{letter: rounded_to(1e3 * column, 3) for letter, column in zip("xyz", points.T, strict=True)},
        "line": {"color": colour, "width": width},
        "hovertemplate": f"{name}: %{{x:.1f}}, %{{y:.1f}}, %{{z:.1f}} mm<extra></extra>",
    }


def _moments(followed: FollowedPath) -> Figure:
    path = followed.path
    assert path.loads is not None
    rows = _thinned(len(path.motion.time))
    traces = []
    for number, joint in enumerate(followed.robot.joints):
        turns = joint.kind == "revolute"
        name, unit = html.escape(joint.name), "N m" if turns else "N"
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": name,
                "x": rounded(path.motion.time[rows], 6),
                "y": rounded(path.loads[number, 5 if turns else 2][rows], 6),
                "line": {"color": _JOINTS[number % len(_JOINTS)], "width": 1.8},
                "hovertemplate": f"{name}: %{{y:.4g}} {unit} at %{{x:.3f}} s<extra></extra>",
            }
        )
    slides = any(joint.kind == "prismatic" for joint in followed.robot.joints)
    title = "moment [N m], force [N]" if slides else "moment [N m]"
    return figure(traces, 380, xaxis=axis("time [s]"), yaxis=axis(title))


def _thinned(count: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, _SAMPLES)).round().astype(np.intp))
