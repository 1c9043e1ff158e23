"""A robot as a kinematics file of the ROS driver of Universal Robots."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.conversion import converted
from truearm.modeling.formats.remarks import masses_left_out
from truearm.modeling.formats.ur_kinematics.reading import JOINTS
from truearm.modeling.formats.urdf_tree import product, roll_pitch_yaw
from truearm.modeling.lines import joint_axes
from truearm.modeling.robot import Robot
from truearm.shown import counted

#: The links of the file, from the base on; each has the frame of the joint before it.
LINKS: Final = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
#: Angles between neighbouring axes [deg] of an arm of this kind, and by how much they may differ.
_BETWEEN: Final = (90.0, 0.0, 0.0, 90.0, 90.0)
_WITHIN: Final = 10.0
#: A flange less than this [m, rad] beside the last frame is there.
_SAME: Final = 1e-7
#: What the file is, as a sentence begins.
KINEMATICS_FILE: Final = "A kinematics file"


def kinematics_text(robot: Robot) -> tuple[str, list[str]]:
    """Return the geometry of a robot as it is now, joint zeros included, as a file of the ROS driver.

    Args:
        robot: With its base frame as the world.

    Returns:
        text, left_out: The file without comments, and in words what it cannot hold beside what no table of an arm can.

    Raises:
        InputError: If the robot is no arm of this kind.
    """
    _refuse_other_arm(robot)
    frames, behind = _frames(robot)
    lines = ["kinematics:"]
    for link, frame in zip(LINKS, frames, strict=True):
        numbers = [*frame[:3, 3], *roll_pitch_yaw(frame[:3, :3])]
        entries = zip(("x", "y", "z", "roll", "pitch", "yaw"), numbers, strict=True)
        lines += [f"  {link}:", *(f"    {name}: {_number(value)}" for name, value in entries)]
    said = [
        *masses_left_out(robot, KINEMATICS_FILE),
        *_flange_left_out(behind),
        f"{KINEMATICS_FILE} of the factory has the hash of what the controller has. The hash of this one is that of "
        "its own numbers: the driver says that they are not the controller's, which is true.",
    ]
    text = "\n".join(lines)
    return f"{text}\n  hash: truearm_{hashlib.sha256(text.encode()).hexdigest()[:16]}\n", said


def _refuse_other_arm(robot: Robot) -> None:
    axes = joint_axes(robot) if all(joint.kind == "revolute" for joint in robot.joints) else []
    between = [float(np.degrees(one.angle(other))) for one, other in pairwise(axes)]
    if len(axes) == JOINTS and all(abs(a - b) < _WITHIN for a, b in zip(between, _BETWEEN, strict=True)):
        return
    raise InputError(
        "this is no arm of the kind that the format describes",
        where=robot.name,
        came=counted(len(robot.joints), "joint")
        + (f", axes {', '.join(f'{angle:.0f}' for angle in between)} deg apart" if between else ""),
        allowed="six joints that turn, axes 90, 0, 0, 90, 90 deg apart, as arms of Universal Robots have them",
        cure="Take another format, such as urdf.",
    )


def _frames(robot: Robot) -> tuple[list[Array], Array]:
    """Return the frame of each joint in the one before, and of the controller's flange in the last, ``(4, 4)`` each.

    A joint's frame is slid along its axis by d, to where the next link begins.
    """
    table = converted(robot, "hayati")
    frames, behind = [], np.linalg.inv(robot.controller.base.matrix) @ table.base.matrix
    for link in table.link_elements:  # Rz(theta) Tz(d), and then what leads to the next axis
        turn, slide, *rest = (replace(element, variable=None) for element in link)
        frames.append(behind @ product([turn, slide], table.values))
        behind = product(rest, table.values)
    return frames, behind @ table.flange.matrix @ robot.controller.flange.matrix


def _flange_left_out(behind: Array) -> list[str]:
    gap = float(np.linalg.norm(behind[:3, 3]))
    turned = float(np.arccos(np.clip((np.trace(behind[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    if gap < _SAME and turned < _SAME:
        return []
    return [
        f"{KINEMATICS_FILE} cannot hold a flange beside the last axis; left out: {gap * 1e3:.4g} mm and "
        f"{np.degrees(turned):.4g} deg, which belong to the tool."
    ]


def _number(value: float) -> str:
    """Return a number as YAML has it; the roundings of right angles are written as the zeros they stand for."""
    return repr(0.0 if abs(value) < 1e-15 else float(value))
