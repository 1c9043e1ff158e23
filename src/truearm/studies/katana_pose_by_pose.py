"""The Katana identified pose by pose and from all poses at once, for the study katana-influence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.solving.influence import Influence, influence
from truearm.identification.solving.pose_by_pose import Combination, influence_based, least_squares, minimum_norm
from truearm.measurement.dataset import Dataset
from truearm.modeling.robot import Robot
from truearm.planning.poses.iso9283 import Cube
from truearm.planning.poses.pose_plan import plan_poses
from truearm.simulation.twin import measure
from truearm.studies.katana import (
    CHAPTER_5_CUBE,
    NAMES,
    NOISE,
    PERTURBATIONS,
    TILTING,
    TIP,
    UNITS,
    katana,
    pose_errors,
    published,
    tip_poses,
    true_poses,
    twin,
)

_LENGTHS: Final = ("a_3", "a_4", "d_5", "target_tip_z")
_ANGLES: Final = {"rad": 1.0, "deg": math.radians(1.0)}
COMBINATIONS: Final[tuple[Combination, ...]] = ("mean", "scaled-mean", "best-pose")

#: The robots that are calibrated, and the methods.
FULL, GEOMETRY, OTHER = "Table 3.2 and tilting joints", "Table 3.2", "Table 3.3"
NORM, INFLUENCE, JOINT = "minimum norm, pose by pose", "influence-based, pose by pose", "joint least squares"


@dataclass(frozen=True, eq=False)
class InfluenceRun:
    """What one seed gives.

    Attributes
    ----------
    influence, chapter_5
        Over the poses, and over poses in the cube of chapter 5.
    poses
        Mean absolute errors at the poses [mm, deg], by robot, method and quantity.
    unseen
        Mean position error at unseen configurations [mm], by robot and method.
    combined
        The same on the robot of Table 3.2, by method and combination.
    apart
        Mean distance between the predictions of Tables 3.2 and 3.3 [mm].
    lengths
        Largest change of a length by minimum norm [mm], by the unit of angles.
    """

    influence: Influence
    chapter_5: Influence
    poses: Mapping[tuple[str, str], Mapping[str, float]]
    unseen: Mapping[tuple[str, str], float]
    combined: Mapping[tuple[str, Combination], float]
    apart: float
    lengths: Mapping[str, float]


def run_influence(seed: int, cube: Cube, count: int, unseen: int) -> InfluenceRun:
    """Calibrate three twins from `count` poses in a cube, and judge there and at `unseen` configurations."""
    rng = np.random.default_rng(seed)
    nominal = katana()
    joints, central = (
        plan_poses(nominal, c, target=TIP, count=count, seed=seed).joints for c in (cube, CHAPTER_5_CUBE)
    )
    others = nominal.random_configurations(unseen, rng)
    poses: dict[tuple[str, str], Mapping[str, float]] = {}
    left: dict[tuple[str, str], float] = {}
    combined: dict[tuple[str, Combination], float] = {}
    for name, truth in (
        (OTHER, twin(published("influence"), {})),
        (FULL, twin(published("standard"), TILTING)),
        (GEOMETRY, twin(published("standard"), {})),
    ):
        data = measure(truth, joints, NOISE, rng)
        true, elsewhere = true_poses(truth, joints), true_poses(truth, others)
        found = {
            "before": nominal,
            NORM: _one_at_a_time(NORM, nominal, data, "mean"),
            INFLUENCE: _one_at_a_time(INFLUENCE, nominal, data, "mean"),
            JOINT: least_squares(nominal, data, NAMES, TIP),
        }
        for method, robot in found.items():
            errors = pose_errors(tip_poses(robot, joints), true)
            poses[name, method] = {quantity: float(values.mean()) for quantity, values in errors.items()}
            left[name, method] = float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean())
    for method in (NORM, INFLUENCE):  # of the last truth
        for combination in COMBINATIONS:
            robot = _one_at_a_time(method, nominal, data, combination)
            combined[method, combination] = float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean())
    standard, other = (published(table).world_poses(joints, TIP)[0] for table in ("standard", "influence"))
    return InfluenceRun(
        influence=influence(nominal, joints, NAMES, TIP, PERTURBATIONS),
        chapter_5=influence(nominal, central, NAMES, TIP, PERTURBATIONS),
        poses=poses,
        unseen=left,
        combined=combined,
        apart=1e3 * float(np.linalg.norm(standard - other, axis=1).mean()),
        lengths={unit: _length_change(nominal, data, size) for unit, size in _ANGLES.items()},
    )


def _one_at_a_time(method: str, nominal: Robot, data: Dataset, combination: Combination) -> Robot:
    if method == NORM:
        return minimum_norm(nominal, data, NAMES, TIP, combination=combination, units=UNITS).robot
    return influence_based(
        nominal, data, NAMES, TIP, combination=combination, units=UNITS, perturbations=PERTURBATIONS
    ).robot


def _length_change(nominal: Robot, data: Dataset, angle: float) -> float:
    """Return the largest change of a length [mm] if angles are counted in `angle` [rad] and lengths in mm."""
    units = {name: angle * UNITS.get(name, 1.0) for name in NAMES if name not in _LENGTHS}
    found = minimum_norm(nominal, data, NAMES, TIP, units=units).robot
    return 1e3 * max(abs(found.values[name] - nominal.values[name]) for name in _LENGTHS)
