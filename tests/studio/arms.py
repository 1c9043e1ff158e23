"""Arms for the scene that no maker's table has: gantries, rails, a SCARA, arms of which little is known."""

from __future__ import annotations

import math
from typing import Final

from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot

Row = dict[str, float]


def arm(name: str, *joints: tuple[JointKind, Row, tuple[float, float] | None]) -> Robot:
    """Return an arm of some rows of Denavit and Hartenberg [m, rad]."""
    rows = (Joint(f"J{k}", kind, row, limits) for k, (kind, row, limits) in enumerate(joints, 1))
    return Robot(name, name, "", "standard-dh", tuple(rows))


_ACROSS: Final = {"alpha": math.pi / 2}
SCARA: Final = arm(
    "scara",
    ("revolute", {"d": 0.4, "a": 0.3}, (-2.3, 2.3)),
    ("revolute", {"a": 0.25, "alpha": math.pi}, (-2.6, 2.6)),
    ("prismatic", {"d": 0.1}, (0.0, 0.2)),
    ("revolute", {}, None),
)
GANTRY: Final = arm(
    "gantry",
    ("prismatic", _ACROSS, (0.0, 1.5)),
    ("prismatic", {"d": 0.1, "theta_offset": math.pi / 2, **_ACROSS}, (0.0, 1.0)),
    ("prismatic", {}, (-0.6, 0.0)),
)
ON_A_RAIL: Final = arm(
    "rail",
    ("prismatic", {"alpha": math.pi / 2}, (-1.0, 1.0)),
    ("revolute", {"d": 0.3, **_ACROSS}, (-3.0, 3.0)),
    ("revolute", {"a": 0.5}, (-2.0, 2.0)),
    ("revolute", {"a": 0.4}, (-2.5, 2.5)),
)
#: No length at all, no limits: two joints in one point.
POINT: Final = arm("point", ("revolute", _ACROSS, None), ("revolute", {}, None))
ODD: Final = (SCARA, GANTRY, ON_A_RAIL, POINT)
