"""The Katana on the circle of Patel's chapter 5: predicted, calibrated, corrected and followed by the twin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.compensation.trajectories import corrected, path_error
from truearm.identification.solving.pose_by_pose import least_squares
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.paths.joint_motion import JointMotion, joint_motion
from truearm.planning.paths.paths import Circle
from truearm.planning.paths.time_law import timed
from truearm.planning.paths.trajectory import Trajectory
from truearm.planning.poses.pose_plan import plan_poses
from truearm.simulation.twin import Twin, measure
from truearm.studies.katana import (
    CHAPTER_5_CUBE,
    NAMES,
    NOISE,
    TILTING,
    TIP,
    inclined,
    katana,
    knowing,
    published,
    twin,
)

#: The pencil's tip is this far beyond the attachment (Table 5.1) [m].
PENCIL: Final = 0.130
#: Points of section 5.5.1 in the base frame, from the one on the positive x axis upwards [m].
_POINTS: Final = np.array([[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893]]) * 1e-3
#: The line is the diameter between the circle's highest and lowest point [m].
_LINE: Final = np.array([[0, -370.7107, 210], [0, -229.2893, 68.5786]]) * 1e-3
#: Speed, and acceleration on the ramps, of the time law [m/s], [m/s^2]: ours, the document prints none.
SPEED: Final = 0.1
_RAMP: Final = 0.4
FAST: Final = 1.0
#: Samples of the circle that geometry is identified from.
SAMPLES: Final = 24
#: The arm keeps this far from singular postures (singular value of its Jacobian, reach lengths).
_REGULAR: Final = 0.1
#: What chapter 5 identifies: it takes lengths as perfect (equation 5.11).
_ANGLES: Final = tuple(name for name in NAMES if name not in ("a_3", "a_4", "d_5", "target_tip_z"))

MODELS: Final = ("geometric", "geometric and stiffness", "with tilting")
#: What geometry is identified from.
SOURCES: Final = ("circle", "poses")


@dataclass(frozen=True, eq=False)
class CircleRun:
    """One posture of the arm along the circle, and what came of it.

    Attributes
    ----------
    motion
        What the nominal robot would have to do.
    distance
        Along the circle [mm], ``(n,)``.
    loads
        Force [N] and moment [N m] of the load at every joint, ``(joints, 6, n)``; and at rest.
    predicted
        Predicted distance from the path by cause [mm], ``(n,)`` each.
    moving
        How far motion takes the tip from where it would be at rest, largest [mm], by cause and speed [m/s].
    followed
        How far the twin was from the circle [mm], ``(n,)``: ``before`` and after the correction by each model
        identified from each source, ``(model, source)``.
    line
        Likewise its mean distance from the line [mm].
    elsewhere
        Mean error of the nominal robot and of the same models at the poses [mm].
    """

    motion: JointMotion
    distance: Array
    loads: Array
    loads_still: Array
    predicted: Mapping[str, Array]
    moving: Mapping[tuple[str, float], float]
    followed: Mapping[tuple[str, str], Array]
    line: Mapping[tuple[str, str], float]
    elsewhere: Mapping[tuple[str, str], float]


def run_circle(seed: int, step: float, poses: int) -> CircleRun:
    """Draw a posture, plan the circle in it, calibrate a twin in three ways, correct, and let the twin follow.

    Parameters
    ----------
    step
        Time between samples [s].
    poses
        How many geometry is identified from, besides the samples of the circle.
    """
    rng = np.random.default_rng(seed)
    nominal, truth = katana(PENCIL), twin(published("standard", PENCIL))
    circle, line = paths(step)
    motion, on_line = motions(nominal, circle, line, rng)

    causes = _causes()
    quick = timed(Circle.through(*_POINTS), FAST, 40 * _RAMP, step * SPEED / FAST)
    quickly = joint_motion(nominal, quick, target=TIP, seed=motion.joints[0])
    moving = {}
    for speed, at, path in ((SPEED, motion, circle), (FAST, quickly, quick)):
        for cause in ("stiffness alone", "tilting"):
            apart = [path_error(causes[cause], m, path.position, TIP) for m in (at, _at_rest(at))]
            moving[cause, speed] = float(_norms(apart[0] - apart[1]).max())

    data = _samples(truth, motion, rng)
    joints = plan_poses(nominal, CHAPTER_5_CUBE, target=TIP, count=poses, seed=seed).joints
    elsewhere = measure(truth, joints, NOISE, rng)
    fit = inclined(nominal, truth, rng)
    stiff = {name: value for name, value in fit.robot.values.items() if name.startswith("compliance")}
    starts = dict(zip(MODELS, (nominal, knowing(nominal, stiff), fit.robot), strict=True))
    followed = {
        ("before", ""): _follow(truth, motion.joints, motion, circle),
        ("before, geometry perfect", ""): _follow(twin(nominal), motion.joints, motion, circle),
    }
    straight = {("before", ""): float(_follow(truth, on_line.joints, on_line, line).mean())}
    errors = {("before", "circle"): _error(nominal, elsewhere)}
    seated = replace(truth, joints={**truth.joints, 1: replace(truth.joints[1], backlash=0.0)})
    for model, start in starts.items():
        for source, readings, names in (("circle", data, _ANGLES), ("poses", elsewhere, NAMES)):
            robot = least_squares(start, readings, names, TIP)
            errors[model, source] = _error(robot, elsewhere)
            commanded = corrected(robot, motion, circle.position, TIP).joints
            followed[model, source] = _follow(truth, commanded, motion, circle)
            commanded = corrected(robot, on_line, line.position, TIP).joints
            straight[model, source] = float(_follow(truth, commanded, on_line, line).mean())
    for what, real, known in (
        ("told", truth, TILTING),
        ("told, joint 1 without backlash", seated, {n: v for n, v in TILTING.items() if n != "backlash_1"}),
    ):
        told = knowing(published("standard", PENCIL), known)
        commanded = corrected(told, motion, circle.position, TIP).joints
        followed[what, ""] = _follow(real, commanded, motion, circle)

    loads, loads_still = (causes["tilting"].loaded(at.postures()).joint_loads for at in (motion, _at_rest(motion)))
    return CircleRun(
        motion=motion,
        distance=circle.distance * 1e3,
        loads=loads,
        loads_still=loads_still,
        predicted={cause: _norms(path_error(robot, motion, circle.position, TIP)) for cause, robot in causes.items()},
        moving=moving,
        followed=followed,
        line=straight,
        elsewhere=errors,
    )


def _causes() -> Mapping[str, Robot]:
    """Return robots whose error has one cause each."""
    nominal = katana(PENCIL)

    def only(*effects: str, gap: float = 1.0) -> Robot:
        known = {n: v * (gap if n.startswith("backlash") else 1.0) for n, v in TILTING.items() if n.startswith(effects)}
        return knowing(nominal, known)

    return {
        "stiffness alone": only("compliance"),
        "clearance alone": only("clearance"),
        "backlash alone": only("backlash"),
        "tilting": only("compliance", "clearance", "backlash"),
        "tilting, full gap": only("compliance", "clearance", "backlash", gap=2.0),
        "tilting and geometry of Table 3.2": knowing(published("standard", PENCIL), TILTING),
    }


def _samples(truth: Twin, motion: JointMotion, rng: np.random.Generator) -> Dataset:
    """Return positions read on the way, evenly along the circle."""
    at = np.linspace(0, len(motion.time), SAMPLES, endpoint=False).astype(int)
    return measure(
        truth, motion.joints[at], NOISE, rng, velocity=motion.velocity[at], acceleration=motion.acceleration[at]
    )


def _at_rest(motion: JointMotion) -> JointMotion:
    return replace(motion, velocity=0 * motion.velocity, acceleration=0 * motion.acceleration)


def _follow(truth: Twin, joints: Array, motion: JointMotion, path: Trajectory) -> Array:
    """Return how far a twin that is commanded these readings in motion is from the path [mm], ``(n,)``."""
    went = truth.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    return _norms(np.array([posture.targets[TIP][:3, 3] for posture in went]) - path.position)


def _error(robot: Robot, data: Dataset) -> float:
    """Return the mean position error [mm]."""
    return 1e3 * float(errors_of(robot, data).position_norms.mean())


def _norms(errors: Array) -> Array:
    return np.asarray(1e3 * np.linalg.norm(errors, axis=1))
