"""The ballbar on a sphere, and errors of poses, against closed forms and a twin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin
from truearm.validation.pose_accuracy import pose_errors, repeatability
from truearm.validation.sphere import sphere_test


@pytest.fixture(scope="module")
def arm() -> Robot:
    robot = load_robot("irb120")
    return robot.with_frames(IDENTITY, robot.tools["triangular"].targets)


def lengths(twin: Twin, joints: Array, centre: Array) -> Array:
    return np.array([np.linalg.norm(twin.target_frames(q)["1"][:3, 3] - centre) for q in joints])


def test_a_model_that_is_the_twin_leaves_nothing_and_finds_the_centre(arm: Robot) -> None:
    joints = arm.random_configurations(40, np.random.default_rng(0))
    centre = np.array([0.3, 0.1, 0.2])
    read = lengths(Twin(arm), joints, centre)
    assert sphere_test(arm, joints, read, "1", centre).largest < 1e-12
    result = sphere_test(arm, joints, read, "1")
    assert result.centre == pytest.approx(centre, abs=1e-11)
    assert result.largest < 1e-11


def test_figures_are_those_of_measured_minus_predicted_lengths(arm: Robot) -> None:
    joints = arm.random_configurations(3, np.random.default_rng(1))
    centre = np.zeros(3)
    added = np.array([0.1e-3, -0.3e-3, 0.5e-3])
    result = sphere_test(arm, joints, lengths(Twin(arm), joints, centre) + added, "1", centre)
    assert result.mean == pytest.approx(0.1e-3)
    assert result.deviation == pytest.approx(0.4e-3)
    assert result.largest == pytest.approx(0.5e-3)
    missing = np.append(lengths(Twin(arm), joints, centre)[:2], np.nan)
    assert len(sphere_test(arm, joints, missing, "1", centre).errors) == 2


def test_a_centre_taught_too_high_makes_lengths_too_short_until_the_centre_is_fitted(arm: Robot) -> None:
    rng = np.random.default_rng(2)
    joints = arm.random_configurations(400, rng)
    centre = np.array([0.3, 0.0, 0.2])
    away = arm.world_poses(joints, "1")[0] - centre
    above = joints[away[:, 2] > 0.5 * np.linalg.norm(away, axis=1)]
    high = centre + np.array([0.0, 0.0, 0.2e-3])
    read = lengths(Twin(arm), above, centre)
    taught = sphere_test(arm, above, read, "1", high)
    cosine = (away / np.linalg.norm(away, axis=1)[:, None])[away[:, 2] > 0.5 * np.linalg.norm(away, axis=1), 2]
    assert taught.mean == pytest.approx(0.2e-3 * cosine.mean(), rel=1e-3)
    # the fitted centre leaves the least of all: what the wrong length of a link leaves is less than about the true one
    other = Twin(arm.with_values({"a_3": 0.2703}))
    read = lengths(other, above, centre)
    about = [sphere_test(arm, above, read, "1", at).errors for at in (centre, None)]
    assert about[1] @ about[1] < about[0] @ about[0]


def test_sphere_refusals(arm: Robot) -> None:
    joints = arm.random_configurations(6, np.random.default_rng(3))
    with pytest.raises(InputError, match=r"every configuration needs one length; got '\(5,\) for 6"):
        sphere_test(arm, joints, np.full(5, 0.3), "1", np.zeros(3))
    with pytest.raises(InputError, match=r"too few lengths within the range.*Calibrate the robot first"):
        sphere_test(arm, joints, np.full(6, np.nan), "1", np.zeros(3))
    with pytest.raises(InputError, match=r"too few lengths within the range.*allowed: 5 or more.*more points"):
        sphere_test(arm, joints[:4], np.full(4, 0.3), "1")
    plane = np.zeros((8, 6))
    plane[:, 0] = np.linspace(-1, 1, 8)  # joint 1 alone: the nest stays at one height
    with pytest.raises(InputError, match="the points lie in one plane"):
        sphere_test(arm, plane, np.full(8, 0.3), "1")


def read_by_bars(twin: Twin, joints: Array, centre: Array) -> Dataset:
    """Return lengths from two targets of the tool to a ball, at the first of which target 1 was taught there."""
    count = len(joints)
    rows = [(k, target) for k in range(count) for target in (0, 1) if k or not target]
    places = [twin.target_frames(q) for q in joints]
    lengths = [float(np.linalg.norm(places[k][str(target + 1)][:3, 3] - centre)) for k, target in rows]
    lengths[0] = np.nan  # no bar is as short as that
    lengths[7] = np.nan
    return Dataset(
        source="bars.csv",
        labels=("taught", *(str(k) for k in range(1, count))),
        joints=joints,
        joint_kinds=("revolute",) * 6,
        targets=("1", "2"),
        configuration=np.array([k for k, _ in rows]),
        target=np.array([target for _, target in rows]),
        position=np.full((len(rows), 3), np.nan),
        distance=np.array(lengths),
        fixtures=("ball",),
        fixture=np.zeros(len(rows), dtype=np.intp),
    )


def test_the_job_judges_each_target_about_the_ball_before_and_after_calibration(arm: Robot, tmp_path: Path) -> None:
    other = arm.with_values({"a_3": 0.2705, "theta_offset_2": arm.values["theta_offset_2"] + 1e-3})
    joints = arm.random_configurations(30, np.random.default_rng(5))
    centre = other.world_poses(joints[:1], "1")[0][0]
    data = read_by_bars(Twin(other), joints, centre)
    for taught in (None, "taught"):
        result = truearm.sphere(other, data, taught_at=taught, out=tmp_path / f"{taught}.html")
        counts = [(sphere.target, sphere.fixture, len(sphere.lengths), sphere.left_out) for sphere in result.spheres]
        assert counts == [("1", "ball", 28, 1 if taught else 2), ("2", "ball", 29, 0)]
        for one in result.spheres:
            assert one.after.largest < 1e-9
            assert one.after.centre == pytest.approx(centre, abs=1e-9)
            assert one.before is not None
            assert one.before.deviation > 0.1e-3
    lines = "\n".join(result.lines())
    assert "from the centre that was taught at configuration taught:" in lines
    for one, told in zip(result.spheres, result.summary()["spheres"], strict=True):
        assert one.before is not None
        lost = ", 1 beyond the range of the bar" if one.left_out else ""
        assert f"{one.target} about ball, {len(one.lengths)} readings{lost}\n  nominal     mean " in lines
        assert f"largest {1e3 * one.before.largest:.3f} mm\n  calibrated  mean" in lines
        assert told["nominal_mm"]["largest"] == pytest.approx(1e3 * one.before.largest)
        assert told["robot_mm"]["deviation"] == pytest.approx(1e3 * one.after.deviation)
    page = (tmp_path / "taught.html").read_text()
    for test in (result.spheres[0].before, result.spheres[1].before):
        assert test is not None
        for value in (test.mean, test.deviation, test.largest):
            assert f">{1e3 * value:.3f}</td>" in page
    alone = truearm.sphere(arm, data)
    assert all(sphere.before is None for sphere in alone.spheres)
    assert "  this robot  mean" in "\n".join(alone.lines())


def test_pose_errors_are_those_that_were_put_in() -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(0, 0.1, (3, 3))
    R = Rotation.random(5, random_state=1)
    p = rng.normal(0, 0.3, (5, 3))
    angles, shifts = rng.uniform(0.001, 0.01, 5), rng.normal(0, 1e-3, (5, 3))
    axes = rng.normal(size=(5, 3))
    turned = R * Rotation.from_rotvec(axes / np.linalg.norm(axes, axis=1)[:, None] * angles[:, None])
    wanted = np.einsum("nij,kj->nki", R.as_matrix(), points) + p[:, None]
    reached = np.einsum("nij,kj->nki", turned.as_matrix(), points) + (p + shifts)[:, None]
    result = pose_errors(points, wanted, reached)
    assert result.orientation == pytest.approx(angles, abs=1e-12)
    assert result.position == pytest.approx(np.linalg.norm(shifts, axis=1), abs=1e-14)
    assert result.points == pytest.approx(np.linalg.norm(reached - wanted, axis=2))
    with pytest.raises(InputError, match="poses have different shapes"):
        pose_errors(points, wanted, reached[:4])


def test_repeatability_is_mean_and_three_deviations_of_the_distance() -> None:
    # distances from the middle are 1, 1, 2 and 2: mean 1.5, deviation sqrt(1/3)
    places = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0], [0, -2, 0]])
    assert repeatability(places + 7.0) == pytest.approx(1.5 + 3 * np.sqrt(1 / 3))
    with pytest.raises(InputError, match="two repetitions"):
        repeatability(places[:1])
