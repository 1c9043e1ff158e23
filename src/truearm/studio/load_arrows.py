"""What the load does to the joints of an arm, as arrows along their axes, and the points that an arm reaches."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.loads import has_weight, joint_loads
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.studio.arrows import Arrows, coloured

#: Length of the longest arrow, by the length of the arm.
_LONGEST: Final = 0.35
#: Configurations whose tips show what an arm reaches.
_REACHED: Final = 4000


def load_arrows(robot: Robot, at: Postures, length: float) -> tuple[Arrows, list[str]]:
    """Return the moments of the load about the joint axes at one posture, of prismatic joints forces along them.

    A positive one turns the joint forward, as of :func:`truearm.engine.robot.loads.joint_loads`: an arrow along the
    axis, right-handed; a negative one against it.

    Args:
        robot, at: With what it carries, and where it stands, bent as it is.
        length: Of the arm [m]; the longest arrow is drawn by it.

    Returns:
        arrows, told: In the world, and the figures joint by joint.

    Raises:
        InputError: If nothing loads the joints.
    """
    if not has_weight(robot):
        raise InputError(
            "the robot has no masses and carries nothing, so its joints carry no loads",
            where=robot.name,
            cure="Give a payload, or the masses of its links in the robot file.",
        )
    wrench = None if at.wrench is None else at.wrench.T
    loads = joint_loads(robot, robot.variables(at, robot.values), wrench=wrench)
    kinematics = robot.forward_kinematics(at)
    turning = np.array([joint.kind == "revolute" for joint in robot.joints])
    sizes = np.round(np.where(turning, loads[:, 5, 0], loads[:, 2, 0]), 6) + 0.0
    places = robot.moving[: len(sizes)]
    axes = np.array([kinematics.axis(place)[:, 0] for place in places])
    start = np.array([kinematics.origin(place)[:, 0] for place in places])
    share = np.zeros(len(sizes))
    largest = [float(np.abs(sizes[kind]).max(initial=0.0)) for kind in (turning, ~turning)]
    for kind, most in zip((turning, ~turning), largest, strict=True):
        if most > 0.0:
            share[kind] = sizes[kind] / most
    told = [
        f"{joint.name}: {size:.3g} {'N m' if turns else 'N'}"
        for joint, size, turns in zip(robot.joints, sizes, turning, strict=True)
    ]
    words = " and ".join(f"{size:.3g} {unit}" for size, unit in zip(largest, ("N m", "N"), strict=True) if size > 0.0)
    drawn = np.abs(share) > 1e-3
    segments = np.stack([start, start + _LONGEST * length * share[:, None] * axes], axis=1)[drawn]
    colours = coloured(np.abs(share[drawn]), 0.0, 1.0)
    return Arrows(segments, colours, f"loads of the joints, largest {words or 0}"), told


def reached_points(robot: Robot, tip: str | None) -> Array:
    """Return where the tip of an arm is at configurations drawn within its limits, in the world [m], ``(n, 3)``."""
    joints = robot.random_configurations(_REACHED, np.random.default_rng(0))
    return robot.forward(joints, frame="world", target=tip)[0]
