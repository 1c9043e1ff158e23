"""Where links may lie beside the lines of the model, along joint axes that are parallel.

Where along parallel axes a link lies does not change where it takes what follows, so a model may have the whole way
along them at one joint, and its lines beside the links. Joint tables of Universal Robots have it at joint 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.planning.constraints.constraints import at_the_origin

#: What lies less beside is within the thickness of a link [m].
_SMALL: Final = 0.01
#: Axes of a calibrated robot are parallel, too: factories miss by a tenth of this [rad].
_PARALLEL: Final = 0.01
#: Links are looked for up to so many times what the model and the centres of gravity have. The upper arms of UR3 to
#: UR30 lie at 0.92 to 1.35 times the way along the axes, the forearms at 0.05 to 0.30 (``offsets`` of the
#: physical_parameters.yaml in UniversalRobots/Universal_Robots_ROS2_Description).
BEYOND: Final = 1.4


@dataclass(frozen=True)
class Beside:
    """Joints whose axes are parallel, and where along them their links may lie.

    Places are along the axis of the first, from its origin, positive to the side to which more of them lie.
    """

    joints: tuple[int, ...]  #: From 1, one after the other.
    low: float  #: low, high: between which places the links are taken to lie [m]; zero is between them.
    high: float
    origins: tuple[float, ...]  #: Where the origin of each joint is [m].
    side: float  #: 1 if that side is along the axis of the first, -1 if it is against it.


def links_beside(robot: Robot) -> tuple[Beside, ...]:
    """Return the joints whose links may lie beside the lines of the model.

    No model says where along parallel axes links lie. They are taken to lie between the origins of the joints, what
    follows them and the centres of gravity of the links between, where the robot has masses, each :data:`BEYOND` times
    as far from the first origin.
    """
    arm, found = at_the_origin(robot).rigid, []
    count = len(robot.joints)
    kinematics = arm.forward_kinematics(np.zeros((1, count)))
    moving = arm.moving[:count]
    axes = [kinematics.axis(i).reshape(3) for i in moving]
    points = [kinematics.origin(i).reshape(3) for i in moving] + [kinematics.position.reshape(3)]
    centres = _centres(arm)
    first = 0
    while first < count:
        last = first
        while last + 1 < count and _parallel(arm, axes, first, last + 1):
            last += 1
        if last > first:
            origins = [float(axes[first] @ (points[k] - points[first])) for k in range(first, last + 2)]
            known = [
                *origins,
                *(float(axes[first] @ (at - points[first])) for k in range(first, last) for at in centres[k]),
            ]
            low, high = BEYOND * min(known), BEYOND * max(known)
            if high - low >= _SMALL:
                side = 1.0 if high >= -low else -1.0
                low, high = sorted((side * low, side * high))
                numbers = tuple(range(first + 1, last + 2))
                found.append(Beside(numbers, low, high, tuple(side * at for at in origins[:-1]), side))
        first = last + 1
    return tuple(found)


def _parallel(arm: Robot, axes: list[Array], one: int, other: int) -> bool:
    turning = arm.joints[one].kind == arm.joints[other].kind == "revolute"
    return turning and bool(np.linalg.norm(np.cross(axes[one], axes[other])) < _PARALLEL)


def _centres(arm: Robot) -> list[list[Array]]:
    """Return the centres of gravity of the link behind each joint [m], at joint positions zero, each ``(3,)``."""
    ends = [0, *accumulate(len(link) for link in arm.moved_links)]
    rigid = arm.arm.forward_kinematics(np.zeros((len(arm.joints), 1)), arm.values)
    found: list[list[Array]] = [[] for _ in arm.joints]
    for link in arm.masses:
        if link.mass > 0.0 and link.joint < len(arm.joints):
            end = ends[link.joint]
            centre = rigid.origin(end).reshape(3) + rigid.matrix(end).reshape(3, 3) @ np.array(link.cog)
            found[link.joint - 1].append(centre)
    return found


def beside_notices(robot: Robot) -> list[Notice]:
    """Return what to know of an arm whose links may lie beside the lines of the model."""
    notices = []
    for group in links_beside(robot):
        numbers = f"{', '.join(str(j) for j in group.joints[:-1])} and {group.joints[-1]}"
        low, high = sorted(round(1e3 * group.side * at) for at in (group.low, group.high))
        notices.append(
            Notice(
                "links-beside",
                f"The axes of joints {numbers} are parallel, and no model says where along them the links are. The arm "
                f"keeps clear wherever they lie from {low} to {high} mm along the axis of joint {group.joints[0]} "
                "from where the model has it. If a drawing has a link farther out, state a `clearance` larger "
                "by that.",
                "note",
            )
        )
    return notices
