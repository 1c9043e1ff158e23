"""Which model is fitted where none is named, and what says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import known
from tests.simulated import campaign

import truearm
from truearm.calibration.calibrate import ENOUGH, Calibrate
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.seal import sealed


@pytest.mark.parametrize(
    ("robot", "poses", "asked", "model"),
    [
        ("ur5", 5, {}, "auto"),
        ("kr5", ENOUGH, {}, "auto"),
        ("kr5", ENOUGH - 1, {}, "geometric"),
        ("kr5", ENOUGH - 1, {"payload": "1kg,0,0,0"}, "auto"),
        ("ur5", 40, {"model": "offsets"}, "offsets"),
        ("ur5", 40, {"effects": ["compliance"]}, "geometric"),
        ("ur5", 40, {"zones": 2}, "geometric"),
        ("ur5", 40, {"monte_carlo": 100}, "geometric"),
        ("ur5", 40, {"redundancy": "drop"}, "geometric"),
        ("ur5", 40, {"loss": "l1", "bootstrap": 20, "train": "all"}, "auto"),
    ],
)
def test_the_model_follows_from_loads_and_configurations(
    robot: str, poses: int, asked: dict[str, Any], model: str
) -> None:
    _, data = campaign(robot, poses, 1e-5, 1)
    request = Calibrate(robot, data, **asked)
    name, because = request.model_for(request.loads.on(load_robot(robot)), data)
    assert name == model
    assert bool(because) == ("model" not in asked)


def test_the_default_is_the_model_that_it_says_it_is(truearm: Truearm, tmp_path: Path) -> None:
    _, data = campaign("kr5", 30, 2e-5, 2)
    (tmp_path / "data.csv").write_text(csv_text(data))
    words = ("calibrate", "kr5", tmp_path / "data.csv")
    run = truearm(*words, "--out", tmp_path / "default", "--details")
    assert "\nModel: auto, because 21 configurations are enough\n" in run.out
    named = truearm(*words, "--model", "auto", "--out", tmp_path / "named", "--details")
    assert "\nModel:" not in named.out
    default, same = (json.loads((tmp_path / folder / "result.json").read_text()) for folder in ("default", "named"))
    assert default["parameters"] == same["parameters"]
    assert default["model"].pop("because") == "21 configurations are enough"
    assert default["model"] == same["model"]
    assert "--model" not in default["command"]
    assert "because 21 configurations are enough" in (tmp_path / "default" / "report.html").read_text()


def test_what_a_result_was_asked_for_gives_the_same_result_again() -> None:
    _, data = campaign("kr5", 14, 2e-5, 3)
    result = truearm.calibrate("kr5", data, train="all")
    assert result.fit.model.name == "geometric"
    assert result.because == "loads are not known, and 14 configurations are few"
    assert "model" not in result.request.as_python()
    assert result.request.run().robot.values == result.robot.values


def test_lengths_are_too_few_numbers_for_every_effect() -> None:
    twin, data = campaign("ur5", 40, 1e-5, 1)
    lengths = replace(data, position=np.full_like(data.position, np.nan))
    for readings in (lengths, replace(data, fixture=np.zeros(len(data.target), dtype=np.int64), fixtures=("plate",))):
        model, because = Calibrate("ur5", data).model_for(twin.robot, readings)
        assert (model, because) == ("geometric", "readings are lengths or of fixtures")


def test_few_configurations_of_a_calibrated_robot_are_for_its_zeros() -> None:
    _, data = campaign("kr5", 30, 2e-5, 3)
    calibrated = truearm.calibrate("kr5", data, model="geometric").robot
    proof = known(calibrated.proof)
    few = data.of_configurations(range(ENOUGH - 1))
    unsound = sealed(calibrated, replace(proof, status="rank-loss"))
    edited = calibrated.with_values({"x_3": calibrated.values["x_3"] + 1e-3})
    for robot, readings, model in (
        (calibrated, few, "offsets"),
        (calibrated, data, "auto"),
        (unsound, few, "geometric"),
        (edited, few, "geometric"),
    ):
        name, because = Calibrate(robot, readings).model_for(robot, readings)
        assert name == model
        assert ("calibrated before, and 14 configurations are few" in because) is (model == "offsets")
