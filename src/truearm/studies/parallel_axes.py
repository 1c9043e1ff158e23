"""The document's own model of the IRB 120: nothing tilts axis 3 sideways against axis 2."""

from __future__ import annotations

from dataclasses import replace

from truearm.modeling.robot import Robot


def without_beta(robot: Robot) -> Robot:
    """Return an IRB 120 without Hayati's beta between its parallel axes 2 and 3 (Nubiola, Table 2.2)."""
    third = robot.joints[2]
    row = {column: value for column, value in third.row.items() if column != "beta"}
    return replace(robot, joints=(*robot.joints[:2], replace(third, row=row), *robot.joints[3:]))
