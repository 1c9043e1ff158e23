"""The quick look at distances agrees with the placed robot where data fit, and leaves alone what it cannot judge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.slips import quick_misfit
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin

ROBOT = load_robot("irb120")


def campaign(device: str) -> Dataset:
    rng = np.random.default_rng(0)
    return measured_with(named_device(device), ROBOT, truth_twin(ROBOT, "random", rng), 60, rng)


@pytest.mark.parametrize("device", ["ballbar", "two-spheres"])
def test_right_signs_fit_and_a_wrong_one_does_not(device: str) -> None:
    data = campaign(device)
    right = quick_misfit(ROBOT, data)
    mirrored = quick_misfit(ROBOT, replace(data, joints=data.joints * [1, -1, 1, 1, 1, 1]))
    assert right is not None
    assert mirrored is not None
    assert right < 2e-3
    assert mirrored > 15e-3


@pytest.mark.parametrize("device", ["tracker", "plane", "point", "strings"])
def test_other_readings_are_not_judged(device: str) -> None:
    assert quick_misfit(ROBOT, campaign(device)) is None


def test_rows_in_another_order_are_not_called_a_joint_in_another_unit() -> None:
    """A joint that would hardly move lets any sphere fit a little better."""
    data = campaign("ballbar")
    codes = [notice.code for notice in check("irb120", replace(data, joints=data.joints[::-1].copy())).warnings]
    assert "unit-angle" not in codes
    assert "fixtures-unlikely" in codes
