"""One seed of the study katana-trajectory: a circle predicted, corrected and followed by a Katana in one posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal

import numpy as np

from papers import Progress
from papers.katana.circle import PENCIL, POINTS, RAMP, SPEED, motions, paths
from papers.katana.robot import CHAPTER_5_CUBE, NAMES, NOISE, TIP, katana, published
from papers.katana.tilting import TILTING, tilting_from_inclinometers, twin, with_tilting
from papers.seeds import Seed, over_seeds
from truearm.compensation.corrected_path import corrected, path_error
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.motion.joint_motion import JointMotion, joint_motion
from truearm.engine.motion.largest_cube import plan_poses
from truearm.engine.motion.paths import Circle, Trajectory, timed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.influences import least_squares

#: A tenfold speed, to see what motion does [m/s].
FAST: Final = 1.0
#: Samples of the circle that geometry is identified from.
SAMPLES: Final = 24
#: What chapter 5 identifies: it takes lengths as perfect (equation 5.11).
_ANGLES: Final = tuple(name for name in NAMES if name not in ("a_3", "a_4", "d_5", "target_tip_z"))

#: What an error comes from, all else being perfect.
Cause = Literal[
    "stiffness alone",
    "clearance alone",
    "backlash alone",
    "tilting",
    "tilting, full gap",
    "tilting and geometry of Table 3.2",
]
#: What is looked at in motion and at rest.
MOVING: Final[tuple[Cause, ...]] = ("stiffness alone", "tilting")
#: What a model knows, and what its geometry is identified from.
Model = Literal["geometric", "geometric and stiffness", "with tilting"]
Source = Literal["circle", "poses"]
MODELS: Final[tuple[Model, ...]] = ("geometric", "geometric and stiffness", "with tilting")
SOURCES: Final[tuple[Source, ...]] = ("circle", "poses")


@dataclass(frozen=True, eq=False)
class Corrected:
    """What the correction by one identified model is worth."""

    circle: Array  #: How far the twin that follows it is from the circle [mm], ``(n,)``.
    line: float  #: Its mean distance from the line [mm].
    at_poses: float  #: Mean error of the model at the poses [mm].


@dataclass(frozen=True, eq=False)
class Outcome:
    """One posture of the arm along the circle, and what came of it.

    Distances from the circle are ``(n,)``.
    """

    motion: JointMotion  #: What the nominal robot would have to do.
    distance: Array  #: Along the circle [mm], ``(n,)``.
    loads: Array  #: Force [N] and moment [N m] of the load at every joint, ``(joints, 6, n)``.
    loads_at_rest: Array  #: Likewise, without what motion adds.
    predicted: Mapping[Cause, Array]  #: Predicted distance from the circle by cause [mm].
    #: How far motion takes the tip from where it would be at rest, largest [mm], by cause and speed [m/s].
    moving: Mapping[tuple[Cause, float], float]
    before: Array  #: How far the twin was from the circle without correction [mm].
    before_at_poses: float  #: Mean error of the nominal robot at the poses [mm].
    perfect_geometry: Array  #: Likewise a twin that has no errors but tilting [mm].
    #: By what the model knows, and what its geometry was identified from.
    corrected: Mapping[tuple[Model, Source], Corrected]
    exact: Array  #: How far the twin was from the circle when corrected by its own geometry and tilting [mm].
    exact_seated: Array  #: Likewise a twin whose joint 1 has no backlash [mm].


def run(seeds: int, progress: Progress, step: float, poses: int) -> tuple[Outcome, ...]:
    """Draw a posture, plan the circle in it, calibrate a twin in three ways, correct, and let the twin follow.

    Args:
        seeds: How many: of the posture in which the arm follows the circle, of the noise, and of the postures for the
            inclinometers.
        progress: Called with a few words at each step.
        step: Time between samples [s].
        poses: How many geometry is identified from, besides the samples of the circle.
    """
    return over_seeds(seeds, progress, partial(_one, step=step, poses=poses))


def _one(seed: Seed, step: float, poses: int) -> Outcome:
    rng = seed.generator()
    nominal, truth = katana(PENCIL), twin(published("standard", PENCIL))
    circle, line = paths(step)
    motion, on_line = motions(nominal, circle, line, rng)

    causes = _causes()
    quick = timed(Circle.through(*POINTS), FAST, 40 * RAMP, step * SPEED / FAST)
    quickly = joint_motion(nominal, quick, target=TIP, seed=motion.joints[0])
    moving: dict[tuple[Cause, float], float] = {}
    for speed, at, path in ((SPEED, motion, circle), (FAST, quickly, quick)):
        for cause in MOVING:
            apart = [path_error(causes[cause], m, path.position, TIP) for m in (at, _at_rest(at))]
            moving[cause, speed] = float(_norms(apart[0] - apart[1]).max())

    data = _samples(truth, motion, rng)
    joints = plan_poses(nominal, CHAPTER_5_CUBE, target=TIP, count=poses, seed=seed.number).joints
    elsewhere = measure(truth, joints, NOISE, rng)
    fit = tilting_from_inclinometers(nominal, truth, rng)
    stiff = {name: value for name, value in fit.robot.values.items() if name.startswith("compliance")}
    starts: dict[Model, Robot] = {
        "geometric": nominal,
        "geometric and stiffness": with_tilting(nominal, stiff),
        "with tilting": fit.robot,
    }
    sources: dict[Source, tuple[Dataset, tuple[str, ...]]] = {"circle": (data, _ANGLES), "poses": (elsewhere, NAMES)}
    after: dict[tuple[Model, Source], Corrected] = {}
    for model, start in starts.items():
        for source, (positions, names) in sources.items():
            robot = least_squares(start, positions, names, TIP)
            after[model, source] = Corrected(
                circle=_corrected_and_followed(robot, truth, motion, circle),
                line=float(_corrected_and_followed(robot, truth, on_line, line).mean()),
                at_poses=_error(robot, elsewhere),
            )
    true = published("standard", PENCIL)
    seated = replace(truth, joints={**truth.joints, 1: replace(truth.joints[1], backlash=0.0)})
    without = {name: value for name, value in TILTING.items() if name != "backlash_1"}
    loads, loads_at_rest = (causes["tilting"].loaded(at.postures()).joint_loads for at in (motion, _at_rest(motion)))
    return Outcome(
        motion=motion,
        distance=circle.distance * 1e3,
        loads=loads,
        loads_at_rest=loads_at_rest,
        predicted={cause: _norms(path_error(robot, motion, circle.position, TIP)) for cause, robot in causes.items()},
        moving=moving,
        before=_followed(truth, motion.joints, motion, circle),
        before_at_poses=_error(nominal, elsewhere),
        perfect_geometry=_followed(twin(nominal), motion.joints, motion, circle),
        corrected=after,
        exact=_corrected_and_followed(with_tilting(true, TILTING), truth, motion, circle),
        exact_seated=_corrected_and_followed(with_tilting(true, without), seated, motion, circle),
    )


def _causes() -> Mapping[Cause, Robot]:
    """Return robots whose error has one cause each."""
    nominal = katana(PENCIL)

    def only(*effects: str, gap: float = 1.0) -> Robot:
        known = {n: v * (gap if n.startswith("backlash") else 1.0) for n, v in TILTING.items() if n.startswith(effects)}
        return with_tilting(nominal, known)

    return {
        "stiffness alone": only("compliance"),
        "clearance alone": only("clearance"),
        "backlash alone": only("backlash"),
        "tilting": only("compliance", "clearance", "backlash"),
        "tilting, full gap": only("compliance", "clearance", "backlash", gap=2.0),
        "tilting and geometry of Table 3.2": with_tilting(published("standard", PENCIL), TILTING),
    }


def _samples(truth: Twin, motion: JointMotion, rng: np.random.Generator) -> Dataset:
    """Return positions measured on the way, evenly along the circle."""
    at = np.linspace(0, len(motion.time), SAMPLES, endpoint=False).astype(int)
    return measure(
        truth, motion.joints[at], NOISE, rng, velocity=motion.velocity[at], acceleration=motion.acceleration[at]
    )


def _at_rest(motion: JointMotion) -> JointMotion:
    return replace(motion, velocity=0 * motion.velocity, acceleration=0 * motion.acceleration)


def _corrected_and_followed(model: Robot, truth: Twin, motion: JointMotion, path: Trajectory) -> Array:
    """Return how far a twin is from the path [mm], ``(n,)``, if a model corrects the joints of a motion."""
    return _followed(truth, corrected(model, motion, path.position, TIP).joints, motion, path)


def _followed(truth: Twin, joints: Array, motion: JointMotion, path: Trajectory) -> Array:
    """Return how far a twin that is commanded these joints in motion is from the path [mm], ``(n,)``."""
    went = truth.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    return _norms(np.array([posture.targets[TIP][:3, 3] for posture in went]) - path.position)


def _error(robot: Robot, data: Dataset) -> float:
    """Return the mean position error [mm]."""
    return 1e3 * float(errors_of(robot, data).position_norms.mean())


def _norms(errors: Array) -> Array:
    return np.asarray(1e3 * np.linalg.norm(errors, axis=1))
