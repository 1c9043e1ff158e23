"""What stands between an instrument and fixed points beside a robot: the arm itself, or a box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.constraints.segments import box_distance, segment_distance
from truearm.planning.driving.arm_capsules import ArmCapsules
from truearm.planning.driving.cell import KeepOut

#: Half of the width of a beam, or of what a camera must see of a target [m].
BEAM: Final = 5e-3


def hidden(
    robot: Robot, joints: Array, eye: Array, points: Mapping[str, Array], boxes: Sequence[KeepOut] = ()
) -> list[dict[str, str]]:
    """Return which points cannot be seen at each configuration, and what hides them, in words.

    The links are as thick as a plan keeps them clear, see :class:`ArmCapsules`, each where the model has it: links
    beside parallel axes hide what their model hides.

    Args:
        robot: Where it stands.
        joints: As the model counts them [rad or m], ``(n, joints)``.
        eye: Where the instrument is, in the world [m], ``(3,)``.
        points: That are looked at, in the world [m], ``(3,)`` each.
        boxes: In the base frame.
    """
    base, arm = robot.base, ArmCapsules(robot)
    at = arm.points(joints)
    found: list[dict[str, str]] = [{} for _ in joints]

    def in_base(point: Array) -> Array:
        return np.asarray((point - np.array(base.translation)) @ base.rotation)[:, None]

    start = in_base(eye)
    for name, point in points.items():
        end = in_base(point)
        behind = [box.name for box in boxes if box_distance(start, end, box.low, box.high).item() < BEAM]
        near = np.zeros(len(joints), dtype=bool)
        for link in (*arm.links, *arm.tools):
            near |= segment_distance(at[link.start], at[link.end], start, end) < link.radius + BEAM
        for k, one in enumerate(found):
            if behind or near[k]:
                one[name] = f"the box {behind[0]!r}" if behind else "the arm"
    return found
