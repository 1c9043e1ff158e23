"""Intervals of fits contain the truth as often as they say, whatever the readings of a visit share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.curves import check_one_sided
from truearm.engine.diagnose.gain import repeatability
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot

BY_NAME = {model.name: model for model in MODELS}
GEOMETRIC = BY_NAME["geometric"]
SIGMA = 2e-5
TARGETS = {"a": (0.1, 0.0, 0.1), "b": (-0.1, 0.05, 0.1), "c": (0.0, -0.1, 0.15)}


def true_robot(rng: np.random.Generator) -> Robot:
    robot = load_robot("irb120").with_frames(load_robot("irb120").base, TARGETS)
    own = [p for p in robot.parameters.values() if p.group in GEOMETRIC.groups]
    return robot.with_values({p.name: p.nominal + p.prior * rng.standard_normal() for p in own})


def read(robot: Robot, q: Array, repeatability_deg: float, rng: np.random.Generator) -> Array:
    """Return what an instrument reads of all targets, ``(n, targets, 3)``, the joints a little off."""
    at = q + np.radians(repeatability_deg) * rng.standard_normal(q.shape)
    positions = np.stack([robot.world_poses(at, target.name)[0] for target in robot.targets], axis=1)
    return np.asarray(positions + SIGMA * rng.standard_normal(positions.shape))


def measured(robot: Robot, poses: int, repeatability_deg: float, rng: np.random.Generator) -> Dataset:
    q = robot.random_configurations(poses, rng)
    return Dataset.of(q, read(robot, q, repeatability_deg, rng), targets=[*TARGETS], sigma=SIGMA)


def inside(fit: Fit, robot: Robot) -> list[bool]:
    """Return which informed parameters are within 1.96 deviations of the truth, and coordinates of predictions."""
    own = [fit.robot.parameters[n] for n in fit.free.names if fit.robot.parameters[n].group in GEOMETRIC.groups]
    within = [
        abs(p.value - robot.values[p.name]) < 1.96 * p.deviation
        for p in own
        if p.deviation is not None and (p.informed or 0.0) > 0.5
    ]
    q = robot.random_configurations(10, np.random.default_rng(0))
    kinematics = fit.robot.forward_kinematics(q, "a")
    J = fit.robot.position_jacobian(kinematics, q, fit.free.names).reshape(len(fit.free.names), -1).T
    apart = kinematics.position.reshape(-1) - robot.forward_kinematics(q, "a").position.reshape(-1)
    deviation = np.sqrt(np.einsum("ij,jk,ik->i", J, fit.covariance, J))
    return [*within, *(np.abs(apart) < 1.96 * deviation).tolist()]


def with_outliers(data: Dataset, share: float, rng: np.random.Generator, one_sided: bool = False) -> Dataset:
    far = rng.standard_normal(data.position.shape)
    far *= rng.uniform(0.0, 5e-3, len(far))[:, None] / np.linalg.norm(far, axis=1, keepdims=True)
    far = np.abs(far) if one_sided else far
    return replace(data, position=data.position + np.where((rng.random(len(far)) < share)[:, None], far, 0.0))


@pytest.mark.parametrize("declared", [True, False])
def test_targets_of_a_configuration_share_the_error_of_its_joints(declared: bool) -> None:
    rng, within = np.random.default_rng(11), []
    errors = []
    for _ in range(12):
        robot = true_robot(rng)
        data = measured(robot, 40, 0.02, rng)
        fit = identify(load_robot("irb120"), data if declared else replace(data, sigma=None), GEOMETRIC)
        within += inside(fit, robot)
        errors.append(np.degrees(fit.joint_error).mean())
        assert fit.sigma["position"] == pytest.approx(SIGMA, rel=0.3)
        assert fit.excess == 1.0
        assert not fit.scattered
    assert np.mean(errors) == pytest.approx(0.02, rel=0.1)
    assert 0.91 < np.mean(within) < 0.99  # 0.79 where targets count as independent


@pytest.mark.parametrize("loss", ["huber", "cauchy", "l1"])
def test_intervals_hold_among_outliers_to_all_sides(loss: Loss) -> None:
    rng, within = np.random.default_rng(12), []
    for _ in range(8):
        robot = true_robot(rng)
        data = with_outliers(measured(robot, 40, 0.0, rng), 0.3, rng)
        fit = identify(load_robot("irb120"), data, GEOMETRIC, loss=loss)
        assert fit.scattered
        assert check_one_sided(fit, data) == []
        within += inside(fit, robot)
    assert 0.9 < np.mean(within) < 0.99


def test_outliers_to_one_side_are_told() -> None:
    rng = np.random.default_rng(13)
    data = with_outliers(measured(true_robot(rng), 40, 0.0, rng), 0.3, rng, one_sided=True)
    fit = identify(load_robot("irb120"), data, GEOMETRIC, loss="huber")
    (notice,) = check_one_sided(fit, data)
    assert notice.code == "outliers-one-sided"
    assert notice.level == "warning"
    assert "do not contain that bias" in notice.message


def test_without_a_loss_or_outliers_nothing_lies_to_one_side() -> None:
    rng = np.random.default_rng(14)
    data = measured(true_robot(rng), 30, 0.0, rng)
    for loss in ("linear", "huber"):
        assert check_one_sided(identify(load_robot("irb120"), data, GEOMETRIC, loss=loss), data) == []


def test_readings_that_share_nothing_are_weighed_one_by_one() -> None:
    rng = np.random.default_rng(15)
    fit = identify(load_robot("irb120"), measured(true_robot(rng), 40, 0.0, rng), GEOMETRIC)
    assert not fit.joint_error.any()
    assert not fit.scattered


def test_targets_read_on_separate_visits_share_no_error() -> None:
    """Each target has its own draw of the joints' errors: taken for one they would contradict each other."""
    rng = np.random.default_rng(16)
    robot = true_robot(rng)
    q = robot.random_configurations(40, rng)
    positions = np.stack([read(robot, q, 0.02, rng)[:, k] for k in range(3)], axis=1)
    apart = Dataset.of(q, positions, targets=[*TARGETS], sigma=SIGMA, visit=np.tile([1, 2, 3], (40, 1)))
    fit = identify(load_robot("irb120"), apart, GEOMETRIC)
    together = identify(load_robot("irb120"), replace(apart, visit=None), GEOMETRIC)
    assert np.degrees(fit.joint_error).max() == pytest.approx(0.02, rel=0.2)
    assert fit.excess == 1.0
    assert together.excess > 2.0


def test_dropped_parameters_leave_intervals_that_hold() -> None:
    rng, within = np.random.default_rng(17), []
    for _ in range(4):
        robot = true_robot(rng)
        fit = identify(load_robot("irb120"), measured(robot, 40, 0.02, rng), GEOMETRIC, redundancy="drop")
        q = robot.random_configurations(10, np.random.default_rng(0))
        kinematics = fit.robot.forward_kinematics(q, "a")
        J = fit.robot.position_jacobian(kinematics, q, fit.free.names).reshape(len(fit.free.names), -1).T
        apart = kinematics.position.reshape(-1) - robot.forward_kinematics(q, "a").position.reshape(-1)
        within += (np.abs(apart) < 1.96 * np.sqrt(np.einsum("ij,jk,ik->i", J, fit.covariance, J))).tolist()
        assert np.degrees(fit.joint_error).max() == pytest.approx(0.02, rel=0.2)
    assert np.mean(within) > 0.88


def test_what_errors_of_the_joints_do_not_explain_is_taken_from_the_scatter() -> None:
    """The arm bends and the model is rigid: taken for errors of the joints, that would lead the fit astray."""
    _, data = campaign("irb120", 60, SIGMA, 18, "tracker-triangular")
    fit = identify(load_robot("irb120"), data, BY_NAME["geometric"])
    assert fit.scattered
    assert fit.joint_error.any()
    assert fit.excess > 1.0


def test_postures_visited_again_tell_the_repeatability() -> None:
    rng = np.random.default_rng(19)
    robot = true_robot(rng)
    q = np.repeat(robot.random_configurations(8, rng), 30, axis=0)
    data = Dataset.of(q, read(robot, q, 0.01, rng), targets=[*TARGETS], sigma=SIGMA)
    estimate = repeatability(data, SIGMA)
    assert estimate is not None
    assert (estimate.postures, estimate.visits) == (8, 240)
    exact = np.array([robot.world_poses(q, name)[0] for name in TARGETS])
    off = np.radians(0.01) * np.random.default_rng(0).standard_normal(q.shape)
    lengths = np.linalg.norm(np.array([robot.world_poses(q + off, name)[0] for name in TARGETS]) - exact, axis=2)
    assert estimate.rp == pytest.approx(lengths.mean() + 3 * lengths.std(), rel=0.15)


def test_visits_of_one_configuration_tell_it_too_and_single_ones_do_not() -> None:
    rng = np.random.default_rng(20)
    robot = true_robot(rng)
    q = robot.random_configurations(30, rng)
    once = Dataset.of(q, read(robot, q, 0.01, rng), targets=[*TARGETS])
    assert repeatability(once, SIGMA) is None
    twice = replace(
        once,
        configuration=np.tile(once.configuration, 2),
        target=np.tile(once.target, 2),
        position=np.concatenate([once.position, read(robot, q, 0.01, rng).reshape(-1, 3)]),
        visit=np.repeat([1, 2], len(once.target)),
    )
    estimate = repeatability(twice, SIGMA)
    assert estimate is not None
    assert (estimate.postures, estimate.visits) == (30, 60)
    assert estimate.rp == pytest.approx(0.3e-3, rel=0.3)
