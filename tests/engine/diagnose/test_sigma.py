"""Declared deviations are judged in both directions; angles and joint zeros that are far from nominal are noted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.expecting import known
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.arrivals import check_sigma
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.library import load_robot


def declaring(data: Dataset, factor: float) -> Dataset:
    return replace(data, sigma=known(data.sigma) * factor)


def judged(robot: str, data: Dataset) -> list[Notice]:
    return check_sigma(LeftOver.of(identify(load_robot(robot), data, named_model("geometric")), data))


def test_sigma_that_is_too_large_is_a_warning_and_an_error_where_it_holds_the_robot_at_its_priors() -> None:
    for poses in (12, 40):
        run = calibrate("irb120", declaring(campaign("irb120", poses, 0.02e-3, 0)[1], 1000.0))
        assert not run.finished
        (notice,) = [n for n in run.warnings if n.code == "sigma-too-large"]
        assert notice.level == "error"
        assert notice.message.startswith("The declared deviations (20 mm) are about ")
        assert "So the priors hold the robot near its nominal values" in notice.message
        times = float(notice.message.split("about ")[1].split(" times")[0])
        assert times == pytest.approx(1000.0, rel=0.15), poses
    (notice,) = judged("irb120", declaring(campaign("irb120", 40, 0.02e-3, 0)[1], 5.0))
    assert (notice.code, notice.level) == ("sigma-too-large", "warning")
    assert "deviations of the parameters are too large" in notice.message


def test_sigma_that_is_right_or_stated_with_some_reserve_is_left_alone() -> None:
    for seed, robot in enumerate(("irb120", "katana450", "ur10")):
        for factor in (0.2, 1.0, 1.5):
            assert judged(robot, declaring(campaign(robot, 15, 0.03e-3, seed)[1], factor)) == [], (robot, factor)
    data = campaign("irb120", 20, 0.02e-3, 0)[1]
    assert judged("irb120", replace(data, sigma=None)) == []
    few = data.of_configurations(np.arange(3))
    assert judged("irb120", declaring(few, 1000.0)) == []


def noted(robot: str, data: Dataset, redundancy: Redundant = "prior") -> list[Notice]:
    run = calibrate(robot, data, model="geometric", redundancy=redundancy)
    return [notice for notice in run.warnings if notice.code == "far-from-nominal"]


@pytest.mark.parametrize("robot", ["irb120", "ur10", "kr5", "katana450", "li3"])
def test_honest_robots_are_not_far_from_nominal(robot: str) -> None:
    assert noted(robot, campaign(robot, 12, 5e-5, 5)[1]) == []
    assert noted(robot, campaign(robot, 30, 5e-5, 5)[1], "drop") == []


def test_a_joint_that_was_mastered_badly_is_noted() -> None:
    data = campaign("irb120", 30, 5e-5, 5)[1]
    off = np.radians([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    (notice,) = noted("irb120", replace(data, joints=data.joints + off))
    assert notice.level == "note"
    assert notice.message.startswith("theta_offset_3 moved by more than 6 standard deviations of its prior.")
    assert "nominal values are those of its controller" in notice.message
    # and nothing where the robot is another one
    codes = {notice.code for notice in calibrate("irb120", campaign("irb1600", 30, 5e-5, 5)[1]).warnings}
    assert "wrong-robot" in codes
    assert "far-from-nominal" not in codes
