"""The IRB 120 as Nubiola models it, for the studies of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from truearm.engine.fit.models import Model, named_model
from truearm.engine.robot.robot import Robot

#: Frees what the document's Table 2.2 does, and Hayati's beta.
ELASTIC: Final[Model] = named_model("elastic")


def without_beta(robot: Robot) -> Robot:
    """Return an IRB 120 without Hayati's beta between its parallel axes 2 and 3 (Nubiola, Table 2.2).

    It is the document's own model: nothing tilts axis 3 sideways against axis 2.
    """
    third = robot.joints[2]
    row = {column: value for column, value in third.row.items() if column != "beta"}
    return replace(robot, joints=(*robot.joints[:2], replace(third, row=row), *robot.joints[3:]))
