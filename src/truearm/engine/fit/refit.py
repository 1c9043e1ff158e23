"""Where base, targets or tool stand now, everything else as it was calibrated, and the errors that then remain.

After a calibration an instrument is carried elsewhere, a reflector is put on anew, or a tool is unscrewed and mounted
again. What moved is found from new readings alone: start values in closed form (Kabsch 1976), then Gauss-Newton on the
parameters of the base, of the targets, or on the six of one rigid motion of all targets together.

The readings that say what moved cannot judge the robot as if nothing had been fitted to them. Every configuration is
therefore judged by what is found without it. For a linear problem with the hat matrix H that is exact without fitting
again: residuals of a configuration c become ``(I - H_cc)^-1 r_c`` (Cook and Weisberg 1982).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import Errors
from truearm.engine.fit.problem import NOISE_FLOOR, Problem
from truearm.engine.fit.start_values import with_fixtures_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion, rotation_from_quaternion, rotation_from_vector

Moved = Literal["base", "targets", "tool"]
MOVED: Final[tuple[Moved, ...]] = get_args(Moved)

_ROUNDS: Final = 20
#: Step that is the last one [m or rad].
_LAST_STEP: Final = 1e-10
#: Singular values below this share of the largest belong to motions that the readings do not see.
_LEAST_SEEN: Final = 1e-6
#: A configuration without which so little of its own residual is left to judge it decides alone where something is.
_LEAST_LEFT: Final = 0.02
#: Rounds in which deviations of readings that declare none are found.
_NOISE_ROUNDS: Final = 3

Places = dict[str, Transform | tuple[float, float, float]]


@dataclass(frozen=True, eq=False)
class Refit:
    """What moved, and how well the robot agrees with readings from there."""

    moved: Moved  #: What was found anew.
    robot: Robot  #: The robot with it.
    errors: Errors  #: Of every configuration, by what is found without it.
    parameters: int  #: How many numbers were found.
    readings: int  #: From how many readings.
    #: By how much it moved [m]: the base at the middle of the readings, a tool at the middle of its targets, of targets
    #: and fixtures the one that moved farthest.
    shift: float
    turn: float | None  #: By how much it turned [rad]; None where only positions were found.
    #: By how much each target moved on the flange, or each fixture [m]; empty for base and tool.
    shifts: Mapping[str, float]


def refit(robot: Robot, data: Dataset, moved: Moved) -> Refit:
    """Find from readings where base, targets or tool are, and judge the robot there.

    Args:
        robot: With base and targets; its other parameters stay.
        data: Readings of those.
        moved: ``base``: where the robot stands before the instrument, and the fixtures that readings are measured
            against; ``targets``: each target on the flange; ``tool``: all targets together, as a rigid body.

    Raises:
        InputError: If the readings are too few to find it and to judge it.
    """
    data = _comparable(robot, data)
    referenced = _referenced(robot.marked(data.simulated))
    placed = _start(referenced, data, moved)
    noise = {observation.name: 1e-4 for observation in OBSERVATIONS}
    for _ in range(_NOISE_ROUNDS):
        placed, linear = _solved(placed, data, moved, noise)
        noise = _noise_of(linear, noise)
    left = _left_without_each(linear)
    errors = _errors_of(linear.problem, left, data)
    old, new = _places(referenced), _places(placed)
    read = [data.targets[t] for t in np.unique(data.target[data.has_reading]).tolist()]
    shifts: dict[str, float] = {}
    if moved == "tool":
        points = [np.array([_point(places[name]) for name in read]) for places in (old, new)]
        shift = float(np.linalg.norm(points[1].mean(axis=0) - points[0].mean(axis=0)))
        turn = _turn_between(old, new, read, placed)
    elif moved == "targets":
        shifts = {name: float(np.linalg.norm(_point(new[name]) - _point(old[name]))) for name in read}
        shift, turn = max(shifts.values()), None
    else:
        shift, turn, shifts = _base_motion(referenced, placed, data)
    return Refit(moved, placed, errors, int(linear.basis.shape[1]), int(data.has_reading.sum()), shift, turn, shifts)


@dataclass(frozen=True, eq=False)
class _Linear:
    """The whitened problem where it was solved: residual ``(rows,)`` and what can be taken of it ``(rows, rank)``."""

    problem: Problem
    residual: Array
    basis: Array


def _comparable(robot: Robot, data: Dataset) -> Dataset:
    """Return the data without orientations of targets that the robot knows as points only."""
    if data.quaternion is None:
        return data
    points = [i for i, name in enumerate(data.targets) if robot.target(name).quaternion is None]
    of_points = np.isin(data.target, points)
    return replace(data, quaternion=np.where(of_points[:, None], np.nan, data.quaternion)) if points else data


def _solved(robot: Robot, data: Dataset, moved: Moved, noise: dict[str, float]) -> tuple[Robot, _Linear]:
    """Return the robot where readings are matched best, by Gauss-Newton."""
    if moved != "base":
        data = replace(data, setup=None)
    for _ in range(_ROUNDS):
        free = _free(robot, data, moved)
        problem = Problem(robot, data, free, noise)
        r, J = problem.linearised(free.start)
        T = _tool_motion(robot, free) if moved == "tool" else np.eye(len(free.names))
        U, s, Vt = np.linalg.svd(J @ T, full_matrices=False)
        seen = s > _LEAST_SEEN * s[0]
        step = -(Vt[seen].T / s[seen]) @ (U[:, seen].T @ r)
        robot = _stepped(robot, free, step, moved)
        if float(np.abs(step).max(initial=0.0)) < _LAST_STEP:
            break
    return robot, _Linear(problem, r, U[:, seen])


def _free(robot: Robot, data: Dataset, moved: Moved) -> FreeParameters:
    """Return the parameters that say where it is."""
    if moved == "base":
        fixtures = {robot.fixture(name).parameter(axis) for name in data.fixtures for axis in ("x", "y", "z")}
        turns = {robot.fixture(name).parameter(axis) for name in data.fixtures for axis in ("rx", "ry", "rz")}
        free = [
            p
            for p in robot.parameters.values()
            if (p.group == "base" and data.anchored) or p.name in fixtures or p.name in turns
        ]
    else:
        read = {data.targets[t] for t in np.unique(data.target[data.has_reading]).tolist()}
        names = {
            target.parameter(axis)
            for target in robot.targets
            if target.name in read
            for axis in ("x", "y", "z", "rx", "ry", "rz")
        }
        free = [p for p in robot.parameters.values() if p.name in names]
    return FreeParameters(tuple(free))


def _tool_motion(robot: Robot, free: FreeParameters) -> Array:
    """Return how the targets' parameters follow a shift and a turn of all of them about their middle, ``(k, 6)``."""
    places, at = _places(robot), {name: i for i, name in enumerate(free.names)}
    targets = [target for target in robot.targets if target.parameter("x") in at]
    middle = np.mean([_point(places[target.name]) for target in targets], axis=0)
    T = np.zeros((len(free.names), 6))
    for target in targets:
        rows = [at[target.parameter(axis)] for axis in "xyz"]
        T[rows, :3] = np.eye(3)
        x, y, z = _point(places[target.name]) - middle
        T[rows, 3:] = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        place = places[target.name]
        if isinstance(place, Transform):
            T[[at[target.parameter(axis)] for axis in ("rx", "ry", "rz")], 3:] = place.rotation.T
    return T


def _stepped(robot: Robot, free: FreeParameters, step: Array, moved: Moved) -> Robot:
    """Return the robot after a step, with small turns taken into the reference orientations."""
    if moved != "tool":
        return _referenced(robot.with_values(free.values(free.start + step)))  # type: ignore[arg-type]
    places, names = _places(robot), set(free.names)
    moved_targets = [target.name for target in robot.targets if target.parameter("x") in names]
    middle = np.mean([_point(places[name]) for name in moved_targets], axis=0)
    R = rotation_from_vector(step[3:])
    return robot.with_frames(robot.base, _turned(places, R, middle + step[:3] - R @ middle))


def _turned(places: Places, R: Array, shift: Array) -> Places:
    """Return places on the flange after a motion of all of them."""
    return {
        name: Transform.from_matrix(R @ place.rotation, R @ _point(place) + shift)
        if isinstance(place, Transform)
        else _triple(R @ _point(place) + shift)
        for name, place in places.items()
    }


def _start(robot: Robot, data: Dataset, moved: Moved) -> Robot:
    """Return the robot with what moved where closed forms say it is."""
    read = data.has_position
    if moved == "base":
        if read.any():
            places = np.array([robot.world_poses(data.postures, name)[0] for name in data.targets])
            R, p = rigid_motion(places[data.target, data.configuration][read], data.position[read])
            base = robot.base
            moved_base = Transform.from_matrix(R @ base.rotation, R @ np.array(base.translation) + p)
            robot = robot.with_frames(moved_base, _places(robot))
        return with_fixtures_of(robot, data)
    if not read.any():
        return robot
    known = _places(robot)
    p, R = robot.world_poses(data.postures)
    at = data.configuration[read]
    on_flange = np.einsum("nji,nj->ni", R[at], data.position[read] - p[at])
    seen = {
        data.targets[t]: np.median(on_flange[data.target[read] == t], axis=0)
        for t in np.unique(data.target[read]).tolist()
    }
    turned = _seen_orientations(data, R)
    if moved == "targets":
        return robot.with_frames(
            robot.base,
            {
                name: place
                if name not in seen
                else Transform.from_matrix(turned.get(name, place.rotation), seen[name])
                if isinstance(place, Transform)
                else _triple(seen[name])
                for name, place in known.items()
            },
        )
    before = np.array([_point(known[name]) for name in seen])
    after = np.array(list(seen.values()))
    turns = [turned[name] @ at.rotation.T for name, at in known.items() if isinstance(at, Transform) and name in turned]
    if turns:
        turn = turns[0]
    elif len(before) > 2 and _apart_from_a_line(before):
        turn, _ = rigid_motion(before, after)
    else:
        turn = np.eye(3)
    return robot.with_frames(
        robot.base, _turned(known, turn, np.asarray(after.mean(axis=0) - turn @ before.mean(axis=0)))
    )


def _seen_orientations(data: Dataset, flange: Array) -> dict[str, Array]:
    """Return the orientation of each target on the flange at the first reading that has one, ``(3, 3)``."""
    orientations: dict[str, Array] = {}
    for i in np.flatnonzero(data.has_orientation).tolist() if data.quaternion is not None else ():
        name = data.targets[data.target[i]]
        if name not in orientations and data.quaternion is not None:
            orientations[name] = flange[data.configuration[i]].T @ rotation_from_quaternion(data.quaternion[i])
    return orientations


def _apart_from_a_line(points: Array) -> bool:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 0.05 * spread[0])


def _noise_of(linear: _Linear, noise: dict[str, float]) -> dict[str, float]:
    """Return the deviations of readings that declare none, from what is left of them."""
    rows, seen = len(linear.residual), dict(noise)
    correction = rows / max(rows - linear.basis.shape[1], 1)
    first = 0
    squares: dict[str, list[Array]] = {}
    for block in linear.problem.blocks:
        if not block.declared:
            squares.setdefault(block.observation.name, []).append(linear.residual[first : first + block.rows] ** 2)
        first += block.rows
    for name, parts in squares.items():
        factor = float(np.sqrt(correction * np.mean(np.concatenate(parts))))
        seen[name] = max(noise[name] * factor, NOISE_FLOOR)
    return seen


def _left_without_each(linear: _Linear) -> Array:
    """Return the whitened residual of each configuration by what is found without it, ``(rows,)``."""
    problem, data, left = linear.problem, linear.problem.data, linear.residual.copy()
    of_row = np.concatenate(
        [
            np.repeat(data.configuration[b.readings], b.observation.components)
            if b.data is data
            else np.full(b.rows, -1)
            for b in problem.blocks
        ]
    )
    for c in np.unique(of_row[of_row >= 0]).tolist():
        rows = np.flatnonzero(of_row == c)
        U = linear.basis[rows]
        strength, turns = np.linalg.eigh(np.eye(len(rows)) - U @ U.T)
        if strength[0] < _LEAST_LEFT:
            raise InputError(
                "the readings are too few, or their configurations too much alike, to find what moved and to judge it",
                where=data.source,
                came=f"configuration {data.labels[c]} decides alone",
                cure="Measure more configurations.",
            )
        left[rows] = turns @ ((turns.T @ linear.residual[rows]) / strength)
    return left


def _errors_of(problem: Problem, left: Array, data: Dataset) -> Errors:
    """Return whitened residuals as errors of readings."""
    count = len(data.target)
    position = np.full((count, 3), np.nan)
    orientation = np.full((count, 3), np.nan) if data.quaternion is not None else None
    length = np.full((count, 1), np.nan) if data.distance is not None or data.height is not None else None
    errors = {"position": position, "orientation": orientation, "distance": length, "height": length}
    first = 0
    for block in problem.blocks:
        into = errors[block.observation.name]
        if block.data is problem.data and into is not None:
            raw = left[first : first + block.rows].reshape(len(block.readings), -1) * block.sigma[:, None]
            into[block.readings] = raw
        first += block.rows
    return Errors(data.configurations, position, orientation, None if length is None else length[:, 0])


def _base_motion(old: Robot, new: Robot, data: Dataset) -> tuple[float, float | None, dict[str, float]]:
    """Return by how much readings moved as a whole at their middle, or fixtures where nothing else could."""
    if data.anchored:
        R = new.base.rotation @ old.base.rotation.T
        places = np.array([old.world_poses(data.postures, name)[0] for name in data.targets])
        middle = places[data.target, data.configuration][data.has_reading].mean(axis=0)
        moved_middle = R @ (middle - np.array(old.base.translation)) + np.array(new.base.translation)
        return float(np.linalg.norm(moved_middle - middle)), _angle(R), {}
    shifts = {}
    for name in data.fixtures:
        before, after = (robot.fixture_kinematics(name).position[:, 0] for robot in (old, new))
        shifts[name] = float(np.linalg.norm(after - before))
    return max(shifts.values(), default=0.0), None, shifts


def _turn_between(old: Places, new: Places, read: list[str], robot: Robot) -> float | None:
    """Return the angle of a tool's motion [rad]; None where only its position shows."""
    posed = [name for name in read if robot.target(name).quaternion is not None]
    if posed:
        before, after = old[posed[0]], new[posed[0]]
        if isinstance(before, Transform) and isinstance(after, Transform):
            return _angle(after.rotation @ before.rotation.T)
    points = [np.array([_point(places[name]) for name in read]) for places in (old, new)]
    if len(read) < 3 or not _apart_from_a_line(points[0]):
        return None
    return _angle(rigid_motion(points[0], points[1])[0])


def _angle(R: Array) -> float:
    return float(np.arccos(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)))


def _referenced(robot: Robot) -> Robot:
    """Return the robot in the same place, with its small turns taken into the reference orientations."""
    return robot.with_frames(robot.base, _places(robot))


def _places(robot: Robot) -> Places:
    """Return where each target is on the flange."""
    places: Places = {}
    for target in robot.targets:
        at = target.chain.forward_kinematics(np.zeros((0, 1)), robot.values)
        point = at.position[:, 0]
        places[target.name] = (
            _triple(point) if target.quaternion is None else Transform.from_matrix(at.matrix()[0], point)
        )
    return places


def _point(place: Transform | tuple[float, float, float]) -> Array:
    return np.array(place.translation if isinstance(place, Transform) else place)


def _triple(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
