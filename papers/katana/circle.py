"""The circle and the line of Patel's section 5.5.1, and the Katana's motion along them."""

from __future__ import annotations

from typing import Final

import numpy as np

from papers.katana.robot import TIP
from truearm.engine.base.errors import InputError
from truearm.engine.motion.joint_motion import JointMotion, joint_motion
from truearm.engine.motion.paths import Circle, Line, Trajectory, timed
from truearm.engine.robot.robot import Robot

#: The pencil's tip is this far beyond the attachment (Table 5.1) [m].
PENCIL: Final = 0.130
#: Points of section 5.5.1 in the base frame, from the one on the positive x axis upwards [m].
POINTS: Final = np.array([[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893]]) * 1e-3
#: The line is the diameter between the circle's highest and lowest point [m].
_LINE: Final = np.array([[0, -370.7107, 210], [0, -229.2893, 68.5786]]) * 1e-3
#: Speed, and acceleration on the ramps, of the time law [m/s], [m/s^2]: ours, the document prints none.
SPEED: Final = 0.1
RAMP: Final = 0.4
#: The arm keeps this far from singular postures (singular value of its Jacobian, reach lengths).
_REGULAR: Final = 0.1


def paths(step: float) -> tuple[Trajectory, Trajectory]:
    """Return the circle of section 5.5.1 and its diameter, with a time between samples [s]."""
    circle, line = (timed(path, SPEED, RAMP, step) for path in (Circle.through(*POINTS), Line(*_LINE)))
    return circle, line


def motions(
    robot: Robot, circle: Trajectory, line: Trajectory, rng: np.random.Generator
) -> tuple[JointMotion, JointMotion]:
    """Return motions along both paths from a posture drawn at random, far from singular ones."""
    top = int(np.argmin(np.linalg.norm(circle.position - line.position[0], axis=1)))
    while True:
        try:
            motion = joint_motion(robot, circle, target=TIP, seed=robot.random_configurations(1, rng)[0])
            if motion.singular_value.min() < _REGULAR:
                continue
            return motion, joint_motion(robot, line, target=TIP, seed=motion.joints[top])
        except InputError:  # beyond a limit, or no way round: another posture
            continue
