"""Off-line compensation through the model with inverted joint errors (KR5 paper, equation 11).

The robot with errors is ``A1 E1 A2 E2 ..``. At the nominal joint positions ``A1 inv(E1) A2 inv(E2) ..`` is as far from
the wanted pose as the real robot, on the other side: it is the fake target. The nominal robot's joint positions for the
fake target bring the real robot to the pose, up to terms of second order in the errors. (Solving the inverse
kinematics of the inverted model for the pose itself would double the error.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.conventions import JOINT
from truearm.modeling.inverse import inverse
from truearm.modeling.inverse.solutions import JointSolutions
from truearm.modeling.lines import at_zero
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY

#: The convention whose robots have joint errors.
CONVENTION: Final = "joint-errors"


@dataclass(frozen=True, eq=False)
class FakeTargets:
    """What to command so that the real robot reaches wanted poses."""

    position: Array  #: position, rotation: the fake targets in the base frame, ``(n, 3)`` [m] and ``(n, 3, 3)``.
    rotation: Array
    solutions: JointSolutions  #: The nominal robot's joint positions for them, with a status each.


def design(robot: Robot) -> Robot:
    """Return the robot without joint errors, in its own base frame.

    Raises:
        InputError: If it is not described by joint errors.
    """
    return replace(_checked(robot).with_frames(IDENTITY, {}), known={}, effect_names=())


def inverted(robot: Robot) -> Robot:
    """Return the robot ``A1 inv(E1) A2 inv(E2) ..``, as combinations of translations, in its own base frame.

    Calibrated joint zeros count as errors too.

    Raises:
        InputError: If the robot is not described by joint errors.
    """
    joints = []
    for number, (joint, link) in enumerate(zip(_checked(robot).joints, robot.link_elements, strict=True), 1):
        zero = robot.parameters[f"{JOINT}_{number}"]
        P, E = at_zero(robot, link[:6]), at_zero(robot, link[6:11])
        M = P @ _about_z(zero.nominal - zero.value) @ np.linalg.inv(E)
        row = {
            **dict(zip("xyz", M[:3, 3].tolist(), strict=True)),
            "rx": math.atan2(-M[1, 2], M[2, 2]),
            "ry": math.atan2(M[0, 2], math.hypot(M[0, 0], M[0, 1])),
            JOINT: math.atan2(-M[0, 1], M[0, 0]) + zero.nominal,
        }
        joints.append(replace(joint, row=row))
    made = replace(robot, convention_name="translations", joints=tuple(joints), known={}, effect_names=(), truths={})
    return made.with_frames(IDENTITY, {})


def fake_targets(robot: Robot, joints: Array) -> FakeTargets:
    """Return fake targets, and the joint positions to command, for nominal joint positions ``(n, joints)`` [rad].

    Args:
        robot: With identified joint errors.
        joints: Joint positions at which the nominal robot is at the wanted poses.
    """
    position, rotation = inverted(robot).world_poses(joints)
    return FakeTargets(position, rotation, inverse(design(robot), position, rotation, seed=joints))


def _checked(robot: Robot) -> Robot:
    if robot.convention_name != CONVENTION or any(joint.kind != "revolute" for joint in robot.joints):
        raise InputError(
            "the robot is not described by joint errors of turning joints",
            where=robot.name,
            came=robot.convention_name,
            allowed=CONVENTION,
            cure="'truearm axes' writes joint-errors.yaml; 'truearm convert' converts a robot without errors.",
        )
    return robot


def _about_z(angle: float) -> Array:
    made = np.eye(4)
    made[0, 0] = made[1, 1] = math.cos(angle)
    made[1, 0], made[0, 1] = math.sin(angle), -math.sin(angle)
    return made
