"""Whether the file of a robot has limits of joints beyond those that the library knows for an arm of its name."""

from __future__ import annotations

import math
from typing import Final

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot

#: Limits that differ by less were rounded [rad or m].
_ROUNDED = math.radians(0.05)


LIMITS_WIDER: Final = Rule(
    "limits-wider",
    "note",
    "the robot file has the name of a robot of the library, and limits of joints beyond those of the library; the "
    "message names both",
    cure="See that this arm has these limits: its controller stops where it has others.",
)


def wider_limits_notices(robot: Robot) -> list[Notice]:
    """Return what to know of a robot that has the name of one of the library and may turn its joints further."""
    if robot.name not in library():
        return []
    known = load_robot(robot.name)
    if [joint.kind for joint in known.joints] != [joint.kind for joint in robot.joints]:
        return []
    wider = [
        f"joint {number} {_words(joint)} ({_words(in_library)} in the library)"
        for number, (joint, in_library) in enumerate(zip(robot.joints, known.joints, strict=True), 1)
        if _is_wider(joint, in_library)
    ]
    if not wider:
        return []
    return [
        LIMITS_WIDER(
            f"The robot is called {robot.name}, and its joints go further than those of {robot.name} in the library: "
            f"{'; '.join(wider)}."
        )
    ]


def _is_wider(joint: Joint, known: Joint) -> bool:
    if known.limits is None:
        return False
    if joint.limits is None:
        return True
    return joint.limits[0] < known.limits[0] - _ROUNDED or joint.limits[1] > known.limits[1] + _ROUNDED


def _words(joint: Joint) -> str:
    if joint.limits is None:
        return "without limits"
    unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
    low, high = (f"{size * limit:.5g}" for limit in joint.limits)
    return f"{low} to {high} {unit}"
