"""Whether links may lie beside the lines of the model, along joint axes that are parallel."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.planning.constraints.constraints import at_the_origin

#: What lies less beside is within the thickness of a link [m].
_SMALL: Final = 0.01
_PARALLEL: Final = 1e-4


def links_beside(robot: Robot) -> tuple[tuple[tuple[int, ...], float], ...]:
    """Return joints, from 1, whose axes are parallel, and how far they lead along these axes [m].

    Where along parallel axes a link lies does not change where it takes what follows, so a model may have the whole
    way along them at one joint, and its lines beside the links. Joint tables of Universal Robots have it at joint 4.
    """
    arm, found = at_the_origin(robot).rigid, []
    kinematics = arm.forward_kinematics(np.zeros((1, len(robot.joints))))
    moving = arm.moving[: len(robot.joints)]
    axes = [kinematics.axis(i).reshape(3) for i in moving]
    origins = [kinematics.origin(i).reshape(3) for i in moving] + [kinematics.position.reshape(3)]
    turning = [joint.kind == "revolute" for joint in robot.joints]
    first = 0
    while first < len(axes):
        last = first
        while (
            last + 1 < len(axes)
            and turning[first]
            and turning[last + 1]
            and np.linalg.norm(np.cross(axes[first], axes[last + 1])) < _PARALLEL
        ):
            last += 1
        along = abs(float(axes[first] @ (origins[last + 1] - origins[first])))
        if last > first and along >= _SMALL:
            found.append((tuple(range(first + 1, last + 2)), along))
        first = last + 1
    return tuple(found)


def beside_notices(robot: Robot) -> list[Notice]:
    """Return what to know of an arm whose links may lie beside the lines of the model."""
    notices = []
    for joints, along in links_beside(robot):
        numbers = f"{', '.join(str(j) for j in joints[:-1])} and {joints[-1]}"
        notices.append(
            Notice(
                "links-beside",
                f"The axes of joints {numbers} are parallel, and no model says where along them the links are: they "
                f"may lie {1e3 * along:.0f} mm or somewhat more beside the lines of the model. For these links the "
                "distance that is stated and the `clearance` do not hold, and they may be nearer by so much. State a "
                "`clearance` larger by that, and compare with a drawing of the arm.",
            )
        )
    return notices
