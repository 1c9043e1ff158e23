from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.axis_circles.fit import find_runs, turn_of
from truearm.engine.data.circles import fit_circle
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth


def campaign(joints: Array) -> Dataset:
    rng = np.random.default_rng(0)
    return measure(truth_twin(load_robot("irb120"), "nominal", rng), joints, 0.0, rng)


def sweep(joint: int, degrees: Array, others: Array) -> Array:
    rows = np.tile(np.radians(others), (len(degrees), 1))
    rows[:, joint - 1] = np.radians(degrees)
    return rows


def test_runs_are_where_one_joint_alone_moves() -> None:
    home, ahead = np.zeros(6), np.array([10.0, -20, 30, 0, 20, 0])
    angles = np.arange(-60.0, 61.0, 15)
    both = np.concatenate([angles, angles[::-1]])
    rng = np.random.default_rng(1)
    flicker = np.radians(rng.uniform(-0.002, 0.002, (len(angles), 6)))
    wild = load_robot("irb120").random_configurations(5, rng)
    joints = np.concatenate([sweep(1, both, home), wild, sweep(5, angles, ahead) + flicker, sweep(5, angles[:3], home)])
    runs = find_runs(campaign(joints))
    assert [run.joint for run in runs] == [1, 5]
    assert runs[0].configurations.tolist() == list(range(18))
    assert runs[1].configurations.tolist() == list(range(23, 32))
    assert find_runs(campaign(load_robot("irb120").random_configurations(12, np.random.default_rng(2)))) == ()


def test_a_run_may_begin_where_another_ended() -> None:
    angles = np.arange(0.0, 50.0, 10)
    second = sweep(3, angles[1:], np.array([40.0, 0, 0, 0, 0, 0]))
    runs = find_runs(campaign(np.concatenate([sweep(1, angles, np.zeros(6)), second])))
    assert [(run.joint, run.configurations.tolist()) for run in runs] == [(1, [0, 1, 2, 3, 4]), (3, [4, 5, 6, 7, 8])]


def test_errors_and_backlash_of_more_than_a_turn_come_back() -> None:
    reading = np.radians(np.concatenate([np.arange(-400.0, 401, 10), np.arange(400.0, -401, -10)]))
    lag = np.radians(0.03) * np.repeat([-0.5, 0.5], len(reading) // 2)
    angle = reading + lag + np.radians(0.05) * np.sin(2 * reading)
    for sense in (1, -1):
        points = np.column_stack([0.2 * np.cos(angle), sense * 0.2 * np.sin(angle), np.full(len(angle), 0.1)])
        turn = turn_of(fit_circle(points), reading)
        assert_allclose(turn.circle.normal, [0, 0, sense], atol=1e-12)
        assert turn.backlash == pytest.approx(math.radians(0.03), abs=1e-9)
        assert turn.angular == pytest.approx(math.radians(0.13), rel=2e-2)
        assert turn.tangential == pytest.approx(0.2 * turn.angular)
    # a run one way shows none
    reading = np.radians(np.arange(0.0, 100, 10))
    points = np.column_stack([np.cos(reading), np.sin(reading), np.zeros(len(reading))])
    assert turn_of(fit_circle(points), reading).backlash is None


def test_a_lagging_joint_of_a_twin_is_seen() -> None:
    twin = truth_twin(load_robot("irb120"), "nominal", np.random.default_rng(0))
    lazy = Twin(replace(twin.robot), {4: JointTruth(hysteresis=-math.radians(0.037) / 2)})
    angles = np.arange(-150.0, 151.0, 10)
    joints = sweep(4, np.concatenate([angles, angles[::-1]]), np.zeros(6))
    data = measure(lazy, joints, 0.0, np.random.default_rng(0))
    (run,) = find_runs(data)
    turn = turn_of(fit_circle(data.position[data.target == 1]), joints[run.configurations, 3])
    assert turn.backlash == pytest.approx(math.radians(0.037), rel=1e-6)
