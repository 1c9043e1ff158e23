"""One seed of the study katana-tilting: the Katana whose joints tilt, identified in one stage and in two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

from papers import Progress
from papers.katana.pose_errors import Quantity, pose_errors, tip_poses, true_poses
from papers.katana.robot import NAMES, NOISE, PERTURBATIONS, TIP, UNITS, katana, published, workspace_cube
from papers.katana.tilting import TILTING, tilting_from_inclinometers, twin, with_tilting
from papers.seeds import Seed, over_seeds
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.largest_cube import PosePlan, plan_poses
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import measure
from truearm.inclinometers.fit import TILTING as EFFECTS
from truearm.inclinometers.fit import TiltingFit
from truearm.simulation.influences import influence_based, least_squares, minimum_norm

_BASE: Final = tuple(f"base_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz"))

#: The methods of Tables 4.5 and 4.6, column by column, and ours: with the base free as well; everything at once from
#: the poses alone, and from poses and inclinometers; geometry with tilting known exactly; and two that identify pose by
#: pose after the first stage.
Column = Literal["nominal", "conventional", "two-stage"]
Method = Literal[Column, "base free", "at once", "at once, inclinometers", "tilting known", "minimum norm", "influence"]
COLUMNS: Final[tuple[Column, ...]] = ("nominal", "conventional", "two-stage")
METHODS: Final[tuple[Method, ...]] = (
    "nominal",
    "conventional",
    "base free",
    "two-stage",
    "at once, inclinometers",
    "at once",
    "tilting known",
    "minimum norm",
    "influence",
)


@dataclass(frozen=True, eq=False)
class Left:
    """What a method leaves: absolute errors [mm, deg], ``(n,)`` each."""

    poses: Mapping[Quantity, Array]  #: poses, unseen: at the poses that were used, and at unseen configurations.
    unseen: Mapping[Quantity, Array]

    @property
    def mean(self) -> float:
        """Mean position error at unseen configurations [mm]."""
        return float(self.unseen["dP"].mean())


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed gives."""

    plan: PosePlan  #: The poses.
    tilting: TiltingFit  #: What the first stage found.
    left: Mapping[Method, Left]  #: By method.

    def ratio(self, method: Method) -> float:
        """Return what a method leaves on unseen poses, of what the conventional calibration leaves [%]."""
        return 100 * (self.left[method].mean / self.left["conventional"].mean)


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    cube: Cube  #: Where the poses are.
    outcomes: tuple[Outcome, ...]  #: Of the seeds.


def run(seeds: int, progress: Progress, count: int, unseen: int) -> Run:
    """Calibrate a twin by every method, once a seed.

    Args:
        seeds: How many: of the orientations at the poses, of the postures for the inclinometers, of the unseen
            configurations and of the noise.
        progress: Called with a few words at each step.
        count: Poses to calibrate with.
        unseen: Configurations to judge by.
    """
    progress("looking for the largest cube")
    cube = workspace_cube()
    return Run(cube, over_seeds(seeds, progress, partial(_one, cube=cube, count=count, unseen=unseen)))


def _one(seed: Seed, cube: Cube, count: int, unseen: int) -> Outcome:
    rng = seed.generator()
    nominal, truth = katana(), twin(published("standard"))
    plan = plan_poses(nominal, cube, target=TIP, count=count, seed=seed.number)
    others = nominal.random_configurations(unseen, rng)
    data = measure(truth, plan.joints, NOISE, rng)
    fit = tilting_from_inclinometers(nominal, truth, rng)
    everything = (*NAMES, *fit.names)
    found: dict[Method, Robot] = {
        "nominal": nominal,
        "conventional": least_squares(nominal, data, NAMES, TIP),
        "base free": least_squares(nominal, data, (*NAMES, *_BASE), TIP),
        "two-stage": least_squares(fit.robot, data, NAMES, TIP),
        "at once": least_squares(nominal.with_effects(EFFECTS), data, everything, TIP),
        "at once, inclinometers": least_squares(fit.with_priors, data, everything, TIP),
        "tilting known": least_squares(with_tilting(nominal, TILTING), data, NAMES, TIP),
        "minimum norm": minimum_norm(fit.robot, data, NAMES, TIP, units=UNITS).robot,
        "influence": influence_based(fit.robot, data, NAMES, TIP, units=UNITS, perturbations=PERTURBATIONS).robot,
    }
    true, elsewhere = true_poses(truth, plan.joints), true_poses(truth, others)
    left = {
        method: Left(
            poses=pose_errors(tip_poses(robot, plan.joints), true),
            unseen=pose_errors(tip_poses(robot, others), elsewhere),
        )
        for method, robot in found.items()
    }
    return Outcome(plan, fit, left)
