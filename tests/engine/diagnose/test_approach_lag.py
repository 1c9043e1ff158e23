"""Joints read before the robot settled: found in the measuring order, and said in the joints' own units."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign

from truearm import Dataset, calibrate, load_robot
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.diagnose.visits import check_approach_lag
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure


def late(true: Robot, data: Dataset, lag: float | Array) -> Dataset:
    """The readings of a robot whose joints stop short by a lag [rad or m], on the side from which they came."""
    rng = np.random.default_rng(4)
    moved = np.sign(np.diff(data.joints, axis=0, prepend=data.joints[:1]))
    position = np.stack([true.world_poses(data.joints + moved * lag, t)[0] for t in data.targets], axis=1).reshape(
        -1, 3
    )
    return replace(data, position=position + rng.normal(0.0, 0.05e-3, position.shape))


@pytest.fixture(scope="module")
def measured() -> Dataset:
    twin, data = campaign("ur5", 80, 0.05e-3, 4)
    return late(twin.robot, data, np.radians(0.01))


def fitted(robot: Robot, data: Dataset) -> Fit:
    return identify(robot, data, named_model("geometric"))


def test_rows_in_another_order_say_the_same(measured: Dataset) -> None:
    shuffled = measured.of_configurations(np.random.default_rng(0).permutation(measured.configurations))
    assert "joints-not-settled" in {n.code for n in calibrate("ur5", shuffled, model="geometric").warnings}
    fit = fitted(load_robot("ur5"), measured)
    assert check_approach_lag(LeftOver.of(fit, shuffled)) == check_approach_lag(LeftOver.of(fit, measured))


def test_without_numbers_nothing_is_said_of_visits(measured: Dataset) -> None:
    fit = fitted(load_robot("ur5"), measured)
    unnumbered = replace(measured, number=None, approach=None)
    assert check_approach_lag(LeftOver.of(fit, unnumbered)) == []
    assert check_approach_lag(LeftOver.of(fit, measured)) != []


ON_A_TRACK = """truearm: truearm-robot/1
name: on-a-track
title: An arm of three joints on a track
source: invented
units: {length: mm, angle: deg}
convention: hayati
joints:
  - {name: track, type: prismatic, d: 0, theta_offset: 0, a: 0, alpha: 90, limits: [0, 800]}
  - {name: joint_1, theta_offset: 0, d: 200, a: 0, alpha: 90, limits: [-120, 120]}
  - {name: joint_2, theta_offset: 0, d: 50, a: 220, alpha: 0, beta: 0, limits: [-30, 120]}
  - {name: joint_3, theta_offset: 0, d: 0, a: 230, alpha: 0, limits: [-140, 10]}
"""


def test_the_lag_of_a_sliding_joint_is_said_in_mm(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ON_A_TRACK)
    robot = load_robot(tmp_path / "robot.yaml")
    rng = np.random.default_rng(4)
    twin = truth_twin(robot, "random", rng)
    data = measure(twin, robot.random_configurations(80, rng), 0.05e-3, rng)
    data = late(twin.robot, data, np.array([0.2e-3, *np.radians([0.02] * 3)]))
    (notice,) = check_approach_lag(LeftOver.of(fitted(robot, data), data))
    lags = re.findall(r"([+-][0-9.]+) (deg|mm)", notice.message)
    assert [unit for _, unit in lags] == ["mm", "deg", "deg", "deg"]
    assert [abs(float(lag)) for lag, _ in lags] == pytest.approx([0.2, 0.02, 0.02, 0.02], rel=0.2)
