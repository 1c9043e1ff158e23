"""The ballbar on a sphere, and errors of poses, against closed forms and a twin."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from truearm.engine.base.errors import InputError
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
    found = sphere_test(arm, joints, read, "1")
    assert found.centre == pytest.approx(centre, abs=1e-11)
    assert found.largest < 1e-11


def test_figures_are_those_of_measured_minus_predicted_lengths(arm: Robot) -> None:
    joints = arm.random_configurations(3, np.random.default_rng(1))
    centre = np.zeros(3)
    added = np.array([0.1e-3, -0.3e-3, 0.5e-3])
    found = sphere_test(arm, joints, lengths(Twin(arm), joints, centre) + added, "1", centre)
    assert found.mean == pytest.approx(0.1e-3)
    assert found.deviation == pytest.approx(0.4e-3)
    assert found.largest == pytest.approx(0.5e-3)
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
    found = pose_errors(points, wanted, reached)
    assert found.orientation == pytest.approx(angles, abs=1e-12)
    assert found.position == pytest.approx(np.linalg.norm(shifts, axis=1), abs=1e-14)
    assert found.points == pytest.approx(np.linalg.norm(reached - wanted, axis=2))
    with pytest.raises(InputError, match="poses have different shapes"):
        pose_errors(points, wanted, reached[:4])


def test_repeatability_is_mean_and_three_deviations_of_the_distance() -> None:
    # distances from the middle are 1, 1, 2 and 2: mean 1.5, deviation sqrt(1/3)
    places = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0], [0, -2, 0]])
    assert repeatability(places + 7.0) == pytest.approx(1.5 + 3 * np.sqrt(1 / 3))
    with pytest.raises(InputError, match="two repetitions"):
        repeatability(places[:1])
