"""Circles against a robot: the axis of a joint that turned alone, as measured and as the robot has it.

A circle says of its joint's axis in the posture of the other joints in which direction it goes and where it crosses the
circle's plane: four numbers. Where the reflector was along the axis, how far from it and at which angle says nothing
about the axis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.circles import Circle, fit_circle
from truearm.measurement.dataset import Dataset
from truearm.measurement.turns import Run, Turn, find_runs, turn_of
from truearm.modeling.chain import Array, Chain, axis_of
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot

#: No instrument is better than this [m]; noise-free circles would have no finite weight.
_SMALLEST_DEVIATION: Final = 1e-9


@dataclass(frozen=True, eq=False)
class AxisCircle:
    """The circle of one target in one run."""

    joint: int  #: Number of the joint that turned, from 1.
    target: str  #: Name of the target.
    posture: Array  #: Positions of all joints [rad], ``(joints,)``; that of the one that turned does not count.
    turn: Turn  #: Circle and errors.

    @property
    def circle(self) -> Circle:
        """Its circle."""
        return self.turn.circle


@dataclass(frozen=True, eq=False)
class AxisCircles:
    """All circles of a campaign."""

    circles: tuple[AxisCircle, ...]  #: One a run and target.
    left_out: int  #: Configurations that belong to no run.
    #: Why a target made no circle in a run where another one did: it is too near to the axis, or was seen too little.
    refused: tuple[InputError, ...]
    declared: bool  #: Whether the data declare deviations.
    #: How much larger the distances from the circles are than the declared deviations allow; 1 if they agree or nothing
    #: was declared. The circles' deviations contain it.
    excess: float


def axis_circles(data: Dataset) -> AxisCircles:
    """Fit a circle to every target in every run in which one joint moved alone.

    Deviations are declared by the data, or found from what all circles leave together.

    Raises:
        InputError: If there is no run, a joint slides, or no target makes a circle in a run.
    """
    if "prismatic" in data.joint_kinds:
        raise InputError(
            "a joint that slides makes no circle",
            where=f"{data.source}, joint {data.joint_kinds.index('prismatic') + 1}",
            cure="Calibrate this robot from configurations that move every joint, with 'truearm calibrate'.",
        )
    runs = find_runs(data)
    if not runs:
        raise InputError(
            "there is no part of the data in which one joint moves alone",
            where=data.source,
            allowed="four configurations or more in a row of each joint while the others stand still",
            cure="Measure axis by axis, or use 'truearm calibrate' on configurations that move every joint.",
        )
    found: list[AxisCircle] = []
    refused: list[InputError] = []
    for run in runs:
        refusals, before = [], len(found)
        for index in range(len(data.targets)):
            try:
                found += _circle(data, run, index)
            except InputError as refusal:
                refusals.append(refusal)
        if refusals and len(found) == before:
            raise refusals[0]
        refused += refusals
    freedom = sum(c.circle.freedom for c in found)
    together = math.sqrt(sum(c.circle.residual**2 * c.circle.freedom for c in found) / freedom)
    used = set(np.concatenate([run.configurations for run in runs]).tolist())
    excess = 1.0
    if data.sigma is not None:
        ratio = sum((c.circle.residual / c.circle.sigma) ** 2 * c.circle.freedom for c in found) / freedom
        excess = math.sqrt(ratio) if ratio > _by_chance(freedom) else 1.0
    weighted = tuple(
        replace(
            c,
            turn=replace(
                c.turn,
                circle=c.circle.with_sigma(
                    max(together if data.sigma is None else excess * c.circle.sigma, _SMALLEST_DEVIATION)
                ),
            ),
        )
        for c in found
    )
    return AxisCircles(weighted, data.configurations - len(used), tuple(refused), data.sigma is not None, excess)


def _circle(data: Dataset, run: Run, target: int) -> list[AxisCircle]:
    """Return the circle of a target in a run, none if it was not seen there."""
    order = {int(configuration): i for i, configuration in enumerate(run.configurations)}
    seen = (data.target == target) & data.has_position & np.isin(data.configuration, run.configurations)
    readings = sorted(np.flatnonzero(seen).tolist(), key=lambda r: order[int(data.configuration[r])])
    if not readings:
        return []
    first, last = (data.labels[int(i)] for i in run.configurations[[0, -1]])
    name = data.targets[target]
    where = f"{data.source}, configurations {first} to {last}, joint {run.joint}, target {name}"
    sigma = None if data.sigma is None else math.sqrt(float(np.mean(data.sigma[readings] ** 2)))
    circle = fit_circle(data.position[readings], sigma, where)
    turn = turn_of(circle, data.joints[data.configuration[readings], run.joint - 1])
    return [AxisCircle(run.joint, name, data.joints[run.configurations].mean(axis=0), turn)]


def _by_chance(freedom: int) -> float:
    """Return what chi squared over its degrees of freedom exceeds once in 1000 (Wilson and Hilferty 1931)."""
    k = 2.0 / (9.0 * freedom)
    return (1.0 - k + 3.09 * math.sqrt(k)) ** 3


@dataclass(frozen=True, eq=False)
class AxisProblem:
    """A robot's axes against measured circles."""

    robot: Robot  #: Gives the value of every parameter that is not free.
    circles: Sequence[AxisCircle]  #: What was measured.
    free: FreeParameters  #: What the solver changes.
    priors: bool = False

    @property
    def components(self) -> NDArray[np.intp]:
        """Number of rows of each reading: two for the place of an axis and two for its direction."""
        return np.full(2 * len(self.circles), 2)

    def at(self, vector: Array) -> AxisEvaluation:
        """Compare axes and circles at a vector ``(parameters,)``."""
        return AxisEvaluation(self, vector)

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` and its Jacobian ``(rows, parameters)``."""
        here = self.at(vector)
        return here.residual, here.jacobian

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return nothing: circles alone decide."""
        return np.zeros(len(vector)), np.zeros(len(vector))


@dataclass(frozen=True, eq=False)
class AxisEvaluation:
    """Axes against circles at one vector of the free parameters.

    A circle has four rows: where the axis crosses its plane, along x and y, and how it leans towards x and y, each
    whitened.
    """

    problem: AxisProblem
    vector: Array

    @property
    def residual(self) -> Array:
        """Whitened residual ``(rows,)``."""
        return self._both[0]

    @property
    def jacobian(self) -> Array:
        """Its derivative ``(rows, parameters)``."""
        return self._both[1]

    @cached_property
    def _both(self) -> tuple[Array, Array]:
        problem = self.problem
        values = {**problem.robot.values, **problem.free.values(self.vector)}
        made = [_rows(problem.robot, measured, values, problem.free.names) for measured in problem.circles]
        return np.concatenate([r for r, _ in made]), np.concatenate([J for _, J in made])


def _rows(
    robot: Robot, measured: AxisCircle, values: dict[str, float | Array], names: Sequence[str]
) -> tuple[Array, Array]:
    circle = measured.circle
    place = robot.moving[measured.joint - 1]
    variables = robot.variables(measured.posture[None], values)
    kinematics = Chain(robot.trunk.elements[:place]).forward_kinematics(variables, values)
    along = kinematics.matrix()[0] @ axis_of(robot.trunk.elements[place])
    linear, angular = (part[:, :, 0] for part in kinematics.jacobians([kinematics.places.get(n) for n in names]))
    turned = np.cross(angular, along)
    facing = float(along @ circle.normal)
    if facing < 0.5:
        raise InputError(
            f"joint {measured.joint} does not turn as the robot file says",
            where=f"{robot.name}, target {measured.target}",
            came=f"an axis {math.degrees(math.acos(max(facing, -1.0))):.3g} deg away from the robot's",
            cure="Check joint order and signs with 'truearm check ROBOT DATA.csv'.",
        )
    origin = kinematics.position[:, 0]
    way = float((circle.centre - origin) @ circle.normal) / facing
    crossing = origin + way * along
    moved = linear + way * turned
    moved = moved - (moved @ circle.normal / facing)[:, None] * along
    leaning = turned / facing - (turned @ circle.normal / facing**2)[:, None] * along
    axes = np.stack([circle.x, circle.y])
    by_offset = np.linalg.inv(np.linalg.cholesky(circle.shares[:2, :2])) / circle.sigma
    by_tilt = np.diag(1.0 / np.sqrt(circle.tilts)) / circle.sigma
    residual = np.concatenate([by_offset @ axes @ (crossing - circle.centre), by_tilt @ axes @ along / facing])
    return residual, np.concatenate([by_offset @ axes @ moved.T, by_tilt @ axes @ leaning.T])
