"""The identification of Nubiola's chapter 4 as it is printed: 24 parameters, the base held where three cups are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.solving.problem import Problem
from truearm.identification.solving.solver import solve
from truearm.measurement.dataset import Dataset
from truearm.measurement.hexapod.geometry import DEVICE
from truearm.measurement.hexapod.world_frame import WorldFrame, world_frame
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.studies.lrmate_hexapod.robot import TOUCHING

#: The parameters of Table 4.1 without d 3, which is redundant.
NAMES: Final = (
    *(f"{kind}_{i}" for i in range(2, 7) for kind in ("alpha", "a", "theta_offset", "d") if (kind, i) != ("d", 3)),
    *(f"compliance_{i}" for i in range(2, 7)),
)


@dataclass(frozen=True, eq=False)
class Cups:
    """The base fixture as robot and ballbar know it.

    Attributes
    ----------
    touches
        Joints at its cups [rad], ``(3, joints)``.
    sides
        Measured distances 12, 23, 31 [m], ``(3,)``.
    corrected
        Whether the distances count, or only the points (section 4.2).
    """

    touches: Array
    sides: Array
    corrected: bool = True

    def frame_by(self, robot: Robot) -> WorldFrame:
        """Return the fixture's frame in the world of a model."""
        return world_frame(robot.world_poses(self.touches, TOUCHING)[0], self.sides)

    def placed(self, robot: Robot) -> Robot:
        """Return the robot with the fixture's frame as its world, where its own model finds the cups."""
        found = self.frame_by(robot)
        return rebased(robot, found.frame if self.corrected else found.plain)


def rebased(robot: Robot, frame: Transform) -> Robot:
    """Return the robot with `frame`, which is given in its world, as its new world."""
    R = frame.rotation.T
    base = robot.base
    there = Transform.from_matrix(R @ base.rotation, R @ (np.array(base.translation) - np.array(frame.translation)))
    places = {f"base_{axis}": value for axis, value in zip("xyz", there.translation, strict=True)}
    turns = {f"base_r{axis}": 0.0 for axis in "xyz"}
    return replace(robot, base_quaternion=there.quaternion).with_values(places | turns)


def identified_as_printed(robot: Robot, by: Robot, data: Dataset, cups: Cups) -> Robot:
    """Return the robot with the 24 parameters of Table 4.1 by least squares (4.15 to 4.17).

    Base and cups of the tool are not identified. The base stands where the model `by` finds the cups of the fixture;
    afterwards it stands where the identified model finds them.

    Parameters
    ----------
    robot
        The nominal robot, where the parameters start.
    by
        The model that is current before.
    data
        Cups of the tool in the fixture's frame.
    cups
        Of the base fixture.
    """
    elastic = robot.with_effects(("compliance",))
    base = cups.placed(by)
    places = {f"base_{axis}": base.values[f"base_{axis}"] for axis in "xyz"}
    start = replace(elastic, base_quaternion=base.base_quaternion).with_values(places)
    for _ in range(2):  # the second time with the loads of the solution of the first
        free = FreeParameters(tuple(start.parameters[name] for name in NAMES))
        found = solve(Problem(start, data, free, {"position": DEVICE.sigma}, priors=False), "linear", None)
        start = start.with_values(dict(zip(NAMES, map(float, found.vector), strict=True)))
    return cups.placed(start)
