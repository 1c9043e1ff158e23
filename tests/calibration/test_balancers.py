"""A large arm with a spring at joint 2, under two weights: calibrated without it and with it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from tests.engine.robot.test_balancers import ARM, PULL
from tests.expecting import known, refused

import truearm
from truearm.calibration.result import Calibration
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin, measure

#: Of joints 1 to 6 [rad/(N m)], as stiff as such arms are.
COMPLIANCE = (3.8e-6, 3e-7, 4e-7, 3e-6, 3.3e-6, 2.4e-6)
STRENGTH = 0.93
WEIGHT = 150.0 * 9.81


@cache
def campaign(folder: Path, *, two_loads: bool) -> tuple[Robot, Dataset]:
    """The nominal arm, and 60 configurations of one whose spring has aged, half of them with 150 kg at the flange."""
    path = folder / "arm.yaml"
    path.write_text(ARM.replace("PULL", PULL))
    arm, rng = read_robot(path), np.random.default_rng(0)
    true = arm.with_effects(["compliance", "balancer"]).with_frames(arm.base, {"ball": (0.0, 0.0, 0.1)})
    drawn = {
        p.name: p.value + 0.3 * p.prior * rng.standard_normal()
        for p in true.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    soft = {f"compliance_{i}": c for i, c in enumerate(COMPLIANCE, 1)}
    true = true.with_values({**drawn, **soft, "balancer_1": STRENGTH})
    wrench = np.zeros((60, 6))
    wrench[::2, 2] = -WEIGHT if two_loads else 0.0
    q = arm.random_configurations(60, rng)
    return arm, measure(Twin(true, joint_truths(true)), q, 1e-5, rng, wrench=wrench)


def codes(calibration: Calibration) -> dict[str, str]:
    return {notice.code: notice.message for notice in calibration.warnings}


def test_spring_brings_the_held_out_error_to_a_fifth(tmp_path_factory: pytest.TempPathFactory) -> None:
    arm, data = campaign(tmp_path_factory.mktemp("arm"), two_loads=True)
    without = truearm.calibrate(replace(arm, balancers=()), data, model="elastic")
    with_it = truearm.calibrate(arm, data, model="elastic", effects=["balancer"])
    before, after = (known(known(each.validation).position) for each in (without, with_it))
    assert after.mean < before.mean / 10.0
    assert after.max < before.max / 10.0
    found = with_it.robot.parameters["balancer_1"]
    deviation = known(found.deviation)
    assert found.value == pytest.approx(STRENGTH, abs=4.0 * deviation)
    assert deviation < 0.01
    assert "residuals-exceed-sigma" not in codes(with_it)
    assert "balancer-held" not in codes(with_it)
    assert "model elastic + balancer" in with_it.robot.history[-1]


def test_strength_is_held_where_all_readings_carry_one_load(tmp_path_factory: pytest.TempPathFactory) -> None:
    arm, data = campaign(tmp_path_factory.mktemp("arm"), two_loads=False)
    found = truearm.calibrate(arm, data, model="elastic", effects=["balancer"])
    assert "balancer_1" not in found.robot.values
    assert "force_x [N]" in codes(found)["balancer-held"]
    assert next(n.level for n in found.warnings if n.code == "balancer-held") == "note"
    assert "+ balancer" not in found.robot.history[-1]
    known = arm.with_effects(["balancer"]).with_values({"balancer_1": STRENGTH})
    kept = truearm.calibrate(known, data, model="elastic", effects=["balancer"])
    assert kept.robot.values["balancer_1"] == STRENGTH


def test_balancer_of_a_robot_that_has_none_is_refused() -> None:
    calibrate = partial(truearm.calibrate, "irb120", "nowhere.csv", model="elastic")
    refused("effects", "irb120.*no balancer.*Enter balancers", calibrate, effects=["balancer"])
