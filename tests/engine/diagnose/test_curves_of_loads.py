"""Curves of joints that stand in for joints that give way, and beside other effects."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.curves import check_curves_of_loads, share_of_loads
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.engine.twin.twin_joint import JointTruth

CURVES = named_model("geometric").also(["joint-curve"])


@cache
def arm() -> Robot:
    masses = (LinkMass(2, 8.0, (0.2, 0.0, 0.0)), LinkMass(3, 6.0, (0.0, 0.0, 0.2)))
    return replace(load_robot("li3"), masses=masses, payload=Payload(3.0, (0.02, 0.01, 0.05)))


@cache
def fitted(truth: str, model: str = "") -> tuple[Dataset, Fit]:
    """Return readings of an arm that bends, or whose gears err, and a fit with curves."""
    rng = np.random.default_rng(2)
    gear = ((1, 3e-4, 0.3), (5, 2e-4, 1.0))
    joint = JointTruth(compliance=2e-5) if truth == "bends" else JointTruth(gear=gear)
    twin = replace(truth_twin(arm(), "random", rng), joints={2: joint, 3: joint})
    data = measure(twin, arm().random_configurations(60, rng), 2e-5, rng)
    return data, identify(arm(), data, CURVES.also([model]) if model else CURVES)


def test_curves_that_loads_explain_are_told() -> None:
    data, fit = fitted("bends")
    (notice,) = check_curves_of_loads(LeftOver.of(fit, data))
    assert (notice.code, notice.level) == ("curves-of-loads", "warning")
    assert "`effects=compliance`" in notice.message


@pytest.mark.parametrize(("truth", "model"), [("gears", ""), ("bends", "compliance")])
def test_curves_of_gears_and_those_beside_compliance_are_not(truth: str, model: str) -> None:
    data, fit = fitted(truth, model)
    assert check_curves_of_loads(LeftOver.of(fit, data)) == []


def test_nothing_is_told_where_nothing_loads_the_joints_or_there_is_no_curve() -> None:
    data, fit = fitted("bends")
    weightless = replace(fit, robot=replace(fit.robot, masses=(), payload=Payload()))
    assert share_of_loads(LeftOver.of(weightless, data)) == 0.0
    assert share_of_loads(LeftOver.of(identify(arm(), data, named_model("geometric")), data)) == 0.0


def test_curves_leave_the_periods_of_a_fourier_series_to_it() -> None:
    _, alone = fitted("gears")
    assert any(name.startswith("curve_sin1_") for name in alone.free.names)
    _, beside = fitted("gears", "fourier")
    low = [name for name in beside.free.names if re.match(r"curve_(sin|cos)[12]_", name)]
    assert low == []
    assert any(name.startswith("curve_") for name in beside.free.names)
    assert any(name.startswith("fourier_sin1_") for name in beside.free.names)
