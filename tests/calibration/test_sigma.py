"""Declared deviations are judged in both directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.arrivals import check_sigma
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot


def declaring(data: Dataset, factor: float) -> Dataset:
    assert data.sigma is not None
    return replace(data, sigma=data.sigma * factor)


def judged(robot: str, data: Dataset) -> list[Notice]:
    return check_sigma(LeftOver.of(identify(load_robot(robot), data, named_model("geometric")), data))


@pytest.mark.parametrize("poses", [12, 40])
def test_sigma_that_holds_the_robot_at_its_priors_is_an_error(poses: int) -> None:
    run = calibrate("irb120", declaring(campaign("irb120", poses, 0.02e-3, 0)[1], 1000.0))
    assert not run.finished
    (notice,) = [n for n in run.warnings if n.code == "sigma-too-large"]
    assert notice.level == "error"
    assert notice.message.startswith("The declared deviations (20 mm) are about ")
    assert "So the priors hold the robot near its nominal values" in notice.message
    times = float(notice.message.split("about ")[1].split(" times")[0])
    assert times == pytest.approx(1000.0, rel=0.15)


def test_sigma_five_times_too_large_is_a_warning() -> None:
    (notice,) = judged("irb120", declaring(campaign("irb120", 40, 0.02e-3, 0)[1], 5.0))
    assert (notice.code, notice.level) == ("sigma-too-large", "warning")
    assert "deviations of the parameters are too large" in notice.message


@pytest.mark.parametrize("factor", [0.2, 1.0, 1.5])
def test_sigma_that_is_right_or_stated_with_some_reserve_is_left_alone(factor: float) -> None:
    for seed, robot in enumerate(("irb120", "katana450", "ur10")):
        assert judged(robot, declaring(campaign(robot, 15, 0.03e-3, seed)[1], factor)) == []


def test_where_none_is_declared_or_no_reading_is_left_nothing_is_said() -> None:
    data = campaign("irb120", 20, 0.02e-3, 0)[1]
    assert judged("irb120", replace(data, sigma=None)) == []
    few = data.of_configurations(np.arange(3))
    assert judged("irb120", declaring(few, 1000.0)) == []
