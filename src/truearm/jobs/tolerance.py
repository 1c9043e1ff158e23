"""What joint errors use of their tolerances, or what tolerances may do at the flange."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from truearm.compensation.inverse_errors import CONVENTION, design
from truearm.errors import refusals_of
from truearm.jobs.arguments import lengths_argument, robot_argument
from truearm.modeling.conversion import converted
from truearm.modeling.robot import Robot
from truearm.results.tolerances import AllowedErrors, UsedTolerances
from truearm.validation.tolerances import checked_depth, errors_of_tolerance, flange_error, joint_tolerances

#: Configurations at which the flange is looked at, drawn from the robot's limits.
_CONFIGURATIONS: Final = 2000


def tolerance(
    robot: Robot | str | Path,
    depth: float | Sequence[float],
    *,
    lean: float | Sequence[float] | None = None,
    position: float | Sequence[float] | None = None,
) -> UsedTolerances | AllowedErrors:
    """Say what joint errors use of their tolerances, or what tolerances may do at the flange.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes. Without `lean` and `position` it must have joint errors, as
        ``truearm.axes`` writes them.
    depth
        Of each joint's hole [m]: one number for all joints, or one each.
    lean
        Perpendicularity or parallelism that is allowed [m], one number or one a joint.
    position
        Radius about its place within which a joint may lie [m], half of the drawing's diameter: one number or one a
        joint.

    Returns
    -------
    found
        With `lean` or `position` the largest flange error that they allow, else the tolerances that the robot's own
        errors use.

    Raises
    ------
    InputError
        If the robot has other joints than revolute ones, or no joint errors, or a length is none.
    """
    robot = robot_argument(robot)
    count = len(robot.joints)
    depths = tuple(checked_depth(d) for d in lengths_argument(depth, "depth", count, one_for_all=True))
    if lean is None and position is None:
        with refusals_of("robot"):
            design(robot)  # refuses robots without joint errors
        return UsedTolerances(robot.name, depths, joint_tolerances(robot, depths), robot.simulated_from)
    leans = lengths_argument(0.0 if lean is None else lean, "lean", count, 0.0, one_for_all=True)
    positions = lengths_argument(0.0 if position is None else position, "position", count, 0.0, one_for_all=True)
    with refusals_of("robot"):
        errors = robot if robot.convention_name == CONVENTION else converted(robot, CONVENTION)
    q = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    angles = tuple(errors_of_tolerance(a, 0.0, d)[0] for a, d in zip(leans, depths, strict=True))
    found = flange_error(errors, angles, positions, q)
    return AllowedErrors(robot.name, len(q), angles, found, robot.simulated_from)
