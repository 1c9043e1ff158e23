"""The identification of Nubiola's chapter 4: 24 parameters, and a base that three cups give.

The document does not identify the base. It finds the fixture's frame from the joint readings at the cups "using the
relative calibrated model" (section 4.3). That can be read in two ways: with the model that there was before, and then
the frame is held while parameters are identified, or with the model that is being identified, and then the frame
follows the parameters within the least squares.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from papers.lrmate_hexapod.robot import TOUCHING
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import DEVICE
from truearm.engine.fit.problem import Evaluation, Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.hexapod.places import WorldFrame, world_frame

#: The parameters of Table 4.1 without d 3, which is redundant.
NAMES: Final = (
    *(f"{kind}_{i}" for i in range(2, 7) for kind in ("alpha", "a", "theta_offset", "d") if (kind, i) != ("d", 3)),
    *(f"compliance_{i}" for i in range(2, 7)),
)


@dataclass(frozen=True, eq=False)
class Cups:
    """The base fixture as robot and ballbar know it."""

    touches: Array  #: Joints at its cups [rad], ``(3, joints)``.
    sides: Array  #: Measured distances 12, 23, 31 [m], ``(3,)``.
    corrected: bool = True  #: Whether the distances count, or only the points (section 4.2).

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


def identified_holding(robot: Robot, by: Robot, data: Dataset, cups: Cups) -> Robot:
    """Return the robot with the 24 parameters of Table 4.1 by least squares (4.15 to 4.17), its base held.

    The base stands where the model `by` finds the cups of the fixture; afterwards it stands where the identified model
    finds them. Cups of the tool are not identified.

    Args:
        robot: The nominal robot, where the parameters start.
        by: The model that is current before.
        data: Cups of the tool in the fixture's frame.
        cups: Of the base fixture.
    """
    elastic = robot.with_effects(("compliance",))
    base = cups.placed(by)
    places = {f"base_{axis}": base.values[f"base_{axis}"] for axis in "xyz"}
    start = replace(elastic, base_quaternion=base.base_quaternion).with_values(places)
    for _ in range(2):  # the second time with the loads of the solution of the first
        start = _solved(start, Problem(start, data, _free(start), {"position": DEVICE.sigma}, priors=False))
    return cups.placed(start)


def identified_following(robot: Robot, data: Dataset, cups: Cups) -> Robot:
    """Return the same with a base that stands, at every step, where the model of that step finds the cups.

    Args:
        robot: The nominal robot, where the parameters start.
        data: Cups of the tool in the fixture's frame.
        cups: Of the base fixture.
    """
    start = robot.with_effects(("compliance",))
    for _ in range(2):
        start = _solved(start, Following(start, data, cups))
    return cups.placed(start)


def _free(robot: Robot) -> FreeParameters:
    return FreeParameters(tuple(robot.parameters[name] for name in NAMES))


def _solved(robot: Robot, problem: Problem | Following) -> Robot:
    vector = solve(problem, "linear", None).vector
    return robot.with_values(dict(zip(NAMES, map(float, vector), strict=True)))


@dataclass(frozen=True, eq=False)
class Following:
    """Positions in the fixture's frame, which follows the parameters: a problem for the solver."""

    robot: Robot  #: Where the parameters start; its own values load the joints.
    data: Dataset  #: Cups of the tool in the fixture's frame.
    cups: Cups  #: Of the base fixture.
    priors: bool = False  #: None: the document has none.

    @cached_property
    def free(self) -> FreeParameters:
        """What may change."""
        return _free(self.robot)

    @cached_property
    def components(self) -> NDArray[np.intp]:
        """Three equations a reading."""
        return np.full(len(self.data.position), 3)

    @cached_property
    def readings(self) -> Problem:
        """The readings, as if their frame were the robot's world; metres are not whitened."""
        return Problem(self.robot, self.data, self.free, {"position": 1.0}, priors=False)

    @cached_property
    def touched(self) -> Problem:
        """The cups of the base, as if they were at the origin; metres are not whitened."""
        count = len(self.cups.touches)
        data = Dataset(
            source="touches",
            labels=tuple(f"B{n + 1}" for n in range(count)),
            joints=self.cups.touches,
            joint_kinds=tuple(joint.kind for joint in self.robot.joints),
            targets=(TOUCHING,),
            configuration=np.arange(count),
            target=np.zeros(count, np.intp),
            position=np.zeros((count, 3)),
        )
        return Problem(self.robot, data, self.free, {"position": 1.0}, priors=False)

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return zeros: nothing is known before."""
        return np.zeros(len(vector)), np.zeros(len(vector))

    def at(self, vector: Array) -> Followed:
        """Compare the robot with the readings at a vector ``(parameters,)``."""
        readings, touched = self.readings.at(vector), self.touched.at(vector)
        measured = np.concatenate([self.data.position[block.readings] for block in self.readings.blocks])
        places = np.asarray(readings.residual.reshape(-1, 3) + measured)
        return Followed(self, vector, readings, touched, measured, places, touched.residual.reshape(3, 3))


@dataclass(frozen=True, eq=False)
class Followed:
    """Such a problem at one vector of its parameters."""

    problem: Following  #: What is evaluated.
    vector: Array  #: ``(parameters,)``.
    readings: Evaluation  #: readings, touched: of the tool's cups and of the base's, not whitened.
    touched: Evaluation
    measured: Array  #: The measured positions in the order of the residual [m], ``(n, 3)``.
    places: Array  #: Where the model has the cups of the tool in the robot's world [m], ``(n, 3)``.
    points: Array  #: Where it has the cups of the base [m], ``(3, 3)``.

    @cached_property
    def residual(self) -> Array:
        """Residual of the readings in standard deviations, ``(rows,)``."""
        return np.asarray((self._seen(self.points) - self.measured) / DEVICE.sigma).reshape(-1)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``; that of the frame by its points by differences."""
        moved = self.readings.jacobian.reshape(-1, 3, len(self.vector))
        J = np.einsum("ji,njk->nik", self._frame(self.points).rotation, moved)
        by_point = np.empty((*self.places.shape, 9))
        for k, unit in enumerate(np.eye(9).reshape(9, 3, 3)):
            there, back = (self._seen(self.points + sign * _STEP * unit) for sign in (1.0, -1.0))
            by_point[:, :, k] = (there - back) / (2.0 * _STEP)
        J += by_point @ self.touched.jacobian
        return np.asarray(J.reshape(-1, len(self.vector)) / DEVICE.sigma)

    def _frame(self, points: Array) -> Transform:
        found = world_frame(points, self.problem.cups.sides)
        return found.frame if self.problem.cups.corrected else found.plain

    def _seen(self, points: Array) -> Array:
        """Return the places in the frame that points of the base give [m], ``(n, 3)``."""
        frame = self._frame(points)
        return np.asarray((self.places - np.array(frame.translation)) @ frame.rotation)


#: By how much a point is moved for a derivative [m].
_STEP: Final = 1e-5
