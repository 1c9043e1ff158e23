"""Joint tables: the answers of inverse kinematics as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

from truearm.modeling.controller import Controller
from truearm.modeling.formats.joint_columns import joint_cells, joint_headings
from truearm.modeling.inverse.solutions import JointSolutions
from truearm.modeling.parts import Joint


def joints_csv(
    solutions: JointSolutions, labels: Sequence[str], joints: Sequence[Joint], controller: Controller | None = None
) -> str:
    """Return solutions as CSV, one row a pose and branch, joints in deg or mm.

    Args:
        labels: Name of each pose.
        joints: Of the robot.
        controller: Who shows the joint positions, ``axis_i``; None for the model's, ``joint_i``.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [
            "pose",
            "branch",
            "status",
            *joint_headings(joints, controller),
            "position_error [mm]",
            "orientation_error [mrad]",
        ]
    )
    for row, positions in enumerate(joint_cells(solutions.joints, joints, controller)):
        angle = float(solutions.orientation_error[row])
        writer.writerow(
            [
                labels[solutions.pose[row]],
                solutions.branch[row],
                solutions.status[row].value,
                *positions,
                f"{solutions.position_error[row] * 1e3:.6g}",
                "" if math.isnan(angle) else f"{angle * 1e3:.6g}",
            ]
        )
    return stream.getvalue()
