"""Into URDF joints: from one joint variable to the next as an origin, each axis in its own frame."""

from __future__ import annotations

import numpy as np

from truearm.modeling.conversion.links import Links
from truearm.modeling.formats.urdf_tree import roll_pitch_yaw
from truearm.modeling.lines import at_zero, base_and_flange
from truearm.modeling.robot import Robot


def origins(robot: Robot) -> Links:
    """Return the origins of a robot's joints, whose own zeros belong to them."""
    here = base_and_flange(robot)[0]
    passed, rows = list(robot.base_elements), []
    for link in robot.link_elements:
        moving = next(i for i, element in enumerate(link) if element.variable is not None)
        there = at_zero(robot, [*passed, *link[: moving + 1]])
        place = np.linalg.inv(here) @ there
        row = dict(zip("xyz", map(float, place[:3, 3]), strict=True))
        row |= dict(zip(("roll", "pitch", "yaw"), roll_pitch_yaw(place[:3, :3]), strict=True))
        rows.append(row | dict(zip(("axis_x", "axis_y", "axis_z"), link[moving].axis or (0.0, 0.0, 1.0), strict=True)))
        here = there
        passed += link
    return Links(tuple(rows))
