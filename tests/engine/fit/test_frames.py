from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.arms import ARMS
from tests.expecting import refusing
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import place
from truearm.engine.fit.frames import errors_of_placed, initial_frames, placed_errors
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation


def test_the_closed_form_finds_base_and_targets_of_a_nominal_robot() -> None:
    for name in ARMS:
        twin, data = campaign(name, 30, 0.0, 1, truth="nominal")
        placed = initial_frames(load_robot(name), data)
        np.testing.assert_allclose(placed.base.translation, twin.robot.base.translation, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(placed.base.rotation, twin.robot.base.rotation, atol=1e-9, err_msg=name)
        own = {target.parameter(axis) for target in placed.targets for axis in "xyz"}
        places = ({n: v for n, v in robot.values.items() if n in own} for robot in (placed, twin.robot))
        assert next(places) == pytest.approx(next(places), abs=1e-9), name


def test_it_needs_no_hand_given_frame_wherever_the_robot_stands() -> None:
    robot = load_robot("irb120")
    for seed in range(20):
        rng = np.random.default_rng(seed)
        q = rng.normal(size=4)
        w, x, y, z = (q / np.linalg.norm(q)).tolist()
        base = Transform((5 * rng.normal(), 5 * rng.normal(), rng.normal()), (w, x, y, z))
        moved = robot.with_frames(base, {"1": (0.1, -0.05, 0.12), "2": (0.0, 0.1, 0.2)})
        joints = robot.random_configurations(12, rng)
        position = np.stack([moved.world_poses(joints, t)[0] for t in ("1", "2")], axis=1)
        placed = initial_frames(robot, Dataset.of(joints, position, targets=("1", "2")))
        np.testing.assert_allclose(placed.base.translation, base.translation, atol=1e-8, err_msg=str(seed))
        np.testing.assert_allclose(placed.base.rotation, base.rotation, atol=1e-8, err_msg=str(seed))


def test_orientation_readings_place_an_arm_of_two_joints() -> None:
    robot = replace(load_robot("irb120"), joints=load_robot("irb120").joints[:2])
    target = Transform((0.1, 0.2, 0.3), (0.8, 0.0, 0.6, 0.0))
    truth = robot.with_frames(Transform((1.0, 2.0, 0.5), (0.5, -0.5, 0.5, 0.5)), {"t": target})
    q = robot.random_configurations(8, np.random.default_rng(0))
    position, R = truth.world_poses(q, "t")
    data = Dataset.of(q, position, targets=("t",), quaternions=quaternion_from_rotation(R))
    errors = errors_of(initial_frames(robot, data), data)
    assert errors.position_norms.max() < 1e-9
    assert errors.orientation_norms.max() < 1e-8


def test_a_calibrated_arm_is_placed_to_its_noise() -> None:
    _, data = campaign("ur5", 40, 1e-4, 3, truth="nominal")
    errors = errors_of(place(load_robot("ur5"), data), data)
    assert errors.position is not None
    assert errors.position.rms == pytest.approx(np.sqrt(3) * 1e-4, rel=0.15)


def test_data_without_positions_are_refused() -> None:
    _, data = campaign("irb120", 5, 0.0, 0)
    with refusing("twin: there is no position reading", "Fill in x, y and z"):
        initial_frames(load_robot("irb120"), replace(data, position=np.full_like(data.position, np.nan)))


def test_data_that_are_tried_together_are_placed_as_each_alone() -> None:
    robot = load_robot("irb120").with_frames(Transform(), {})
    tried = [campaign("irb120", poses, 1e-4, seed)[1] for seed, poses in enumerate((12, 40, 7))]
    together = placed_errors(robot, tried)
    for data, errors in zip(tried, together, strict=True):
        np.testing.assert_allclose(errors, placed_errors(robot, [data])[0], rtol=1e-9, atol=1e-12)
        placed = initial_frames(robot, data)
        at = np.array([placed.world_poses(data.postures, name)[0] for name in data.targets])
        off = np.linalg.norm(at[data.target, data.configuration] - data.position, axis=1)
        np.testing.assert_allclose(errors, off, atol=1e-9)
    assert placed_errors(robot, []) == []


def test_robots_that_are_placed_together_are_placed_as_each_alone() -> None:
    robots = [load_robot(name).with_frames(Transform(), {}) for name in ("irb120", "ur5", "puma560")]
    data = campaign("irb120", 12, 1e-4, 0)[1]
    for robot, errors in zip(robots, errors_of_placed(robots, data), strict=True):
        np.testing.assert_allclose(errors, placed_errors(robot, [data])[0], rtol=1e-9, atol=1e-9)
