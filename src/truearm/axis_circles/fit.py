"""Axis-by-axis calibration: circles, axes, the frames they fix, tables of parameters, joint errors.

Sources: Nubiola, sections 1.3.2 and 2.3 (base frame from axes 1 and 2, tool frame from the last two; DH parameters by
Sklar's way and the S-model by Stone's, both from lines in space); KR5 paper, sections 2.2 and 3.2 (joint errors).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.units import Marked, parts_of
from truearm.engine.data.circles import FEWEST, Circle, fit_circle
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.problem import Redundancy, find_redundancies
from truearm.engine.fit.solver import solve
from truearm.engine.robot.chain import Array, Chain, axis_of
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.lines import base_and_flange, frame_between, joint_axes
from truearm.engine.robot.parameters import FreeParameters, Group
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_vector

# A joint turned alone: the runs of a campaign in which it is, and how far what it does is from what it reads.
#
# Source: Nubiola, section 2.4.1. A point on the tool goes round the joint's axis. The circle through its places is
# fitted by :mod:`truearm.engine.data.circles`; the angular error is the angle about that axis beyond the joint
# position, the tangential error the same at the radius, and backlash is by how much the joint lags when it comes back.

#: Joint positions that differ by less are the same: encoders flicker [rad].
SAME_POSITION: Final = math.radians(0.01)


@dataclass(frozen=True, eq=False)
class Run:
    """Configurations in a row between which one joint alone has moved."""

    joint: int  #: Its number, from 1.
    configurations: IntArray  #: Indices into the dataset, in the order of measurement, ``(n,)``.


def find_runs(data: Dataset) -> tuple[Run, ...]:
    """Return the runs of a dataset, in the order of its configurations.

    A run has four different joint positions or more. A configuration may end one run and begin the next.
    """
    runs: list[Run] = []
    start, joint = 0, -1
    for row in range(1, data.configurations + 1):
        moved = [] if row == data.configurations else _moved(data.joints[start], data.joints[row])
        if row < data.configurations and (not moved or moved == [joint] or (joint < 0 and len(moved) == 1)):
            joint = moved[0] if moved else joint
            continue
        if joint >= 0:
            runs.append(Run(joint + 1, np.arange(start, row)))
        if row < data.configurations:
            step = _moved(data.joints[row - 1], data.joints[row])
            start, joint = (row - 1, step[0]) if len(step) == 1 else (row, -1)
    return tuple(run for run in runs if _different(data.joints[run.configurations, run.joint - 1]) >= FEWEST)


def _moved(before: Array, after: Array) -> list[int]:
    return [int(i) for i in np.flatnonzero(np.abs(after - before) > SAME_POSITION)]


def _different(joints: Array) -> int:
    return 1 + int((np.diff(np.sort(joints)) > SAME_POSITION).sum())


@dataclass(frozen=True, eq=False)
class Turn:
    """A joint turned alone, and what a point on the tool did."""

    #: Through the places of the point; its normal points along the joint's axis, so that angles grow with joint
    #: positions.
    circle: Circle
    joint_position: Array  #: Joint positions [rad], ``(n,)``.
    error: Array  #: Angle about the axis beyond the joint position, zero on average [rad], ``(n,)``.
    direction: Array  #: Sign of the last move, 0 where it is not known, ``(n,)``.

    @property
    def angular(self) -> float:
        """Range of the angular error [rad]."""
        return float(np.ptp(self.error))

    @property
    def tangential(self) -> float:
        """Range of the tangential error [m]."""
        return self.angular * self.circle.radius

    @property
    def backlash(self) -> float | None:
        """How far the joint lags, backward minus forward at the same joint position [rad]; None if nowhere known."""
        places = np.round(self.joint_position / SAME_POSITION).astype(int)
        lags = []
        for place in np.unique(places):
            at_place = places == place
            forward, backward = (self.error[at_place & (self.direction == sign)] for sign in (1.0, -1.0))
            if len(forward) and len(backward):
                lags.append(float(backward.mean() - forward.mean()))
        return float(np.mean(lags)) if lags else None


def turn_of(circle: Circle, positions: Array, direction: Array | None = None) -> Turn:
    """Compare the angles about a fitted circle with joint positions ``(n,)`` [rad].

    Args:
        circle: Fitted to the point's places; it is turned round where angles fall as joint positions grow.
        direction: Sign of the last move, ``(n,)``; from the order of the joint positions if None, unknown until the
            first move.
    """
    agreement = [abs(np.exp(1j * (sense * circle.angle - positions)).mean()) for sense in (1, -1)]
    circle = circle if agreement[0] >= agreement[1] else circle.reversed()
    beyond = np.exp(1j * (circle.angle - positions))
    error = np.angle(beyond / beyond.mean())
    return Turn(circle, positions, error - error.mean(), _directions(positions) if direction is None else direction)


def _directions(positions: Array) -> Array:
    signs = np.zeros(len(positions))
    for row in range(1, len(positions)):
        step = positions[row] - positions[row - 1]
        signs[row] = signs[row - 1] if abs(step) <= SAME_POSITION else math.copysign(1.0, step)
    return signs


# Circles against a robot: the axis of a joint that turned alone, as measured and as the robot has it.
#
# A circle says of its joint's axis in the posture of the other joints in which direction it goes and where it crosses
# the circle's plane: four numbers. Where the reflector was along the axis, how far from it and at which angle says
# nothing about the axis.

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
    circles: list[AxisCircle] = []
    refused: list[InputError] = []
    for run in runs:
        refusals, before = [], len(circles)
        for index in range(len(data.targets)):
            try:
                circles += _circle(data, run, index)
            except InputError as refusal:
                refusals.append(refusal)
        if refusals and len(circles) == before:
            raise refusals[0]
        refused += refusals
    freedom = sum(c.circle.freedom for c in circles)
    together = math.sqrt(sum(c.circle.residual**2 * c.circle.freedom for c in circles) / freedom)
    used = set(np.concatenate([run.configurations for run in runs]).tolist())
    excess = 1.0
    if data.sigma is not None:
        ratio = sum((c.circle.residual / c.circle.sigma) ** 2 * c.circle.freedom for c in circles) / freedom
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
        for c in circles
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
    place = f"{data.source}, configurations {first} to {last}, joint {run.joint}, target {name}"
    sigma = None if data.sigma is None else math.sqrt(float(np.mean(data.sigma[readings] ** 2)))
    circle = fit_circle(data.position[readings], sigma, place)
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
        evaluated = self.at(vector)
        return evaluated.residual, evaluated.jacobian

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
        parts = [_rows(problem.robot, measured, values, problem.free.names) for measured in problem.circles]
        return np.concatenate([r for r, _ in parts]), np.concatenate([J for _, J in parts])


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


# A robot's parameters from circles, and what circles cannot tell of it.
#
# No priors are used: parameters that the circles cannot tell apart are held at their nominal values and named with the
# combination, base first, so that the base lies where axes 1 and 2 are (Nubiola, section 2.3). The value of every other
# parameter is then a property of the axes, whatever the held ones truly are.

#: Half the width of the interval that holds a normal value in 95 of 100 cases, in deviations.
NORMAL_95: Final = 1.959964
#: A direction that moves the flange by less than this share of what its parameter alone does moves nothing.
_NO_MOTION: Final = 1e-6
_STEP: Final = 1e-2  # of a deviation, for derivatives of what is derived from axes


@dataclass(frozen=True, eq=False)
class AxisFit:
    """A robot identified from circles."""

    robot: Robot  #: With the values found and their deviations.
    free: FreeParameters  #: The parameters that were identified, in the order of `covariance`.
    covariance: Array  #: Of them [SI], ``(parameters, parameters)``.
    #: Parameters held because circles cannot tell them apart, with the combination.
    redundancies: tuple[Redundancy, ...]
    #: Those of `redundancies` whose combination moves the flange somewhere: not a matter of convention, but a loss.
    moving_flange: tuple[str, ...]
    #: Root mean square of the whitened differences between axes and circles over their degrees of freedom; None where
    #: there are no more numbers than parameters.
    residual: float | None

    def derived(self, function: Callable[[Robot], Array]) -> tuple[Array, Array]:
        """Return numbers ``(k,)`` that follow from the robot, and their standard deviations ``(k,)``.

        The covariance is carried through central differences along its own directions.
        """
        value = function(self.robot)
        spread = np.linalg.cholesky(self.covariance + 1e-30 * np.diag(np.diag(self.covariance)))
        columns = []
        for direction in spread.T:
            ends = [function(self.robot.with_values(self._values(sign * _STEP * direction))) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2 * _STEP))
        return value, np.linalg.norm(np.stack(columns), axis=0)

    def combination(self, name: str) -> dict[str, float]:
        """Return what the value of an identified parameter is: a sum of true values with these factors [SI]."""
        factors = {name: 1.0}
        return factors | {r.dropped: -r.members[name] for r in self.redundancies if name in r.members}

    def _values(self, step: Array) -> dict[str, float]:
        return {p.name: p.value + float(s) for p, s in zip(self.free.parameters, step, strict=True)}


def fit_axes(
    robot: Robot,
    circles: Sequence[AxisCircle],
    groups: Sequence[Group] = ("base", "joint zero", "geometry"),
    known: Sequence[Redundancy] | None = None,
) -> AxisFit:
    """Identify a robot's parameters from circles.

    Args:
        robot: Where it stands, and with its axes near to the measured ones; what is held stays at its values.
        circles: One or more of every joint.
        groups: Which parameters are free; without ``base`` the robot stands where it is said to.
        known: What an earlier fit of the same runs found redundant, to spare the search in repetitions.

    Raises:
        InputError: If a joint has no circle, or one turns the other way.
    """
    missing = [i for i in range(1, len(robot.joints) + 1) if i not in {c.joint for c in circles}]
    if missing:
        raise InputError(
            "a joint was not turned alone, so that its axis is not known",
            where=robot.name,
            came=f"no run of joint {', '.join(map(str, missing))}",
            allowed="a run of every joint",
            cure="Measure it: four configurations or more while the others stand still.",
        )
    chosen = (p.restarted(p.value) for p in robot.parameters.values() if p.group in groups)
    # Of what cannot be told apart the last is held. That shall be the slides along joint axes.
    free = FreeParameters(tuple(sorted(chosen, key=lambda p: p.name.startswith("ez_"))))
    fixed = [r.dropped for r in known or ()]
    redundancies = tuple(known or ())
    start = robot.with_parameters(free.parameters)
    problem = AxisProblem(start, circles, free)
    for _ in range(6):
        if known is None:
            redundancies = find_redundancies(problem, problem.free.start, fixed)
        settled = [r.dropped for r in redundancies] == fixed
        fixed = [r.dropped for r in redundancies]
        if not problem.free.without(fixed).names:
            raise InputError(
                "the measured axes determine nothing of the robot",
                where=robot.name,
                cure="Check units, joint order and signs with 'truearm check ROBOT DATA.csv'.",
            )
        solution = solve(replace(problem, free=problem.free.without(fixed)))
        values = dict(zip(problem.free.without(fixed).names, solution.vector.tolist(), strict=True))
        parameters = tuple(replace(p, value=values.get(p.name, p.nominal)) for p in free.parameters)
        problem = replace(problem, free=FreeParameters(parameters))
        if settled:
            break
    if not solution.converged:
        raise InputError(
            "the robot's axes cannot be brought onto the measured ones",
            where=robot.name,
            cure="Check joint order and signs with 'truearm check ROBOT DATA.csv'.",
        )
    free_parameters = problem.free.without(fixed)
    R = np.linalg.qr(solution.jacobian * free_parameters.prior, mode="r")
    inverse = np.linalg.inv(R)
    covariance = (inverse @ inverse.T) * np.outer(free_parameters.prior, free_parameters.prior)
    identified = tuple(
        replace(p, deviation=math.sqrt(v)) for p, v in zip(free_parameters.parameters, np.diag(covariance), strict=True)
    )
    fitted = start.with_parameters(identified)
    freedom = 4 * len(circles) - len(identified)
    square = float(solution.residual @ solution.residual)
    return AxisFit(
        robot=fitted,
        free=FreeParameters(identified),
        covariance=covariance,
        redundancies=redundancies,
        moving_flange=_moving_flange(fitted, redundancies),
        residual=math.sqrt(square / freedom) if freedom > 0 else None,
    )


def measured_axes(robot: Robot, circles: Sequence[AxisCircle]) -> AxisFit:
    """Return the axes themselves, with all joints at zero: four numbers a joint, none of them redundant.

    Args:
        robot: Where it stands, and with its axes near to the measured ones.
    """
    return fit_axes(converted(robot, "zero-reference"), circles, ("geometry",))


def _moving_flange(robot: Robot, redundancies: Sequence[Redundancy], seed: int = 0) -> tuple[str, ...]:
    """Return the held parameters whose combination moves the flange at random configurations."""
    q = robot.random_configurations(20, np.random.default_rng(seed))
    kinematics = robot.forward_kinematics(q)
    moving = []
    for redundancy in redundancies:
        names = list(redundancy.members)
        weights = np.array([redundancy.members[n] for n in names])
        linear, angular = robot.jacobians(kinematics, q, names)
        for part in (linear, angular):
            together = np.tensordot(weights, part, axes=1)
            alone = max(float(np.abs(w * p).max()) for w, p in zip(weights, part, strict=True))
            if float(np.abs(together).max()) > _NO_MOTION * alone:
                moving.append(redundancy.dropped)
                break
    return tuple(moving)


#: Tables of parameters that are made of the axes; parallel axes leave only Hayati's.
TABLES: Final = ("standard-dh", "s-model", "hayati")
#: Axes and circles that differ by more than this many deviations are not those of a rigid arm.
_LARGEST_MISFIT: Final = 2.0


LEFT_OUT: Final = Rule("left-out", "warning", "configurations that belong to no run")
NO_CIRCLE: Final = Rule("no-circle", "warning", "a target that was not used in a run")
NOT_CIRCULAR: Final = Rule(
    "not-circular", "warning", "the points are further from their circles than their deviations allow"
)
MISFIT: Final = Rule("misfit", "warning", "the robot's convention cannot hold the measured axes")


@dataclass(frozen=True, eq=False)
class AxisAnalysis:
    """What circles say about a robot."""

    nominal: Robot  #: The robot as its file has it.
    data: Dataset  #: The readings.
    found: AxisCircles  #: The circles.
    measured: AxisFit  #: The axes with all joints at zero, four numbers each.
    calibrated: AxisFit  #: The robot in its own convention.
    errors: AxisFit  #: The robot as its design with joint errors.
    in_robot_frame: bool  #: Whether the data are given in the robot's base frame; if not, axes 1 and 2 say where it is.

    @cached_property
    def robot(self) -> Robot:
        """The calibrated robot, with the targets where its own axes put them."""
        return self._with_targets(self.calibrated.robot)

    @cached_property
    def robot_with_errors(self) -> Robot:
        """The robot as its design with the joint errors found, and the targets."""
        return self._with_targets(self.errors.robot)

    def _with_targets(self, robot: Robot) -> Robot:
        position, rotation = robot.world_poses(self.data.postures)
        has_position = self.data.has_position
        places = {}
        for index, name in enumerate(self.data.targets):
            rows = np.flatnonzero((self.data.target == index) & has_position)
            at = self.data.configuration[rows]
            seen = np.einsum("nji,nj->ni", rotation[at], self.data.position[rows] - position[at])
            places[name] = seen.mean(axis=0)
        placed = robot.with_frames(robot.base, places)
        parameters = {n: p for n, p in robot.parameters.items() if p.group in ("geometry", "joint zero")}
        remark = f"calibrated axis by axis on {len(self.found.circles)} circles of {self.data.source}"
        calibrated = replace(placed.with_parameters(parameters.values()), history=(*robot.history, remark), proof=None)
        return calibrated.marked(self.data.simulated)

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """What of it comes from a virtual instrument."""
        return parts_of((self.data, self.nominal))

    @cached_property
    def base(self) -> tuple[Transform, float, float]:
        """Where the base frame stands, and the deviations of its place [m] and of its turn [rad] at the worst."""
        return self._frame(self._base_of)

    @cached_property
    def flange(self) -> tuple[Transform, float, float]:
        """Where the flange stands with all joints at zero, by the last two axes, with the same deviations."""
        return self._frame(self._flange_of)

    def _frame(self, place: Any) -> tuple[Transform, float, float]:
        measured = place(self.measured.robot)

        def moved(robot: Robot) -> Array:
            fitted = place(robot)
            return np.concatenate([fitted[:3, 3], rotation_vector(fitted[:3, :3] @ measured[:3, :3].T)])

        _, deviation = self.measured.derived(moved)
        transform = Transform.from_matrix(measured[:3, :3], measured[:3, 3])
        return transform, float(deviation[:3].max()), float(deviation[3:].max())

    def _base_of(self, robot: Robot) -> Array:
        if self.in_robot_frame:
            return self._nominal_ends[0]
        axes = joint_axes(robot)
        return np.asarray(frame_between(axes[0], axes[1]) @ self._base_on_axes)

    def _flange_of(self, robot: Robot) -> Array:
        axes = joint_axes(robot)
        return np.asarray(frame_between(axes[-1], axes[-2]) @ self._flange_on_axes)

    @cached_property
    def _nominal_ends(self) -> tuple[Array, Array]:
        """Base and flange of the nominal robot in the world, ``(4, 4)`` each."""
        return base_and_flange(self.nominal)

    @cached_property
    def _base_on_axes(self) -> Array:
        """The nominal base in the frame that axes 1 and 2 fix, ``(4, 4)``."""
        axes = joint_axes(self.nominal)
        return np.asarray(np.linalg.inv(frame_between(axes[0], axes[1])) @ self._nominal_ends[0])

    @cached_property
    def _flange_on_axes(self) -> Array:
        """The nominal flange in the frame that the last two axes fix, ``(4, 4)``."""
        axes = joint_axes(self.nominal)
        return np.asarray(np.linalg.inv(frame_between(axes[-1], axes[-2])) @ self._nominal_ends[1])

    def framed(self, robot: Robot) -> Robot:
        """Return measured axes as a robot between the two frames that they fix."""
        base, flange = self._base_of(robot), self._flange_of(robot)
        R, origin = base[:3, :3], base[:3, 3]
        rows = [
            {f"axis_{a}": float(v) for a, v in zip("xyz", R.T @ axis.along, strict=True)}
            | {a: float(v) for a, v in zip("xyz", R.T @ (axis.point - origin), strict=True)}
            for axis in joint_axes(robot)
        ]
        tip = np.linalg.inv(base) @ flange
        framed = replace(
            robot,
            joints=tuple(replace(joint, row=row, bearing=None) for joint, row in zip(robot.joints, rows, strict=True)),
            flange=Transform.from_matrix(tip[:3, :3], tip[:3, 3]),
            known={},
        )
        return framed.with_frames(Transform.from_matrix(R, origin), {})

    def table(self, convention_name: str) -> list[dict[str, tuple[float, float]]]:
        """Return the rows of the measured axes in a convention, each number with its deviation [SI].

        Raises:
            InputError: If the convention cannot describe the axes: nearly parallel ones in a DH table or the S-model.
        """
        columns = [list(joint.row) for joint in converted(self.framed(self.measured.robot), convention_name).joints]

        def numbers(robot: Robot) -> Array:
            robot_in = converted(self.framed(robot), convention_name)
            return np.array([j.row[c] for j, wanted in zip(robot_in.joints, columns, strict=True) for c in wanted])

        value, deviation = self.measured.derived(numbers)
        pairs = iter(zip(value.tolist(), deviation.tolist(), strict=True))
        return [{column: next(pairs) for column in wanted} for wanted in columns]

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What a person should know."""
        notices = []
        if self.found.left_out:
            notices.append(
                LEFT_OUT(
                    f"{self.found.left_out} of {self.data.configurations} configurations belong to no run in which one"
                    " joint moves alone, and were not used."
                )
            )
        notices += [NO_CIRCLE(f"A target was not used in one run. {refusal}") for refusal in self.found.refused]
        if self.found.excess > 1.0:
            notices.append(
                NOT_CIRCULAR(
                    f"The points are {self.found.excess:.2g} times further from their circles than the declared"
                    " deviations allow. The arm gives way, or something moved. All deviations are widened by that"
                    " factor."
                )
            )
        misfit = self.calibrated.residual
        if misfit is not None and misfit > _LARGEST_MISFIT:
            notices.append(
                MISFIT(
                    f"The convention {self.nominal.convention_name} leaves {misfit:.2g} deviations between the robot's"
                    " axes and the measured ones. If axes are parallel, convert the robot to hayati or to joint-errors."
                    " Otherwise the arm does not turn about fixed axes."
                )
            )
        return tuple(notices)


def analyse(robot: Robot, data: Dataset, *, in_robot_frame: bool = False) -> AxisAnalysis:
    """Find a robot's axes from measurements in which one joint moves at a time.

    Args:
        robot: Its current values are the nominal ones. Joint effects are kept, and deflect the axes as they say.
        data: Runs of every joint; see :func:`truearm.axis_circles.fit.find_runs`.
        in_robot_frame: Whether the data are given in the frame of the robot's base, as set up before (KR5 paper,
            section 3.1).

    Raises:
        InputError: If a joint has no run, slides, turns the other way or too little, or axes 1 and 2 or the last two
            are parallel.
    """
    if len(robot.joints) != data.joints.shape[1]:
        raise InputError(
            f"the data have other joints than {robot.name}",
            where=data.source,
            came=f"{data.joints.shape[1]} joints",
            allowed=f"{len(robot.joints)}",
        )
    circles = axis_circles(data)
    placed = robot if in_robot_frame else robot.with_frames(initial_frames(robot, data).base, {})
    groups: tuple[Group, ...] = ("geometry",) if in_robot_frame else ("base", "geometry")
    design = converted(placed, "joint-errors")
    return AxisAnalysis(
        nominal=robot,
        data=data,
        found=circles,
        measured=measured_axes(placed, circles.circles),
        calibrated=fit_axes(placed, circles.circles, (*groups, "joint zero")),
        errors=fit_axes(design, circles.circles, groups),
        in_robot_frame=in_robot_frame,
    )
