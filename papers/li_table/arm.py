"""The arm, the calibration table and the fits of Li et al. as the study li-table has them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.bounds import Bounds, bound_vectors
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import least_absolute, solve
from truearm.engine.motion.paths import Hermite
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.devices.calibration_table import CalibrationTable
from truearm.engine.twin.twin import Twin, directions
from truearm.engine.twin.twin_joint import JointTruth

TIP: Final = "tip"
#: The document's bounds on every deviation of a DH parameter.
BOUNDS: Final = Bounds.model_validate(
    {
        "truearm": "truearm-bounds/1",
        "units": {"length": "mm", "angle": "deg"},
        "within": {"d": 5.0, "a": 5.0, "theta_offset": 2.0, "alpha": 2.0},
    }
)
_SIZE: Final = {"m": 5e-3, "rad": math.radians(2.0)}
#: Deviation of a coordinate of the camera system, 0.28 mm at 95 % [m]: how well it captures the holes of the table.
CAMERA: Final = 0.28e-3 / 1.96
Tilt = Literal["normal", "roll", "pitch"]
#: Roll and pitch of the document [rad].
TILTS: Final[Mapping[Tilt, tuple[float, float]]] = {
    "normal": (0.0, 0.0),
    "roll": (math.radians(11.7), 0.0),
    "pitch": (0.0, math.radians(11.8)),
}
#: Invented: half the play of each joint, which way it lies being decided by the last move [rad].
PLAY: Final = math.radians(2.5)
#: Invented: how far parameters are off, lowest and highest share of the bounds, and what that makes the arm err at the
#: verification points on average [m].
WITHIN: Final = ((0.75, 1.0), (20e-3, 22e-3))
BEYOND: Final = ((1.0, 2.0), (25.5e-3, 28.2e-3))
#: Invented: where the table stands, its circle and its straight path [m], and the posture over it [rad].
PLACE: Final = Transform((0.31, 0.0, 0.15))
_RADIUS, _HALF_LENGTH = 0.08, 0.1
#: Half the sides of the box of unseen points [m].
_BOX: Final = np.array((0.08, 0.1, 0.05))
START: Final = np.radians((0.0, 60.0, -90.0))

Objective = Literal["distances", "components", "squares"]


def arm() -> Robot:
    """Return the nominal arm without beta, as the document models it, with its tip at the end of link 3."""
    robot = load_robot("li3")
    rows = [{column: value for column, value in joint.row.items() if column != "beta"} for joint in robot.joints]
    joints = tuple(replace(joint, row=row) for joint, row in zip(robot.joints, rows, strict=True))
    return replace(robot, joints=joints).with_frames(IDENTITY, {TIP: (0.0, 0.0, 0.0)})


def truth(
    nominal: Robot, rng: np.random.Generator, off: tuple[tuple[float, float], tuple[float, float]] = WITHIN
) -> Twin:
    """Return a twin without play, its parameters off by a share of the document's bounds, either way.

    They are drawn until the arm errs as much at the verification points as it shall.
    """
    share, error = off
    points = verification()
    joints = _joints_at(nominal, points)
    while True:
        values = {
            p.name: p.value + _SIZE[p.unit] * float(rng.uniform(*share) * rng.choice((-1.0, 1.0)))
            for p in _deviations(nominal).parameters
        }
        robot = nominal.with_values(values)
        if error[0] <= np.linalg.norm(robot.world_poses(joints, TIP)[0] - points, axis=1).mean() <= error[1]:
            return Twin(robot)


def with_play(twin: Twin) -> Twin:
    """Return the twin with play in every joint."""
    numbers = range(1, len(twin.robot.joints) + 1)
    return replace(twin, joints={number: JointTruth(hysteresis=PLAY) for number in numbers})


def board() -> Array:
    """Return 33 points in the table's frame [m]: a circle of 24 and a straight path of 9, ``(33, 3)``."""
    angle = np.arange(24) * (2 * np.pi / 24)
    circle = _RADIUS * np.stack([np.cos(angle), np.sin(angle), np.zeros(24)], axis=1)
    line = np.stack([np.zeros(9), np.linspace(-_HALF_LENGTH, _HALF_LENGTH, 9), np.zeros(9)], axis=1)
    return np.concatenate([circle, line])


def tables(points: Array) -> dict[Tilt, CalibrationTable]:
    """Return the table with some points, tilted in the document's three ways."""
    return {name: CalibrationTable(points, PLACE).tilted(*tilt) for name, tilt in TILTS.items()}


def touched_by_hand(table: CalibrationTable, twin: Twin, rng: np.random.Generator) -> Dataset:
    """Touch every point with the tip put there by hand: each joint's play lies either way, by chance."""
    approach = rng.choice((-1.0, 1.0), (len(table.points), len(twin.robot.joints)))
    return table.touched_by(twin, START, CAMERA, rng, approach=approach)


def fit(nominal: Robot, data: Dataset, objective: Objective, bounded: bool) -> Robot:
    """Identify the DH parameters, with base and tip known, as the document does (equation 4)."""
    free = _deviations(nominal)
    limits = bound_vectors(BOUNDS, free, "bounds of the document") if bounded else None
    problem = Problem(nominal, data, free, {"position": CAMERA}, priors=False)
    if objective == "components":
        found = least_absolute(problem, limits)[0].vector
    else:
        found = solve(problem, "l1" if objective == "distances" else "linear", limits).vector
    return nominal.with_values(dict(zip(free.names, map(float, found), strict=True)))


def at_bounds(nominal: Robot, fitted: Robot) -> int:
    """Return how many of the DH parameters lie at one of the document's bounds."""
    free = _deviations(nominal)
    moved = np.array([fitted.values[name] for name in free.names]) - free.nominal
    size = np.array([_SIZE[p.unit] for p in free.parameters])
    return int(np.sum(np.abs(moved) >= size * (1 - 1e-6)))


def around_the_table(nominal: Robot, count: int, rng: np.random.Generator) -> Array:
    """Return the nominal arm's joints ``(count, joints)`` at points drawn from a box about the table."""
    return _joints_at(nominal, np.array(PLACE.translation) + rng.uniform(-1.0, 1.0, (count, 3)) * _BOX)


def true_positions(twin: Twin, joints: Array, rng: np.random.Generator) -> Array:
    """Return where the tip is at joints ``(n, joints)``, each joint's play lying either way [m], ``(n, 3)``."""
    return _tip_of(twin, joints, rng.choice((-1.0, 1.0), joints.shape))


def following_errors(fitted: Robot, twin: Twin, points: Array) -> Array:
    """Return how far the true tip is from points that a robot is sent to in turn [mm], ``(n,)``.

    As the document verifies: the joints are those at which the fitted robot is on each point.
    """
    return np.asarray(1e3 * np.linalg.norm(followed_places(fitted, twin, points) - points, axis=1))


def followed_places(fitted: Robot, twin: Twin, points: Array) -> Array:
    """Return where the true tip is when a robot is sent to points in turn [m], ``(n, 3)``."""
    joints = _joints_at(fitted, points)
    return _tip_of(twin, joints, directions(joints))


def _joints_at(robot: Robot, points: Array) -> Array:
    """Return the joints at which a model has its tip on points ``(n, 3)`` [m], ``(n, joints)``."""
    return CalibrationTable(points).touched_by(Twin(robot), START, 0.0, np.random.default_rng(0)).joints


def _tip_of(twin: Twin, joints: Array, approach: Array) -> Array:
    return np.array([posture.targets[TIP][:3, 3] for posture in twin.postures(joints, approach=approach)])


def verification() -> Array:
    """Return points 1 to 6, invented, over and beside the table [m], ``(6, 3)``."""
    corners = ((-60, -110, 20), (70, -60, 40), (20, 10, 30), (-30, 70, 50), (60, 100, 10), (-80, 30, 60))
    return np.array(PLACE.translation) + 1e-3 * np.array(corners)


def trajectory(waypoints: Array, count: int = 40) -> Array:
    """Return points along cubic sections through waypoints ``(k, 3)`` [m], ``(count, 3)``."""
    path = Hermite(waypoints)
    return path.at(np.linspace(0.0, path.length, count))[0]


def other_waypoints() -> Array:
    """Return the waypoints of the other trajectory, invented [m], ``(5, 3)``."""
    corners = ((-90, 90, 0), (-20, 40, 50), (40, 0, 80), (60, -60, 30), (-20, -110, 10))
    return np.array(PLACE.translation) + 1e-3 * np.array(corners)


def library_arm() -> Robot:
    """Return the library's arm, beta included, with priors of the size of the document's bounds."""
    return believed(load_robot("li3"))


def believed(robot: Robot) -> Robot:
    """Return an arm whose nominal values are believed to be as good as the document's bounds say."""
    return replace(robot, priors=_SIZE)


def with_mistakes(data: Dataset, rng: np.random.Generator) -> Dataset:
    """Return the data with three of the positions noted for the hole before the one that was touched."""
    wrong = rng.choice(np.arange(1, len(data.position)), 3, replace=False)
    position = data.position.copy()
    position[wrong] = data.position[wrong - 1]
    return replace(data, position=position)


def _deviations(nominal: Robot) -> FreeParameters:
    """Return the document's design variables: d, theta, L and alpha of every link."""
    groups = ("joint zero", "geometry")
    return FreeParameters(tuple(p for p in nominal.parameters.values() if p.group in groups))
