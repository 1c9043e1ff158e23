"""The job that measures a digital twin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.statistics import errors_of
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.truths import truth_twin


def warming_up() -> Robot:
    """A robot whose links are a thousandth short when a campaign begins."""
    arm = truearm.load_robot("irb120").with_effects(["warm-up"])
    grown = {name: 1e-3 for name in arm.parameters if name.startswith("warm_up_") and name != "warm_up_rate"}
    return arm.with_values({**grown, "warm_up_rate": 0.05})


@pytest.mark.parametrize("device", [None, "tracker", "strings", "ballbar"])
def test_a_truth_that_warms_up_is_read_as_it_does(device: str | None, tmp_path: Path) -> None:
    file = tmp_path / "warm.yaml"
    file.write_text(robot_text(warming_up()))
    cold = truearm.simulate("irb120", truth="nominal", poses=30, noise=0.0, device=device).data
    warm = truearm.simulate("irb120", truth=file, poses=30, noise=0.0, device=device).data
    assert csv_text(cold) != csv_text(warm)


def test_the_model_with_warm_up_predicts_what_is_read() -> None:
    truth = warming_up()
    data = truearm.simulate("irb120", truth=truth, poses=20, noise=0.0).data
    true = truth_twin(truth, "nominal", np.random.default_rng(0)).robot
    warm = true.with_values({name: 0.0 for name in true.parameters if name.startswith("warm_up_")})
    errors, without = errors_of(true, data), errors_of(warm, data)
    assert errors.position is not None
    assert without.position is not None
    assert errors.position.max < 1e-11
    assert without.position.max > 1e-4


def test_a_truth_is_a_name_a_file_or_a_robot(tmp_path: Path) -> None:
    file = tmp_path / "truth.yaml"
    file.write_text(robot_text(truearm.load_robot("irb120")))
    simulations = [
        truearm.simulate("irb120", truth=truth, poses=4, noise=1e-5, out=tmp_path / "data.csv")
        for truth in ("nominal", file, truearm.load_robot("irb120"))
    ]
    for other in simulations[1:]:
        assert np.array_equal(simulations[0].data.position, other.data.position)
    assert simulations[0].lines() == [
        "SIMULATED: measurements of a virtual instrument, not of a robot.",
        f"4 configurations of irb120 (nominal), 12 readings of 3 targets: {tmp_path / 'data.csv'}",
    ]
    assert truearm.load_data(tmp_path / "data.csv").configurations == 4
    single = truearm.simulate("irb120", truth="nominal", poses=1, device="ballbar")
    assert single.lines()[1].startswith("1 configuration of irb120 (nominal), 1 reading of 1 target against cup_")


@pytest.mark.parametrize(
    ("options", "parameter", "words"),
    [
        ({"noise": None}, "noise", "no noise is given. Give `noise`, or a `device`"),
        ({"truth": "randon"}, "truth", "Did you mean random"),
        ({"truth": "li3.yaml"}, "truth", "there is no such file"),
        ({"truth": truearm.load_robot("li3")}, "truth", "other joints than irb120; got '3 joints'; allowed: 6"),
        ({"noise": 1e-12}, "noise", "too small to be plausible"),
        ({"poses": 0}, "poses", "allowed: 1 to 50000"),
    ],
)
def test_what_cannot_be_simulated(options: dict[str, object], parameter: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        truearm.simulate("irb120", **{"truth": "nominal", "poses": 3, "noise": 1e-4, **options})  # type: ignore[arg-type]
    assert refusal.value.parameter == parameter


def test_what_is_read_is_not_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "truth.yaml"
    file.write_text(robot_text(truearm.load_robot("irb120")))
    with pytest.raises(InputError, match=r"would be overwritten\. Choose another `out`") as refusal:
        truearm.simulate("irb120", truth=file, poses=3, noise=0.0, out=file)
    assert refusal.value.parameter == "out"
