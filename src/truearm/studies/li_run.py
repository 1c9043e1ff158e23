"""One seed of the study li-table: the twin touches tables, is fitted in several ways, and is judged."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.solving.fit import identify, place
from truearm.identification.solving.models import MODELS
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.simulation.devices.calibration_table import CalibrationTable, rectangular_grid
from truearm.simulation.twin import Twin
from truearm.studies.li import (
    BEYOND,
    BOUNDS,
    TILTS,
    TIP,
    Objective,
    arm,
    around_the_table,
    at_bounds,
    believed,
    board,
    by_hand,
    fit,
    following_errors,
    mistaken,
    other_waypoints,
    playing,
    tables,
    trajectory,
    truly,
    truth,
    verification,
)

_GEOMETRIC: Final = next(model for model in MODELS if model.name == "geometric")
TOGETHER: Final = "all three together"
METHODS: Final[Mapping[str, tuple[Objective, bool]]] = {
    "sum of distances, bounded (the document's)": ("distances", True),
    "sum of components, bounded": ("components", True),
    "least squares, bounded": ("squares", True),
    "least squares, unbounded": ("squares", False),
}
THEIRS, COMPONENTS, _, UNBOUNDED = METHODS
ALONE: Final = ("before, base and tip found", "bounded distances, base and tip free")


@dataclass(frozen=True, eq=False)
class LiRun:
    """Figures of one seed by name [mm, deg, percent], and errors along the other trajectory by table [mm]."""

    figures: Mapping[tuple[str, ...], float]
    along: Mapping[str, Array]


def run_table(seed: int, unseen: int) -> LiRun:
    """Calibrate the twin of a seed on every table, and judge at `unseen` points about it as well."""
    rng = np.random.default_rng(seed)
    nominal = arm()
    figures: dict[tuple[str, ...], float] = {}
    exact, touched = truth(nominal, rng), tables(board())
    twin = playing(exact)
    judged = around_the_table(nominal, unseen, rng)

    data = _readings(touched, twin, rng)
    fitted = _fit_and_judge("play", nominal, data, judged, truly(twin, judged, rng), figures)
    along = _follow("play", {"before": nominal} | {tilt: fitted[tilt, THEIRS] for tilt in data}, twin, figures)
    for tilt in TILTS:
        figures["at bounds", tilt] = at_bounds(nominal, fitted[tilt, THEIRS])
    for method in (THEIRS, COMPONENTS):
        figures |= _sums(method, fitted["normal", method], data["normal"])

    data = _readings(touched, exact, rng)
    there = truly(exact, judged, rng)
    _fit_and_judge("no play", nominal, data, judged, there, figures)
    _fit_and_judge("mistaken", nominal, {"roll": mistaken(data["roll"], rng)}, judged, there, figures)
    for tilt, table in touched.items():
        figures |= _without_camera(tilt, table, exact, judged, rng)

    far = truth(nominal, rng, BEYOND)
    data = _readings(touched, far, rng)
    theirs = {tilt: fit(nominal, data[tilt], *METHODS[THEIRS]) for tilt in TILTS}
    _follow("beyond", {"before": nominal} | theirs, far, figures)
    return LiRun(figures, along)


def _readings(touched: Mapping[str, CalibrationTable], twin: Twin, rng: np.random.Generator) -> dict[str, Dataset]:
    """Touch each table, and all of them, their points captured in the robot's base frame by the camera."""
    points = {tilt: table.in_world for tilt, table in touched.items()}
    points[TOGETHER] = np.concatenate(list(points.values()))
    return {tilt: by_hand(CalibrationTable(holes), twin, rng) for tilt, holes in points.items()}


def _fit_and_judge(
    case: str,
    nominal: Robot,
    data: Mapping[str, Dataset],
    judged: Array,
    there: Array,
    figures: dict[tuple[str, ...], float],
) -> dict[tuple[str, str], Robot]:
    """Fit by every method to every table, and compare with where the twin truly is at unseen readings."""
    figures[case, "before"] = _apart(nominal, judged, there)
    fitted = {}
    for tilt, readings in data.items():
        for method, (objective, bounded) in METHODS.items():
            robot = fitted[tilt, method] = fit(nominal, readings, objective, bounded)
            figures[case, tilt, method] = _apart(robot, judged, there)
    return fitted


def _follow(
    case: str, robots: Mapping[str, Robot], twin: Twin, figures: dict[tuple[str, ...], float]
) -> dict[str, Array]:
    """Send the twin to the verification points and along the other trajectory, by each model."""
    points, path = verification(), trajectory(other_waypoints())
    along = {}
    for name, robot in robots.items():
        along[name] = following_errors(robot, twin, path)
        errors = {"points": following_errors(robot, twin, points), "path": along[name]}
        for kind, apart in errors.items():
            figures[case, kind, name] = float(apart.mean())
            figures[case, f"{kind}, gain", name] = 100.0 * (
                1.0 - figures[case, kind, name] / figures[case, kind, "before"]
            )
        figures[case, "path, largest", name] = float(along[name].max())
    return along


def _sums(method: str, robot: Robot, data: Dataset) -> dict[tuple[str, ...], float]:
    errors = 1e3 * (robot.world_poses(data.joints, TIP)[0] - data.position)
    return {
        ("sum", "distances", method): float(np.linalg.norm(errors, axis=1).mean()),
        ("sum", "components", method): float(np.abs(errors).sum(axis=1).mean()),
    }


def _without_camera(
    tilt: str, table: CalibrationTable, twin: Twin, judged: Array, rng: np.random.Generator
) -> dict[tuple[str, ...], float]:
    """Identify from the known points in the table's own frame, and judge there."""
    nominal = believed()
    data = by_hand(table, twin, rng)
    grid = by_hand(tables(rectangular_grid(5, 7, 0.025))[tilt], twin, rng).joints
    rotation, origin = table.place.rotation, np.array(table.place.translation)
    found: dict[tuple[str, ...], float] = {}
    fits = (place(nominal, data), identify(nominal, data, _GEOMETRIC, loss="l1", bounds=BOUNDS))
    for name, fitted in zip(ALONE, fits, strict=True):
        for where, joints in (("table", grid), ("around", judged)):
            true = (truly(twin, joints, rng) - origin) @ rotation
            found[f"alone, {where}", tilt, name] = _apart(fitted.robot, joints, true)
        normal = fitted.robot.base.rotation[2]  # of T_table_base: the plate's normal in the robot's base
        found["alone, tilt", tilt, name] = math.degrees(math.acos(min(1.0, float(normal @ rotation[:, 2]))))
    return found


def _apart(robot: Robot, joints: Array, true: Array) -> float:
    """Return how far a robot is on average from where it believes to be [mm]."""
    return 1e3 * float(np.linalg.norm(robot.world_poses(joints, TIP)[0] - true, axis=1).mean())
