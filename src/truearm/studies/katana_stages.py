"""The Katana whose joints tilt identified in one stage and in two, for the study katana-tilting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.inclinometers.fit import TILTING as EFFECTS
from truearm.identification.inclinometers.fit import TiltingFit
from truearm.identification.solving.pose_by_pose import influence_based, least_squares, minimum_norm
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.poses.iso9283 import Cube
from truearm.planning.poses.pose_plan import PosePlan, plan_poses
from truearm.simulation.twin import measure
from truearm.studies.katana import (
    NAMES,
    NOISE,
    PERTURBATIONS,
    TILTING,
    TIP,
    UNITS,
    inclined,
    katana,
    knowing,
    pose_errors,
    published,
    tip_poses,
    true_poses,
    twin,
)

_BASE: Final = tuple(f"base_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz"))

NOMINAL, CONVENTIONAL, TWO_STAGE = "before", "conventional, geometry alone", "two-stage, tilting first"
FREE_BASE, AT_ONCE, TOGETHER, TOLD, NORM, INFLUENCE = (
    "conventional, base free as well",
    "all at once, from the poses alone",
    "all at once, from poses and inclinometers",
    "tilting told exactly, then geometry",
    "tilting first, then minimum norm pose by pose",
    "tilting first, then influence-based pose by pose",
)
COLUMNS: Final = (NOMINAL, CONVENTIONAL, TWO_STAGE)


@dataclass(frozen=True, eq=False)
class TiltingRun:
    """What one seed gives.

    Attributes
    ----------
    plan
        The poses.
    tilting
        What the first stage found.
    poses, unseen
        Absolute errors at the poses and at unseen configurations [mm, deg], by method and quantity, ``(n,)`` each.
    """

    plan: PosePlan
    tilting: TiltingFit
    poses: Mapping[str, Mapping[str, Array]]
    unseen: Mapping[str, Mapping[str, Array]]

    def ratio(self, method: str) -> float:
        """Return what a method leaves on unseen poses, of what the conventional calibration leaves [%]."""
        return 100 * float(self.unseen[method]["dP"].mean() / self.unseen[CONVENTIONAL]["dP"].mean())


def run_tilting(seed: int, cube: Cube, count: int, unseen: int) -> TiltingRun:
    """Calibrate a twin from `count` poses in a cube by every method, and judge there and at `unseen` configurations."""
    rng = np.random.default_rng(seed)
    nominal, truth = katana(), twin(published("standard"))
    plan = plan_poses(nominal, cube, target=TIP, count=count, seed=seed)
    others = nominal.random_configurations(unseen, rng)
    data = measure(truth, plan.joints, NOISE, rng)
    fit = inclined(nominal, truth, rng)
    everything = (*NAMES, *fit.names)
    found: dict[str, Robot] = {
        NOMINAL: nominal,
        CONVENTIONAL: least_squares(nominal, data, NAMES, TIP),
        FREE_BASE: least_squares(nominal, data, (*NAMES, *_BASE), TIP),
        TWO_STAGE: least_squares(fit.robot, data, NAMES, TIP),
        AT_ONCE: least_squares(nominal.with_effects(EFFECTS), data, everything, TIP),
        TOGETHER: least_squares(fit.believed, data, everything, TIP),
        TOLD: least_squares(knowing(nominal, TILTING), data, NAMES, TIP),
        NORM: minimum_norm(fit.robot, data, NAMES, TIP, units=UNITS).robot,
        INFLUENCE: influence_based(fit.robot, data, NAMES, TIP, units=UNITS, perturbations=PERTURBATIONS).robot,
    }
    true, elsewhere = true_poses(truth, plan.joints), true_poses(truth, others)
    return TiltingRun(
        plan,
        fit,
        {method: pose_errors(tip_poses(robot, plan.joints), true) for method, robot in found.items()},
        {method: pose_errors(tip_poses(robot, others), elsewhere) for method, robot in found.items()},
    )
