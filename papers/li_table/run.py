"""One seed of the study li-table: the twin touches tables, is fitted in several ways, and compared with the fits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np

from papers import Progress
from papers.li_table.arm import (
    BEYOND,
    BOUNDS,
    TILTS,
    TIP,
    Objective,
    Tilt,
    arm,
    around_the_table,
    at_bounds,
    board,
    fit,
    followed_places,
    following_errors,
    library_arm,
    other_waypoints,
    tables,
    touched_by_hand,
    trajectory,
    true_positions,
    truth,
    verification,
    with_mistakes,
    with_play,
)
from papers.seeds import Seed, over_seeds
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.calibration_table import CalibrationTable, rectangular_grid
from truearm.engine.twin.twin import Twin

_GEOMETRIC: Final = next(model for model in MODELS if model.name == "geometric")
#: What is fitted to: one of the three tables, or all of them.
Surface = Literal[Tilt, "together"]
SURFACES: Final[tuple[Surface, ...]] = (*TILTS, "together")
#: How: the document's sum of distances in bounds, sum of components in bounds, squares in bounds and without.
Method = Literal["distances", "components", "squares", "unbounded"]
METHODS: Final[tuple[Method, ...]] = ("distances", "components", "squares", "unbounded")
_FITS: Final[Mapping[Method, tuple[Objective, bool]]] = {
    "distances": ("distances", True),
    "components": ("components", True),
    "squares": ("squares", True),
    "unbounded": ("squares", False),
}
#: The two methods that differ in how the document's |X - X'| is understood.
Measure = Literal["distances", "components"]
MEASURES: Final[tuple[Measure, ...]] = ("distances", "components")
#: Without camera: base and tip found alone, or with the DH parameters.
Alone = Literal["placed", "identified"]
ALONE: Final[tuple[Alone, ...]] = ("placed", "identified")


@dataclass(frozen=True, eq=False)
class Left:
    """Mean distance between true tip and prediction at unseen points [mm]."""

    before: float  #: Of the nominal arm.
    after: Mapping[tuple[Surface, Method], float]  #: By what was fitted to and how.


@dataclass(frozen=True, eq=False)
class Followed:
    """How far the twin's tip was from where one model sent it [mm]."""

    points: Array  #: At the verification points, ``(6,)``.
    path: Array  #: Along the other trajectory, ``(n,)``.


@dataclass(frozen=True, eq=False)
class Following:
    """The twin sent to the verification points and along the other trajectory."""

    before: Followed  #: By the nominal arm.
    after: Mapping[Surface, Followed]  #: By the document's fit to each table.

    def gain_at_points(self, surface: Surface) -> float:
        """Return by how much the fit reduces the mean error at the points [%]."""
        return 100.0 * (1.0 - float(self.after[surface].points.mean()) / float(self.before.points.mean()))

    def gain_on_path(self, surface: Surface) -> float:
        """Return by how much the fit reduces the mean error along the trajectory [%]."""
        return 100.0 * (1.0 - float(self.after[surface].path.mean()) / float(self.before.path.mean()))


@dataclass(frozen=True)
class WithoutCamera:
    """What the known points of one table alone are worth."""

    table: float  #: table, around: mean error at other points of the table, and about it, in its own frame [mm].
    around: float
    normal: float  #: Error of the table's normal in the robot's base [deg].


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed gives."""

    play: Left  #: play, no_play: what fits leave, joints having play or none.
    no_play: Left
    #: Mean error at unseen points after fits to the rolled table, three of its holes mistaken, no play [mm].
    mistaken: Mapping[Method, float]
    following: Following  #: With play.
    beyond: Following  #: Without play, parameters off by more than the bounds.
    at_bounds: Mapping[Tilt, int]  #: How many DH parameters the document's fit leaves at a bound, with play.
    #: Equation 4 per hole of the level table [mm]: by measure, and by the measure that was fitted by.
    sums: Mapping[tuple[Measure, Measure], float]
    without_camera: Mapping[tuple[Tilt, Alone], WithoutCamera]  #: By table, and by what was found.
    #: Where the nominal arm should go and where the twin goes [m], ``(n, 3)`` each: through the verification points,
    #: and along the other trajectory; with play.
    paths: tuple[tuple[Array, Array], tuple[Array, Array]]
    touched: Mapping[Surface, Dataset]  #: Readings of each table, and of all, joints having no play.
    unseen: Dataset  #: Where the tip truly is at the unseen points then.


def run(seeds: int, progress: Progress, unseen: int) -> tuple[Outcome, ...]:
    """Calibrate the twin of each seed on every table, and judge it.

    Args:
        seeds: How many: of true parameters, play, noise and unseen points.
        progress: Called with a few words at each step.
        unseen: Points about the table to judge by.
    """
    return over_seeds(seeds, progress, partial(_one, unseen=unseen))


def _one(seed: Seed, unseen: int) -> Outcome:
    rng = seed.generator()
    nominal = arm()
    exact, touched = truth(nominal, rng), tables(board())
    twin = with_play(exact)
    judged = around_the_table(nominal, unseen, rng)

    data = _measured(touched, twin, rng)
    fitted = {(surface, method): _fit(nominal, data[surface], method) for surface in SURFACES for method in METHODS}
    play = _left(nominal, fitted, judged, true_positions(twin, judged, rng))
    sums = {key: value for by in MEASURES for key, value in _sums(by, fitted["normal", by], data["normal"]).items()}

    data = _measured(touched, exact, rng)
    there = true_positions(exact, judged, rng)
    without_play, unseen_points = data, _as_read(data["normal"], judged, there)
    perfect = {(surface, method): _fit(nominal, data[surface], method) for surface in SURFACES for method in METHODS}
    mistaken = with_mistakes(data["roll"], rng)
    alone = {
        key: found
        for tilt, table in touched.items()
        for key, found in _without_camera(tilt, table, exact, judged, rng).items()
    }

    far = truth(nominal, rng, BEYOND)
    data = _measured(touched, far, rng)
    return Outcome(
        play=play,
        no_play=_left(nominal, perfect, judged, there),
        mistaken={method: _apart(_fit(nominal, mistaken, method), judged, there) for method in METHODS},
        following=_following(nominal, {surface: fitted[surface, "distances"] for surface in SURFACES}, twin),
        beyond=_following(nominal, {tilt: _fit(nominal, data[tilt], "distances") for tilt in TILTS}, far),
        at_bounds={tilt: at_bounds(nominal, fitted[tilt, "distances"]) for tilt in TILTS},
        sums=sums,
        without_camera=alone,
        paths=(_path(nominal, twin, verification()), _path(nominal, twin, other_waypoints())),
        touched=without_play,
        unseen=unseen_points,
    )


def _as_read(like: Dataset, joints: Array, positions: Array) -> Dataset:
    """Return where the tip is at joint positions, as readings without noise."""
    count = len(joints)
    return Dataset(
        source="unseen points",
        labels=tuple(str(number + 1) for number in range(count)),
        joints=joints,
        joint_kinds=like.joint_kinds,
        targets=like.targets,
        configuration=np.arange(count),
        target=np.zeros(count, dtype=np.intp),
        position=positions,
    )


def _measured(touched: Mapping[Tilt, CalibrationTable], twin: Twin, rng: np.random.Generator) -> dict[Surface, Dataset]:
    """Touch each table, and all of them, their points captured in the robot's base frame by the camera."""
    points: dict[Surface, Array] = {tilt: table.in_world for tilt, table in touched.items()}
    points["together"] = np.concatenate(list(points.values()))
    return {surface: touched_by_hand(CalibrationTable(holes), twin, rng) for surface, holes in points.items()}


def _fit(nominal: Robot, data: Dataset, method: Method) -> Robot:
    return fit(nominal, data, *_FITS[method])


def _left(nominal: Robot, fitted: Mapping[tuple[Surface, Method], Robot], judged: Array, there: Array) -> Left:
    """Compare robots with where the twin truly is at unseen joint positions."""
    after = {key: _apart(robot, judged, there) for key, robot in fitted.items()}
    return Left(_apart(nominal, judged, there), after)


def _following(nominal: Robot, robots: Mapping[Surface, Robot], twin: Twin) -> Following:
    """Send the twin to the verification points and along the other trajectory, by each model."""
    points, path = verification(), trajectory(other_waypoints())

    def followed(robot: Robot) -> Followed:
        return Followed(following_errors(robot, twin, points), following_errors(robot, twin, path))

    return Following(followed(nominal), {surface: followed(robot) for surface, robot in robots.items()})


def _path(nominal: Robot, twin: Twin, waypoints: Array) -> tuple[Array, Array]:
    path = trajectory(waypoints)
    return path, followed_places(nominal, twin, path)


def _sums(by: Measure, robot: Robot, data: Dataset) -> dict[tuple[Measure, Measure], float]:
    errors = 1e3 * (robot.world_poses(data.joints, TIP)[0] - data.position)
    return {
        ("distances", by): float(np.linalg.norm(errors, axis=1).mean()),
        ("components", by): float(np.abs(errors).sum(axis=1).mean()),
    }


def _without_camera(
    tilt: Tilt, table: CalibrationTable, twin: Twin, judged: Array, rng: np.random.Generator
) -> dict[tuple[Tilt, Alone], WithoutCamera]:
    """Identify from the known points in the table's own frame, and judge there."""
    nominal = library_arm()
    data = touched_by_hand(table, twin, rng)
    grid = touched_by_hand(tables(rectangular_grid(5, 7, 0.025))[tilt], twin, rng).joints
    rotation, origin = table.place.rotation, np.array(table.place.translation)
    found: dict[tuple[Tilt, Alone], WithoutCamera] = {}
    robots = (place(nominal, data), identify(nominal, data, _GEOMETRIC, loss="l1", bounds=BOUNDS).robot)
    for name, robot in zip(ALONE, robots, strict=True):
        on_table, around = (
            _apart(robot, joints, (true_positions(twin, joints, rng) - origin) @ rotation) for joints in (grid, judged)
        )
        normal = robot.base.rotation[2]  # of T_table_base: the plate's normal in the robot's base
        leaning = math.degrees(math.acos(min(1.0, float(normal @ rotation[:, 2]))))
        found[tilt, name] = WithoutCamera(on_table, around, leaning)
    return found


def _apart(robot: Robot, joints: Array, true: Array) -> float:
    """Return how far the true tip is on average from where a robot predicts it [mm]."""
    return 1e3 * float(np.linalg.norm(robot.world_poses(joints, TIP)[0] - true, axis=1).mean())
