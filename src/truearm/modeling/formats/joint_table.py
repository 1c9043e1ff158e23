"""Joint tables: the answers of inverse kinematics as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

from truearm.modeling.inverse.solutions import JointSolutions
from truearm.modeling.parts import Joint
from truearm.units import written


def joints_csv(solutions: JointSolutions, labels: Sequence[str], joints: Sequence[Joint]) -> str:
    """Return solutions as CSV, one row a pose and branch, joints in deg or mm.

    Parameters
    ----------
    labels
        Name of each pose.
    joints
        Of the robot.
    """
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in joints]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [
            "pose",
            "branch",
            "status",
            *(f"joint_{number} [{unit}]" for number, unit in enumerate(units, 1)),
            "position_error [mm]",
            "orientation_error [mrad]",
        ]
    )
    for row, positions in enumerate(solutions.joints.tolist()):
        angle = float(solutions.orientation_error[row])
        writer.writerow(
            [
                labels[solutions.pose[row]],
                solutions.branch[row],
                solutions.status[row].value,
                *(repr(written(value, unit)) for value, unit in zip(positions, units, strict=True)),
                f"{solutions.position_error[row] * 1e3:.6g}",
                "" if math.isnan(angle) else f"{angle * 1e3:.6g}",
            ]
        )
    return stream.getvalue()
