"""Nominal values that are not this robot's are doubted, also where many parameters share what they are off."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.jobs.calibrate import calibrate
from truearm.library import load_robot
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.simulation.truths import truth_twin
from truearm.simulation.twin import measure

#: Of the UR10e, by the table of its maker [m].
UR10E = {"d_1": 0.1807, "a_2": -0.6127, "a_3": -0.57155, "d_4": 0.17415, "d_5": 0.11985, "d_6": 0.11655}


def successor(robot: Robot) -> Robot:
    """Return the UR10e, in the model of the UR10."""
    return robot.with_parameters([replace(robot.parameters[n], nominal=v, value=v) for n, v in UR10E.items()])


def doubts(robot: Robot, truth: Robot, seed: int) -> list[Notice]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(truth, "random", rng)
    data = measure(twin, robot.random_configurations(40, rng), 5e-5, rng)
    return [n for n in calibrate(robot, data, model="geometric").warnings if n.code == "far-from-nominal"]


@pytest.mark.parametrize("seed", range(2))
def test_the_file_of_another_size_is_doubted_although_no_parameter_moved_far(seed: int) -> None:
    robot = load_robot("ur10")
    (notice,) = doubts(robot, successor(robot), seed)
    assert notice.level == "warning"
    assert notice.message.startswith("d_2, d_3, d_4 moved together by more than 4.5 standard deviations")
    assert "nominal values are those of its controller" in notice.message
    assert doubts(successor(robot), successor(robot), seed) == []


@pytest.mark.parametrize("robot", ["irb120", "ur10", "kr5", "katana450", "li3"])
@pytest.mark.parametrize(("poses", "redundancy"), [(12, "prior"), (30, "drop")])
def test_honest_robots_are_not_doubted(robot: str, poses: int, redundancy: Literal["prior", "drop"]) -> None:
    data = campaign(robot, poses, 5e-5, 5)[1]
    found = calibrate(robot, data, model="geometric", redundancy=redundancy).warnings
    assert "far-from-nominal" not in {notice.code for notice in found}


def test_a_parameter_that_moves_for_held_ones_is_not_doubted() -> None:
    data = campaign("ur5", 40, 1e-4, 54)[1]
    run = calibrate("ur5", data, model="geometric", redundancy="drop")
    assert any(name.combination for name in run.fit.redundancies)
    assert "far-from-nominal" not in {notice.code for notice in run.warnings}
