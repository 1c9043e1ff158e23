"""Fake targets: what the nominal robot is told so that the calibrated one goes where it shall."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.engine.programs.reading import branches

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import InputError
from truearm.engine.programs.fake_targets import fake_targets, matrices, nominal_robot
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import Configuration
from truearm.engine.programs.resolved_configurations import resolved_configurations
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.importing.files import read_matrices


def worn(robot: Robot, seed: int = 1) -> Robot:
    """Return a robot with drawn errors and springy joints, where an instrument would see it."""
    rng = np.random.default_rng(seed)
    springy = robot.with_effects(["compliance"]).with_payload(Payload(2.0, (0.02, 0.0, 0.1)))
    drawn = {
        p.name: p.value + p.prior * float(rng.standard_normal())
        for p in springy.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    drawn |= {f"compliance_{i}": 2e-4 for i in range(2, 7)}
    return springy.with_values(drawn | {"base_x": 1.2, "base_y": -0.4, "base_rz": 0.03})


@pytest.mark.parametrize("name", ["irb120", "kr5", "lrmate200ic", "ur5"])
def test_the_calibrated_robot_goes_where_the_nominal_one_was_meant(name: str) -> None:
    nominal = load_robot(name)
    robot, rng = worn(nominal), np.random.default_rng(2)
    meant = nominal.random_configurations(120, rng) * 0.8
    wanted = matrices(nominal, meant)
    result = fake_targets(robot, wanted, meant)
    usable = np.array([status.usable for status in result.solutions.status])
    assert usable.mean() > 0.85  # some stretched arms do not reach as far
    # The controller, on its way from what is written to joints, and the real robot at these.
    written = matrices(nominal, result.joints)
    np.testing.assert_allclose(result.flange, written, atol=1e-12)
    position, rotation = robot.world_poses(result.joints)
    base = robot.base
    np.testing.assert_allclose(
        position[usable], (wanted[:, :3, 3] @ base.rotation.T + np.array(base.translation))[usable], atol=1e-9
    )
    turned = np.array(Rotation.from_matrix(np.swapaxes(rotation, 1, 2) @ base.rotation @ wanted[:, :3, :3]).magnitude())
    assert turned[usable].max() < 1e-8
    assert np.linalg.norm(result.flange[:, :3, 3] - wanted[:, :3, 3], axis=1)[usable].mean() > 5e-4


def test_answers_are_those_of_the_whole_search() -> None:
    """Of an arm whose axes tilt and move, near the poses of the nominal one."""
    robot = worn(load_robot("irb120"))
    robot = robot.with_effects(["compliance", "bearing-compliance", "run-out"]).with_values(robot.values)
    rng = np.random.default_rng(5)
    moved = {p.name: 3e-5 * rng.standard_normal() for p in robot.parameters.values() if p.group == "run-out"}
    robot = robot.with_values(moved | {f"bearing_compliance_{i}": 1e-5 for i in range(1, 7)})
    near = 0.8 * robot.random_configurations(300, rng)
    wanted = matrices(nominal_robot(robot), near)
    found = fake_targets(robot, wanted, near).solutions
    searched = inverse(robot, wanted[:, :3, 3], wanted[:, :3, :3], seed=near)
    both = found.usable & searched.usable
    assert both.mean() > 0.85  # some stretched arms do not reach as far
    np.testing.assert_allclose(found.joints[both], searched.joints[both], atol=1e-9)
    reached = [status is not PoseStatus.UNREACHABLE for status in searched.status]
    assert [status is not PoseStatus.UNREACHABLE for status in found.status] == reached


@pytest.fixture(scope="module", params=["elastic", "full"])
def irb120(measured_data: Path, request: pytest.FixtureRequest) -> Robot:
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")
    payload = Payload(2.7, (0.05, 0.025, 0.1))
    return calibrate("irb120", data, model=request.param, train=300, payload=payload).robot


#: Of the model that has every effect; of the one with some of them fewer, all of which then keep their branch.
TARGETS = {"full": 10_000, "elastic": 2000}


def test_ten_thousand_targets_of_the_measured_irb120(irb120: Robot, request: pytest.FixtureRequest) -> None:
    """Every target in the nominal robot's reach: forward of inverse, on the branch asked for or with a cause."""
    count = TARGETS[request.node.callspec.params["irb120"]]
    nominal, rng = nominal_robot(irb120), np.random.default_rng(0)
    base, flange = best_agreement(irb120)
    joints = irb120.random_configurations(count * 11 // 10, rng)
    wanted = np.linalg.inv(irb120.base.matrix) @ matrices(irb120, joints)
    asked = np.array(branches(nominal, joints))
    words = [Configuration(*name.split("-")) for name in asked.tolist()]
    unknown = np.full(joints.shape, np.nan)
    meant = resolved_configurations(nominal, np.linalg.inv(base) @ wanted @ flange, words, unknown, range(len(joints)))
    rows = np.flatnonzero(~np.isnan(meant.joints).any(axis=1))[:count]
    assert len(rows) == count
    result = fake_targets(irb120, wanted[rows], meant.joints[rows])
    reached = np.linalg.inv(irb120.base.matrix) @ matrices(irb120, result.joints)
    assert np.linalg.norm(reached[:, :3, 3] - wanted[rows, :3, 3], axis=1).max() < 1e-9
    turned = Rotation.from_matrix(np.swapaxes(reached[:, :3, :3], 1, 2) @ wanted[rows, :3, :3]).magnitude()
    assert turned.max() < 1e-8
    on_branch = np.array(branches(nominal, result.joints)) == asked[rows]
    assert on_branch.mean() >= 0.9999
    caused = {"beyond-limit", "branch-lost", "unreachable"}
    assert all(result.solutions.status[row].value in caused for row in np.flatnonzero(~on_branch))


def test_the_nominal_robot_is_the_table_however_often_it_was_calibrated() -> None:
    robot = worn(load_robot("irb120"))
    again = robot.with_parameters(p.restarted(p.value) for p in robot.known.values())
    for arm in (robot, again):
        nominal = nominal_robot(arm)
        assert nominal.values["a_3"] == 0.27
        assert nominal.base.translation == (0.0, 0.0, 0.0)


def test_a_robot_that_is_not_calibrated_is_refused() -> None:
    nominal = load_robot("irb120")
    for robot in (nominal, nominal.with_values({"base_x": 1.0})):
        with pytest.raises(InputError, match=r"this robot is not calibrated.*calibrated.yaml"):
            nominal_robot(robot)


def test_an_arm_of_seven_joints_stays_near_to_what_was_meant() -> None:
    six = load_robot("ur5")
    seventh = replace(six.joints[5], name="seventh", row={"theta_offset": 0.0, "d": 0.05, "a": 0.0, "alpha": 1.2})
    seven = replace(six, joints=(*six.joints, seventh), masses=(), truths={})
    robot = seven.with_values({"a_2": -0.4255, "theta_offset_3": 0.002, "d_6": 0.0825})
    meant = np.random.default_rng(3).uniform(-1.5, 1.5, (20, 7))
    wanted = matrices(seven, meant)
    result = fake_targets(robot, wanted, meant)
    assert np.abs(result.joints - meant).max() < 0.2
    np.testing.assert_allclose(matrices(robot, result.joints), wanted, atol=1e-8)
