"""Corrected joint positions on the twin, which follows a computation of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from truearm.compensation.corrected_path import corrected, path_error
from truearm.engine.base.errors import InputError
from truearm.engine.motion.joint_motion import JointMotion, joint_motion
from truearm.engine.motion.paths import Circle, Line, Trajectory, timed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth

#: Tables 4.3 and 4.4 of the Katana thesis.
COMPLIANCE = [math.radians(1 / k) / 9.80665 for k in (122, 90, 75, 78, 80)]
CLEARANCE = np.radians([0.022, 0.024, 0.017, 0.015, 0.018])
BACKLASH = np.radians([0.063, 0.061, 0.057, 0.046, 0.051])


def nominal() -> Robot:
    return load_robot("katana450").with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.13)})


def calibrated(*effects: str) -> Robot:
    """The Katana with the geometry of table 3.2 and some effects."""
    robot = nominal()
    robot = robot.with_values(robot.truths["standard"].values).with_effects(effects)
    sizes: dict[str, Sequence[float]] = {
        "compliance": COMPLIANCE,
        "clearance": CLEARANCE.tolist(),
        "backlash": BACKLASH.tolist(),
    }
    return robot.with_values({f"{name}_{i}": v for name in effects for i, v in enumerate(sizes[name], 1)})


def on_the_twin(joints: Array, motion: JointMotion) -> Array:
    robot = nominal()
    truths = {i: JointTruth(c, clearance=t) for i, (c, t) in enumerate(zip(COMPLIANCE, CLEARANCE, strict=True), 1)}
    twin = Twin(robot.with_values(robot.truths["standard"].values), truths)
    went = twin.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    return np.array([posture.targets["tip"][:3, 3] for posture in went])


def circle(speed: float = 0.2, step: float = 0.05) -> tuple[Trajectory, JointMotion]:
    """The circle of section 5.5.1."""
    points = np.array([[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893]]) * 1e-3
    path = timed(Circle.through(*points), speed, 4 * speed, step)
    return path, joint_motion(nominal(), path, target="tip")


def test_the_twin_keeps_to_the_circle_with_corrected_joints() -> None:
    path, motion = circle()
    robot = calibrated("compliance", "clearance")
    correction = corrected(robot, motion, path.position, "tip")
    before, after = (
        np.linalg.norm(on_the_twin(q, motion) - path.position, axis=1) for q in (motion.joints, correction.joints)
    )
    assert before.mean() > 0.4e-3
    assert correction.before == pytest.approx(before, abs=1e-7)
    assert correction.after.max() < 1e-9
    assert after.max() < 2e-7
    assert correction.joints == pytest.approx(motion.joints + correction.change)
    assert 0 < correction.rounds < 8


def test_the_first_step_is_the_least_change_that_corrects_and_is_subtracted() -> None:
    path, motion = circle()
    robot = nominal().with_values({"theta_offset_2": 1e-6, "a_3": nominal().values["a_3"] + 1e-6})
    error = path_error(robot, motion, path.position, "tip")
    least = np.stack(
        [-np.linalg.pinv(J[:3]) @ e for J, e in zip(robot.joint_jacobian(motion.joints, "tip"), error, strict=True)]
    )
    change = corrected(robot, motion, path.position, "tip").change
    assert change == pytest.approx(least, rel=1e-3, abs=1e-10)
    assert np.abs(change).max() > 1e-7


def test_what_moments_in_motion_do_is_corrected_too() -> None:
    robot = calibrated("compliance")
    errors = []
    for speed in (0.02, 1.0):
        path, motion = circle(speed, step=0.1 / speed / 20)
        correction = corrected(robot, motion, path.position, "tip")
        assert correction.after.max() < 1e-9
        still = replace(motion, velocity=0 * motion.velocity, acceleration=0 * motion.acceleration)
        moved = path_error(robot, motion, path.position, "tip") - path_error(robot, still, path.position, "tip")
        errors.append(float(np.abs(moved).max()))
    assert errors[0] < 5e-7
    assert errors[1] > 20 * errors[0]


def test_backlash_is_corrected_where_its_sign_holds() -> None:
    path, motion = circle()
    correction = corrected(calibrated("backlash", "clearance", "compliance"), motion, path.position, "tip")
    assert np.median(correction.after) < 1e-9
    assert (correction.after <= correction.before).all()


def test_the_base_of_each_robot_is_its_own() -> None:
    path, motion = circle()
    moved = calibrated().with_frames(Transform((1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5)), {"tip": (0.0, 0.0, 0.13)})
    here, there = (corrected(robot, motion, path.position, "tip") for robot in (calibrated(), moved))
    assert there.joints == pytest.approx(here.joints, abs=1e-9)


def test_a_perfect_robot_needs_no_correction() -> None:
    path, motion = circle()
    correction = corrected(nominal(), motion, path.position, "tip")
    assert correction.rounds == 0
    assert (correction.joints == motion.joints).all()


# -- refusals ---------------------------------------------------------------------------------------------

PATH, MOTION = circle(step=0.4)


def at(degrees: Any) -> JointMotion:
    """A motion that stands at one posture."""
    q = np.radians(degrees)[None]
    return JointMotion(np.zeros(1), q, 0 * q, 0 * q, np.ones(1), tuple(j.name for j in nominal().joints))


def stretched() -> object:
    robot = load_robot("li3")
    q = np.zeros((1, 3))
    motion = JointMotion(np.zeros(1), q, q, q, np.ones(1), tuple(j.name for j in robot.joints))
    return corrected(robot, motion, robot.world_poses(q)[0] + 1e-3)


def at_a_limit() -> object:
    robot = nominal()
    motion = at([169.5, 40, 50, 30, 20])
    away = robot.with_values({"theta_offset_1": -1e-3})
    return corrected(away, motion, robot.world_poses(motion.joints, "tip")[0], "tip")


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("at 0 s .sample 0.: the arm is in a singular posture", stretched),
        ("axis_1: the correction takes a joint beyond its limits", at_a_limit),
        ("by more than a calibration", lambda: corrected(nominal(), MOTION, PATH.position + 0.2, "tip")),
        ("a position for every sample", lambda: corrected(nominal(), MOTION, PATH.position[1:], "tip")),
        ("a position for every sample", lambda: path_error(nominal(), MOTION, np.nan * PATH.position, "tip")),
        ("no target of this name", lambda: corrected(nominal(), MOTION, PATH.position, "gripper")),
    ],
)
def test_refusals(words: str, make: Callable[[], object]) -> None:
    with pytest.raises(InputError, match=words):
        make()


def test_a_line_of_another_arm_is_corrected() -> None:
    robot = load_robot("irb120")
    path = timed(Line((0.35, -0.2, 0.3), (0.35, 0.2, 0.5)), 0.2, 1.0, 0.02)
    motion = joint_motion(robot, path)
    real = robot.with_values({n: v + 5e-4 for n, v in robot.values.items() if n.startswith(("d_", "a_", "theta"))})
    correction = corrected(real, motion, path.position)
    assert correction.before.min() > 1e-4
    assert correction.after.max() < 1e-9
    assert np.abs(real.world_poses(correction.joints)[0] - path.position).max() < 1e-9
