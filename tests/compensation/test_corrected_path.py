"""Corrected joint positions and corrected paths on a twin, which follows a computation of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.compensation.corrected_path import (
    KNOWLEDGE,
    CorrectedPath,
    Knowledge,
    correct_path,
    corrected,
    path_error,
)
from truearm.engine.base.errors import InputError
from truearm.engine.motion.joint_motion import JointMotion, joint_motion
from truearm.engine.motion.path_file import PlannedPath, read_path
from truearm.engine.motion.paths import Circle, Trajectory, timed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth

LOAD = "2.7kg,50mm,25mm,100mm"
NOMINAL = load_robot("irb120")
#: Over the table of an IRB 120, in its base frame [m].
POINTS = ((0.35, 0.0, 0.35), (0.35, 0.15, 0.35), (0.40, 0.20, 0.40), (0.35, 0.25, 0.35), (0.33, 0.1, 0.33))
NEAR = np.radians([0.0, 10.0, 0.0, 0.0, 40.0, 0.0])


@pytest.fixture(scope="module")
def measured() -> tuple[Twin, Robot]:
    """A twin with compliant joints, and what its calibration found."""
    rng = np.random.default_rng(1)
    twin = truth_twin(NOMINAL, "tracker-triangular", rng)
    twin = replace(twin, robot=twin.robot.with_payload(LOAD))
    data = measure(twin, NOMINAL.random_configurations(45, rng), 0.03e-3, rng)
    return twin, truearm.calibrate("irb120", data, model="elastic", payload=LOAD, train="all").robot


def planned(folder: Path, twin: Twin, speed: float, acceleration: float, step: float, more: str = "") -> PlannedPath:
    """A line, a circle and waypoints for target 1, in the instrument's frame, from the same point back to it."""
    base = twin.robot.base
    places = 1e3 * (np.array(POINTS) @ base.rotation.T + base.translation)
    start, along, other, third, way = ("[" + ", ".join(f"{v:.6f}" for v in at) + "]" for at in places)
    file = folder / "path.yaml"
    file.write_text(
        'truearm: truearm-path/1\nunits: {length: mm, angle: deg, time: s}\nframe: world\ntarget: "1"\n'
        f"speed: {speed}\nacceleration: {acceleration}\nstep: {step}\n{more}start: {start}\nsections:\n"
        f"  - line: {along}\n  - circle: [{other}, {third}]\n  - hermite: [{way}, {start}]\n"
    )
    return read_path(file)


def true_errors(twin: Twin, path: CorrectedPath) -> dict[Knowledge, Array]:
    """How far the twin is from the path in motion [mm], by what the correction knows."""
    motion = path.motion
    errors: dict[Knowledge, Array] = {}
    for name, joints in path.joints.items():
        went = twin.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
        at = np.array([posture.targets["1"][:3, 3] for posture in went])
        errors[name] = 1e3 * np.linalg.norm(at - path.planned.trajectory.position, axis=1)
    return errors


def test_the_twin_keeps_to_a_corrected_path(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    path = correct_path(robot, planned(tmp_path, twin, 100, 500, 0.1), NEAR)
    assert tuple(path.joints) == KNOWLEDGE
    error = {name: float(values.mean()) for name, values in true_errors(twin, path).items()}
    assert error["nothing"] > 1.5
    assert error["geometry"] < 0.7 * error["nothing"]
    assert error["deflection"] < 0.02 * error["geometry"]
    assert error["motion"] < 0.02
    for name in ("nothing", "geometry"):  # what the model predicts is what the twin does
        assert float(path.errors[name].mean()) * 1e3 == pytest.approx(error[name], abs=0.03)
    assert path.errors["motion"].max() < 2e-9


def test_inertia_counts_where_the_path_is_fast_and_loads_are_those_of_the_twin(
    measured: tuple[Twin, Robot], tmp_path: Path
) -> None:
    twin, robot = measured
    path = correct_path(robot, planned(tmp_path, twin, 1000, 8000, 0.02), NEAR)
    error, motion = true_errors(twin, path), path.motion
    assert error["deflection"].mean() > 0.2
    assert error["motion"].mean() < 0.1 * error["deflection"].mean()
    at_rest = correct_path(robot, planned(tmp_path, twin, 20, 50, 0.5), NEAR).loads
    assert path.loads is not None
    assert at_rest is not None
    assert np.ptp(path.loads[1, 5]) > 2.0 * np.ptp(at_rest[1, 5])
    went = twin.postures(path.joints["motion"], velocity=motion.velocity, acceleration=motion.acceleration)
    moments = np.array([[load[5] for load in posture.loads] for posture in went]).T
    assert path.loads[:, 5] == pytest.approx(moments, abs=0.05)


def test_a_force_at_the_tip_is_corrected_on_the_twin(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    pushed = Wrench((0.0, 0.0, -12.0), (0.0, 0.0, 0.0), "world")
    pushed_twin = replace(twin, robot=twin.robot.with_wrench(pushed, "1"))
    way = planned(tmp_path, twin, 100, 500, 0.2)
    blind, known = correct_path(robot, way, NEAR), correct_path(robot.with_wrench(pushed), way, NEAR)
    blind_error, error = (true_errors(pushed_twin, path)["motion"].mean() for path in (blind, known))
    assert blind_error > 0.1
    assert error < 0.2 * blind_error


def in_base(folder: Path, frame: str, height: int, more: str = "") -> PlannedPath:
    """A line for a tip 100 mm before the flange, in a frame of the robot's own."""
    file = folder / "line.yaml"
    file.write_text(
        f"truearm: truearm-path/1\nunits: {{length: mm, angle: deg, time: s}}\nframe: {frame}\ntip: [0, 0, 100]\n{more}"
        f"speed: 200\nacceleration: 1000\nstep: 0.2\nstart: [350, 0, {height}]\n"
        f"sections:\n  - line: [350, 100, {height}]\n"
    )
    return read_path(file)


def test_an_orientation_is_corrected_with_the_position(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    _, robot = measured
    path = correct_path(robot, in_base(tmp_path, "base", 250, "orientation: {quaternion: [0, 1, 0, 0]}\n"))
    position, rotation = robot.forward(path.motion.postures(path.joints["motion"]))
    tip = position + rotation @ [0.0, 0.0, 0.1]
    assert tip == pytest.approx(path.planned.trajectory.position, abs=2e-9)
    assert rotation == pytest.approx(np.broadcast_to(np.diag([1.0, -1.0, -1.0]), rotation.shape), abs=1e-7)


def test_the_nominal_frame_is_where_both_robots_agree_best(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    errors = {}
    for frame in ("nominal", "base"):
        path = correct_path(measured[1], in_base(tmp_path, frame, 350))
        errors[frame] = path.errors["nothing"].mean()
        assert path.errors["motion"].max() < 2e-9
        assert path.tips["motion"] == pytest.approx(path.planned.trajectory.position, abs=2e-9)
    assert errors["nominal"] < 0.6 * errors["base"]  # the base of the truth is shifted by what nobody can know


def test_a_nominal_robot_has_nothing_to_correct(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    nominal = NOMINAL.with_frames(robot.base, {"1": (0.0, 0.0, 0.125)})
    path = correct_path(nominal, planned(tmp_path, twin, 100, 500, 0.2), NEAR)
    assert not path.calibrated
    assert path.best == "nothing"
    assert path.errors["nothing"].max() < 1e-8


def test_what_the_robot_cannot_do_is_told_with_the_place(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    plain, unlimited = planned(tmp_path, twin, 100, 500, 0.2), "joint_speeds: [30, 250, 250, 320, 320, 420]\n"
    too_fast = r"section 3, .* mm along the path, at .* s .*faster than the file allows.*axis_1 at"
    far = replace(plain.trajectory, position=plain.trajectory.position * 5.0)
    for path, words in (
        (planned(tmp_path, twin, 500, 2000, 0.05, unlimited), too_fast),
        (planned(tmp_path, twin, 100, 500, 0.2, "joint_speeds: [30, 250]\n"), "not as many speeds as joints"),
        (replace(plain, trajectory=far), "the motion cannot start"),
        (replace(plain, target="9"), "9"),
    ):
        with pytest.raises(InputError, match=words):
            correct_path(robot, path, NEAR)


#: Tables 4.3 and 4.4 of the Katana thesis.
COMPLIANCE = [math.radians(1 / k) / 9.80665 for k in (122, 90, 75, 78, 80)]
CLEARANCE = np.radians([0.022, 0.024, 0.017, 0.015, 0.018])
BACKLASH = np.radians([0.063, 0.061, 0.057, 0.046, 0.051])


def katana() -> Robot:
    return load_robot("katana450").with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.13)})


def calibrated(*effects: str) -> Robot:
    """The Katana with the geometry of table 3.2 and some effects."""
    robot = katana()
    robot = robot.with_values(robot.truths["standard"].values).with_effects(effects)
    sizes: dict[str, Sequence[float]] = {
        "compliance": COMPLIANCE,
        "clearance": CLEARANCE.tolist(),
        "backlash": BACKLASH.tolist(),
    }
    return robot.with_values({f"{name}_{i}": v for name in effects for i, v in enumerate(sizes[name], 1)})


def on_the_twin(joints: Array, motion: JointMotion) -> Array:
    robot = katana()
    truths = {i: JointTruth(c, clearance=t) for i, (c, t) in enumerate(zip(COMPLIANCE, CLEARANCE, strict=True), 1)}
    twin = Twin(robot.with_values(robot.truths["standard"].values), truths)
    went = twin.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    return np.array([posture.targets["tip"][:3, 3] for posture in went])


def circle(speed: float = 0.2, step: float = 0.05) -> tuple[Trajectory, JointMotion]:
    """The circle of section 5.5.1."""
    points = np.array([[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893]]) * 1e-3
    path = timed(Circle.through(*points), speed, 4 * speed, step)
    return path, joint_motion(katana(), path, target="tip")


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
    # A perfect robot needs none, wherever its base stands.
    perfect = katana().with_frames(Transform((1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5)), {"tip": (0.0, 0.0, 0.13)})
    assert corrected(perfect, motion, path.position, "tip").rounds == 0


def test_the_first_step_is_the_least_change_that_corrects_and_is_subtracted() -> None:
    path, motion = circle()
    robot = katana().with_values({"theta_offset_2": 1e-6, "a_3": katana().values["a_3"] + 1e-6})
    error = path_error(robot, motion, path.position, "tip")
    least = np.stack(
        [-np.linalg.pinv(J[:3]) @ e for J, e in zip(robot.joint_jacobian(motion.joints, "tip"), error, strict=True)]
    )
    change = corrected(robot, motion, path.position, "tip").change
    assert change == pytest.approx(least, rel=1e-3, abs=1e-10)
    assert np.abs(change).max() > 1e-7


def test_backlash_is_corrected_where_its_sign_holds() -> None:
    path, motion = circle()
    correction = corrected(calibrated("backlash", "clearance", "compliance"), motion, path.position, "tip")
    assert np.median(correction.after) < 1e-9
    assert (correction.after <= correction.before).all()


def at(degrees: Sequence[float]) -> JointMotion:
    """A motion that stands at one posture."""
    q = np.radians(degrees)[None]
    return JointMotion(np.zeros(1), q, 0 * q, 0 * q, np.ones(1), tuple(j.name for j in katana().joints))


def stretched() -> object:
    robot = load_robot("li3")
    q = np.zeros((1, 3))
    motion = JointMotion(np.zeros(1), q, q, q, np.ones(1), tuple(j.name for j in robot.joints))
    return corrected(robot, motion, robot.world_poses(q)[0] + 1e-3)


def at_a_limit() -> object:
    robot = katana()
    motion = at([169.5, 40, 50, 30, 20])
    away = robot.with_values({"theta_offset_1": -1e-3})
    return corrected(away, motion, robot.world_poses(motion.joints, "tip")[0], "tip")


def test_what_cannot_be_corrected_is_refused() -> None:
    path, motion = circle(step=0.4)
    robot, position = katana(), path.position
    cases: dict[str, tuple[Callable[[], object], ...]] = {
        "at 0 s .sample 0.: the arm is in a singular posture": (stretched,),
        "axis_1: the correction takes a joint beyond its limits": (at_a_limit,),
        "by more than a calibration": (lambda: corrected(robot, motion, position + 0.2, "tip"),),
        "a position for every sample": (
            lambda: corrected(robot, motion, position[1:], "tip"),
            lambda: path_error(robot, motion, np.nan * position, "tip"),
        ),
        "no target of this name": (lambda: corrected(robot, motion, position, "gripper"),),
    }
    for words, calls in cases.items():
        for call in calls:
            with pytest.raises(InputError, match=words):
                call()
