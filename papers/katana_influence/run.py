"""One seed of the study katana-influence: the Katana identified pose by pose and from all poses at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np

from papers import Progress
from papers.katana.pose_errors import Quantity, pose_errors, tip_poses, true_poses
from papers.katana.robot import (
    CHAPTER_5_CUBE,
    NAMES,
    NOISE,
    PERTURBATIONS,
    TIP,
    UNITS,
    deviations,
    katana,
    published,
    workspace_cube,
)
from papers.katana.tilting import TILTING, twin
from papers.seeds import Seed, over_seeds
from truearm.engine.data.dataset import Dataset
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.largest_cube import plan_poses
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.influences import (
    Combination,
    Influence,
    influence,
    influence_based,
    least_squares,
    minimum_norm,
)

#: The robots that are calibrated: geometry of Table 3.2 with joints that tilt, of Table 3.2 alone, of Table 3.3 alone.
Truth = Literal["tilting", "table 3.2", "table 3.3"]
TRUTHS: Final[tuple[Truth, ...]] = ("table 3.2", "table 3.3", "tilting")
OnePoseMethod = Literal["minimum norm", "influence"]
Method = Literal["nominal", OnePoseMethod, "least squares"]
ONE_POSE_METHODS: Final[tuple[OnePoseMethod, ...]] = ("minimum norm", "influence")
METHODS: Final[tuple[Method, ...]] = ("nominal", *ONE_POSE_METHODS, "least squares")
COMBINATIONS: Final[tuple[Combination, ...]] = ("mean", "scaled-mean", "best-pose")
AngleUnit = Literal["rad", "deg"]
#: Whose parameters the document prints, and which of our methods stand beside them: Tables 3.2 and 3.3.
PRINTED: Final[Mapping[tuple[Truth, Method], str]] = {
    ("table 3.2", "least squares"): "Table 3.2",
    ("table 3.2", "minimum norm"): "Table 3.2",
    ("table 3.3", "least squares"): "Table 3.3",
    ("table 3.3", "influence"): "Table 3.3",
}

_LENGTHS: Final = ("a_3", "a_4", "d_5", "target_tip_z")
_ANGLES: Final[Mapping[AngleUnit, float]] = {"rad": 1.0, "deg": math.radians(1.0)}


@dataclass(frozen=True, eq=False)
class Left:
    """What a method leaves of the errors of one robot."""

    poses: Mapping[Quantity, float]  #: Mean absolute errors at the poses that were used [mm, deg].
    unseen: float  #: Mean position error at unseen configurations [mm].


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed gives."""

    influence: Influence  #: influence, chapter_5: over the poses, and over poses in the cube of chapter 5.
    chapter_5: Influence
    left: Mapping[tuple[Truth, Method], Left]  #: By robot and method.
    #: Mean position error at unseen configurations [mm] on the robot of Table 3.2, by method and combination.
    combined: Mapping[tuple[OnePoseMethod, Combination], float]
    apart: float  #: Mean distance between the predictions of Tables 3.2 and 3.3 [mm].
    lengths: Mapping[AngleUnit, float]  #: Largest change of a length by minimum norm [mm], by the unit of angles.
    #: Deviations from nominal that a method finds of a robot of Table 3.2 or 3.3, by the document's names [deg, mm].
    identified: Mapping[tuple[Truth, Method], Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    cube: Cube  #: Where the poses are.
    bent: Influence  #: Influence at theta 4 = 80 deg and all others 0.
    outcomes: tuple[Outcome, ...]  #: Of the seeds.


def run(seeds: int, progress: Progress, count: int, unseen: int) -> Run:
    """Calibrate three twins by every method, once a seed.

    Args:
        seeds: How many: of the orientations at the poses, of the unseen configurations and of the noise.
        progress: Called with a few words at each step.
        count: Poses to calibrate with.
        unseen: Configurations to judge by.
    """
    progress("looking for the largest cube")
    cube = workspace_cube()
    bent = influence(katana(), np.radians([[0.0, 0.0, 0.0, 80.0, 0.0]]), NAMES, TIP, PERTURBATIONS)
    return Run(cube, bent, over_seeds(seeds, progress, partial(_one, cube=cube, count=count, unseen=unseen)))


def _one(seed: Seed, cube: Cube, count: int, unseen: int) -> Outcome:
    rng = seed.generator()
    nominal = katana()
    joints, central = (
        plan_poses(nominal, c, target=TIP, count=count, seed=seed.number).joints for c in (cube, CHAPTER_5_CUBE)
    )
    others = nominal.random_configurations(unseen, rng)
    truths: dict[Truth, Twin] = {  # in the order in which their noise is drawn
        "table 3.3": twin(published("influence"), {}),
        "tilting": twin(published("standard"), TILTING),
        "table 3.2": twin(published("standard"), {}),
    }
    left: dict[tuple[Truth, Method], Left] = {}
    identified: dict[tuple[Truth, Method], Mapping[str, float]] = {}
    for name, truth in truths.items():
        data = measure(truth, joints, NOISE, rng)
        true, elsewhere = true_poses(truth, joints), true_poses(truth, others)
        found: dict[Method, Robot] = {
            "nominal": nominal,
            "minimum norm": _pose_by_pose("minimum norm", nominal, data, "mean"),
            "influence": _pose_by_pose("influence", nominal, data, "mean"),
            "least squares": least_squares(nominal, data, NAMES, TIP),
        }
        for method, robot in found.items():
            errors = pose_errors(tip_poses(robot, joints), true)
            if (name, method) in PRINTED:
                identified[name, method] = deviations(robot.values)
            left[name, method] = Left(
                poses={quantity: float(values.mean()) for quantity, values in errors.items()},
                unseen=float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean()),
            )
    combined: dict[tuple[OnePoseMethod, Combination], float] = {}
    for one in ONE_POSE_METHODS:  # data and true poses are those of Table 3.2, the last truth
        for combination in COMBINATIONS:
            robot = _pose_by_pose(one, nominal, data, combination)
            combined[one, combination] = float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean())
    standard, other = (
        published("standard").world_poses(joints, TIP)[0],
        published("influence").world_poses(joints, TIP)[0],
    )
    return Outcome(
        influence=influence(nominal, joints, NAMES, TIP, PERTURBATIONS),
        chapter_5=influence(nominal, central, NAMES, TIP, PERTURBATIONS),
        left=left,
        combined=combined,
        apart=1e3 * float(np.linalg.norm(standard - other, axis=1).mean()),
        identified=identified,
        lengths={unit: _length_change(nominal, data, size) for unit, size in _ANGLES.items()},
    )


def _pose_by_pose(method: OnePoseMethod, nominal: Robot, data: Dataset, combination: Combination) -> Robot:
    if method == "minimum norm":
        return minimum_norm(nominal, data, NAMES, TIP, combination=combination, units=UNITS).robot
    return influence_based(
        nominal, data, NAMES, TIP, combination=combination, units=UNITS, perturbations=PERTURBATIONS
    ).robot


def _length_change(nominal: Robot, data: Dataset, angle: float) -> float:
    """Return the largest change of a length [mm] if angles are counted in `angle` [rad] and lengths in mm."""
    units = {name: angle * UNITS.get(name, 1.0) for name in NAMES if name not in _LENGTHS}
    found = minimum_norm(nominal, data, NAMES, TIP, units=units).robot
    return 1e3 * max(abs(found.values[name] - nominal.values[name]) for name in _LENGTHS)
