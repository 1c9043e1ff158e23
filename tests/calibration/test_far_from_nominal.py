"""Angles and joint zeros that are far from nominal are noted; lengths are judged apart, by what the data determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.rounds import Redundant


def noted(robot: str, data: Dataset, redundancy: Redundant = "prior") -> list[Notice]:
    run = calibrate(robot, data, model="geometric", redundancy=redundancy)
    return [notice for notice in run.warnings if notice.code == "far-from-nominal"]


@pytest.mark.parametrize("robot", ["irb120", "ur10", "kr5", "katana450", "li3"])
@pytest.mark.parametrize(("poses", "redundancy"), [(12, "prior"), (30, "drop")])
def test_honest_robots_are_not_doubted(robot: str, poses: int, redundancy: Redundant) -> None:
    assert noted(robot, campaign(robot, poses, 5e-5, 5)[1], redundancy) == []


def test_a_joint_that_was_mastered_badly_is_noted() -> None:
    data = campaign("irb120", 30, 5e-5, 5)[1]
    off = np.radians([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    (notice,) = noted("irb120", replace(data, joints=data.joints + off))
    assert notice.level == "note"
    assert notice.message.startswith("theta_offset_3 moved by more than 6 standard deviations of its prior.")
    assert "nominal values are those of its controller" in notice.message


def test_nothing_is_noted_of_angles_where_the_robot_is_another_one() -> None:
    codes = {notice.code for notice in calibrate("irb120", campaign("irb1600", 30, 5e-5, 5)[1]).warnings}
    assert "wrong-robot" in codes
    assert "far-from-nominal" not in codes
