"""Pictures of the study katana-trajectory: one seed along the circle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from papers.katana.circle import PENCIL
from papers.katana.robot import TIP, katana
from papers.katana_trajectory.run import MODELS, SOURCES, Cause, Outcome
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded, scene_axis
from truearm.engine.document.planning_figures import joint_trajectories
from truearm.engine.motion.cell import skeleton
from truearm.engine.robot.chain import Array

_JOINT_COLOURS: Final = (*COLOURS, "#8a6d1d", "#5b3a8c")


def robot_picture(first: Outcome) -> Picture:
    """Draw arm and circle, as in Figure 5.6."""
    robot = katana(PENCIL)
    circle = robot.world_poses(first.motion.joints, TIP)[0]
    start = first.motion.joints[:1]
    arm = np.concatenate([*skeleton(robot, start), robot.world_poses(start, TIP)[0]])
    traces: list[Figure] = [
        {
            "type": "scatter3d",
            "mode": mode,
            "name": name,
            **{letter: rounded(1e3 * points[:, k], 5) for k, letter in enumerate("xyz")},
            "line": {"color": colour, "width": width},
            "marker": {"color": colour, "size": 4},
        }
        for name, points, colour, mode, width in (
            ("circle", circle, "#b3261e", "lines", 4),
            ("arm", arm, AFTER, "lines+markers", 7),
        )
    ]
    scene: Figure = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    scene |= {"aspectmode": "data", "camera": {"eye": {"x": 1.9, "y": 2.3, "z": 1.3}, "center": {"z": -0.2}}}
    return Picture(
        "robot",
        "The arm at the beginning of the circle, as in Figure 5.6",
        "First seed, nominal, from the base to the pencil's tip. The circle lies on a diagonal plane of a cube of ISO"
        " 9283.",
        figure(traces, 460, scene=scene),
    )


def joints_picture(first: Outcome) -> Picture:
    """Draw the joints' motion, as in Figure 5.7."""
    return Picture(
        "joints",
        "Joint trajectories, as in Figure 5.7",
        "First seed, from the point on the positive x axis: what the nominal robot has to do.",
        joint_trajectories(first.motion, katana()),
    )


def _curve(first: Outcome, name: str, values: Array, colour: str, unit: str, dash: str = "solid") -> Figure:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": rounded(first.distance, 5),
        "y": rounded(values, 5),
        "line": {"color": colour, "width": 1.8, "dash": dash},
        "hovertemplate": f"{name}: %{{y:.3g}} {unit} at %{{x:.0f}} mm<extra></extra>",
    }


def _along(traces: list[Figure], title: str, height: int = 360) -> Figure:
    return figure(traces, height, xaxis=axis("along the circle [mm]"), yaxis=axis(title))


def about_picture(first: Outcome) -> Picture:
    """Draw the moments about the joints' axes, as in Figure 5.8."""
    traces = [
        _curve(first, f"joint {joint + 1}", first.loads[joint, 5], colour, "N m")
        for joint, colour in enumerate(_JOINT_COLOURS)
    ]
    return Picture(
        "about",
        "Moments about the joints' axes, as in Figure 5.8",
        "First seed, of the load; the motors' torques are the opposite.",
        _along(traces, "moment about z [N m]"),
    )


def across_picture(first: Outcome) -> Picture:
    """Draw the moments across the joints' axes, as in Figure 5.9."""
    traces = [
        _curve(first, f"joint {joint + 1}, {name}", first.loads[joint, row], colour, "N m", dash)
        for joint, colour in enumerate(_JOINT_COLOURS)
        for row, name, dash in ((3, "x", "solid"), (4, "y", "dot"))
    ]
    return Picture(
        "across",
        "Moments across the joints' axes, as in Figure 5.9",
        "First seed, about x and y of each joint's own frame. Bearings carry them, and joints lean where they push.",
        _along(traces, "moment about x and y [N m]", 420),
    )


def predicted_picture(first: Outcome) -> Picture:
    """Draw the predicted distance from the circle, as in Figure 5.10."""
    shown: Mapping[Cause, tuple[str, str]] = {
        "stiffness alone": (AFTER, "solid"),
        "tilting": ("#b3261e", "solid"),
        "tilting, full gap": ("#b3261e", "dot"),
    }
    traces = [
        _curve(first, cause, first.predicted[cause], colour, "mm", dash) for cause, (colour, dash) in shown.items()
    ]
    return Picture(
        "predicted",
        "Predicted distance from the circle, as in Figure 5.10",
        "First seed, geometry perfect.",
        _along(traces, "distance from the circle [mm]"),
    )


def followed_picture(first: Outcome) -> Picture:
    """Draw the distance of the twin's tip from the circle, as in Figure 5.12."""
    colours = ("#8a6d1d", "#b3261e", AFTER)
    traces = [_curve(first, "before", first.before, BEFORE, "mm")]
    traces += [
        _curve(first, f"{model}, geometry from the {source}", first.corrected[model, source].circle, colour, "mm", dash)
        for source, dash in zip(reversed(SOURCES), ("solid", "dot"), strict=True)
        for model, colour in zip(MODELS, colours, strict=True)
    ]
    return Picture(
        "followed",
        "Distance of the twin's tip from the circle, as in Figure 5.12",
        "First seed, with corrected readings and before.",
        _along(traces, "distance from the circle [mm]", 440),
    )
