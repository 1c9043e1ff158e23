"""A new URDF of a robot, whatever its convention."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.formats.collapsed import collapsed
from truearm.modeling.formats.remarks import left_out
from truearm.modeling.formats.urdf_tree import Triple, roll_pitch_yaw
from truearm.modeling.parts import Joint
from truearm.modeling.robot import Robot
from truearm.simulated import said_of


def urdf_text(robot: Robot) -> tuple[str, list[str]]:
    """Return a new URDF with the kinematics of `robot` as it is now, whatever its convention.

    Links are ``base_link``, ``link_1`` ... and ``tool0``. The constant transforms between two joint variables
    are multiplied into one origin. The base link is the base frame: where it stands in the world is left out.

    Returns:
        text, left_out: The file, and in words what a URDF cannot hold or the robot does not say.
    """
    names = [*(joint.name for joint in robot.joints), "tool0_joint"]
    for name in names:
        if names.count(name) > 1:
            raise InputError("a URDF cannot have two joints of one name", where=robot.name, came=name)
    origins, behind = collapsed(robot)
    said = left_out(robot, "A URDF")
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        *(f"<!-- {line} -->" for line in said_of(robot.simulated_from)),
        f"<robot name={quoteattr(robot.name)}>",
        '  <link name="base_link"/>',
    ]
    for number, (joint, place) in enumerate(zip(robot.joints, origins[:-1], strict=True), 1):
        parent = f"link_{number - 1}" if number > 1 else "base_link"
        lines += _link_lines(robot, number, behind[number - 1])
        moving = next(e for e in robot.link_elements[number - 1] if e.variable is not None)
        lines += _joint_lines(joint, parent, f"link_{number}", place, _limit(robot.name, joint), moving.axis)
    lines += ['  <link name="tool0"/>']
    lines += _joint_lines(None, f"link_{len(robot.joints)}", "tool0", origins[-1], [])
    said += _unknown_limits(robot.joints)
    if robot.masses:
        said.append("Inertia tensors are not written and stand as 0.")
    return "\n".join([*lines, "</robot>", ""]), said


def _joint_lines(
    joint: Joint | None, parent: str, child: str, origin: Array, limit: list[str], axis: Triple | None = None
) -> list[str]:
    """Return the lines of one joint, its axis z if None; None is the fixed one at the end."""
    if joint is None:
        head = '  <joint name="tool0_joint" type="fixed">'
    else:
        type_ = joint.kind if joint.limits else "continuous"
        limit = [f'    <axis xyz="{_written(axis or (0.0, 0.0, 1.0))}"/>', *limit]
        head = f'  <joint name={quoteattr(joint.name)} type="{type_}">'
    place = f'xyz="{_written(origin[:3, 3])}" rpy="{_written(roll_pitch_yaw(origin[:3, :3]))}"'
    ends = [f'    <parent link="{parent}"/>', f'    <child link="{child}"/>']
    return [head, f"    <origin {place}/>", *ends, *limit, "  </joint>"]


def _limit(where: str, joint: Joint) -> list[str]:
    speed = "0" if joint.max_speed is None else repr(joint.max_speed)
    if joint.limits is None:
        if joint.kind == "prismatic":
            raise InputError(
                "a URDF must have the limits of a prismatic joint",
                where=f"{where}, joint {joint.name}",
                cure="Give the joint its limits in the robot file.",
            )
        return [] if joint.max_speed is None else [f'    <limit effort="0" velocity="{speed}"/>']
    low, high = joint.limits
    return [f'    <limit lower="{low!r}" upper="{high!r}" effort="0" velocity="{speed}"/>']


def _unknown_limits(joints: Iterable[Joint]) -> list[str]:
    """Say which numbers of a ``<limit>`` stand as 0."""
    limited = [joint for joint in joints if joint.limits or joint.max_speed is not None]
    if not limited:
        return []
    unknown = [joint.name for joint in limited if joint.max_speed is None]
    if not unknown:
        return ["Effort limits are not known and stand as 0."]
    if len(unknown) == len(limited):
        return ["Effort and velocity limits are not known and stand as 0."]
    return [f"Effort limits, and velocity limits of {', '.join(unknown)}, are not known and stand as 0."]


def _link_lines(robot: Robot, number: int, behind: Array) -> list[str]:
    masses = [m for m in robot.masses if m.joint == number and m.mass > 0]
    if not masses:
        return [f'  <link name="link_{number}"/>']
    weights = [m.mass for m in masses]
    cog = behind[:3, :3] @ np.average([m.cog for m in masses], axis=0, weights=weights) + behind[:3, 3]
    return [
        f'  <link name="link_{number}">',
        "    <inertial>",
        f'      <origin xyz="{_written(cog)}"/>',
        f'      <mass value="{sum(weights)!r}"/>',
        '      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        "    </inertial>",
        "  </link>",
    ]


def _written(values: Iterable[float]) -> str:
    """Return numbers as text; the roundings of right angles are written as the zeros they stand for."""
    return " ".join(repr(0.0 if abs(v) < 1e-15 else float(v)) for v in values)
