"""A corrected path on a twin, which follows a computation of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.compensation.corrected_path import KNOWLEDGE, CorrectedPath, Knowledge, correct_path
from truearm.engine.base.errors import InputError
from truearm.engine.motion.path_file import PlannedPath, read_path
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

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
    found: dict[Knowledge, Array] = {}
    for name, joints in path.joints.items():
        went = twin.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
        at = np.array([posture.targets["1"][:3, 3] for posture in went])
        found[name] = 1e3 * np.linalg.norm(at - path.planned.trajectory.position, axis=1)
    return found


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


def test_inertia_counts_where_the_path_is_fast(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    path = correct_path(robot, planned(tmp_path, twin, 1000, 8000, 0.02), NEAR)
    error = true_errors(twin, path)
    assert error["deflection"].mean() > 0.2
    assert error["motion"].mean() < 0.1 * error["deflection"].mean()
    assert path.loads is not None
    at_rest = correct_path(robot, planned(tmp_path, twin, 20, 50, 0.5), NEAR).loads
    assert at_rest is not None
    assert np.ptp(path.loads[1, 5]) > 2.0 * np.ptp(at_rest[1, 5])


def test_loads_along_the_path_are_those_of_the_twin(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    twin, robot = measured
    path = correct_path(robot, planned(tmp_path, twin, 800, 5000, 0.05), NEAR)
    assert path.loads is not None
    motion = path.motion
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


def test_an_orientation_is_corrected_with_the_position(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    _, robot = measured
    file = tmp_path / "down.yaml"
    file.write_text(
        "truearm: truearm-path/1\nunits: {length: mm, angle: deg, time: s}\nframe: base\ntip: [0, 0, 100]\n"
        "orientation: {quaternion: [0, 1, 0, 0]}\nspeed: 200\nacceleration: 1000\nstep: 0.2\nstart: [350, 0, 250]\n"
        "sections:\n  - line: [350, 100, 250]\n"
    )
    path = correct_path(robot, read_path(file))
    position, rotation = robot.forward(path.motion.postures(path.joints["motion"]))
    tip = position + rotation @ [0.0, 0.0, 0.1]
    assert tip == pytest.approx(path.planned.trajectory.position, abs=2e-9)
    assert rotation == pytest.approx(np.broadcast_to(np.diag([1.0, -1.0, -1.0]), rotation.shape), abs=1e-7)


def test_the_nominal_frame_is_where_both_robots_agree_best(measured: tuple[Twin, Robot], tmp_path: Path) -> None:
    _, robot = measured
    file = tmp_path / "nominal.yaml"
    text = (
        "truearm: truearm-path/1\nunits: {length: mm, angle: deg, time: s}\nframe: FRAME\ntip: [0, 0, 100]\n"
        "speed: 200\nacceleration: 1000\nstep: 0.2\nstart: [350, 0, 350]\nsections:\n  - line: [350, 100, 350]\n"
    )
    errors = {}
    for frame in ("nominal", "base"):
        file.write_text(text.replace("FRAME", frame))
        path = correct_path(robot, read_path(file))
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
    slow = planned(tmp_path, twin, 500, 2000, 0.05, "joint_speeds: [30, 250, 250, 320, 320, 420]\n")
    with pytest.raises(
        InputError, match=r"section 3, .* mm along the path, at .* s .*faster than the file allows.*axis_1 at"
    ):
        correct_path(robot, slow, NEAR)
    few = planned(tmp_path, twin, 100, 500, 0.2, "joint_speeds: [30, 250]\n")
    with pytest.raises(InputError, match="not as many speeds as joints"):
        correct_path(robot, few, NEAR)
    far = replace(few, joint_speeds=None, trajectory=replace(few.trajectory, position=few.trajectory.position * 5.0))
    with pytest.raises(InputError, match="the motion cannot start"):
        correct_path(robot, far, NEAR)
    unknown = replace(few, joint_speeds=None, target="9")
    with pytest.raises(InputError, match="9"):
        correct_path(robot, unknown, NEAR)
