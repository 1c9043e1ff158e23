"""The page of a set of poses: where they lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.document.document import Document, answer, pictured
from truearm.engine.document.drawing import AFTER, CAMERA, Figure, base_axes, figure, rounded_to, scene_axis
from truearm.engine.document.planning_figures import pose_cube
from truearm.engine.motion.largest_cube import PosePlan

if TYPE_CHECKING:
    from truearm.planning.posing import PlannedPoses


def pose_set_page(poses: PlannedPoses) -> str:
    """Return the page of a set."""
    pose_set, cube = poses.made, poses.made.cube
    if cube is None or not pose_set.planes:
        drawn, words = _points(poses), "Points in the robot's base frame, joined in the order in which to go to them."
    else:
        approach = pose_set.rotation[:, :, 2]
        drawn = pose_cube(
            PosePlan(cube, pose_set.position, approach, pose_set.planes, pose_set.joints, pose_set.target)
        )
        words = "The cube with its diagonal planes. Tails show from where the tip's z axis comes."
    return Document(
        f"Poses of {poses.robot.title}",
        [
            answer(poses.answer, poses.warnings),
            pictured("poses", "Where the poses are", words, drawn),
        ],
        poses.command,
        subtitle=f"{len(pose_set.labels)} poses of the set {pose_set.name}.",
    ).html(poses)


def _points(poses: PlannedPoses) -> Figure:
    points = 1e3 * poses.made.position
    trace = {
        "type": "scatter3d",
        "mode": "lines+markers",
        **{letter: rounded_to(column, 2) for letter, column in zip("xyz", points.T, strict=True)},
        "customdata": list(poses.made.labels),
        "marker": {"size": 4, "color": AFTER},
        "line": {"color": "#c8ccd0", "width": 2},
        "hovertemplate": "pose %{customdata}<br>x %{x:.1f}, y %{y:.1f}, z %{z:.1f} mm<extra></extra>",
        "showlegend": False,
    }
    length = float(np.ptp(points, axis=0).max()) or 100.0
    scene = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    return figure(
        [trace, *base_axes(0.4 * length)],
        640,
        scene={**scene, "aspectmode": "data", "camera": CAMERA},
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
    )
