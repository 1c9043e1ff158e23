"""A calibration in Python: its parameters by name, its report, and a split that is made apart from it."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset

DATA = Path(__file__).parents[1] / "recordings" / "inputs" / "data.csv"


@cache
def data() -> Dataset:
    return truearm.load_data(DATA)


@cache
def calibrated() -> Calibration:
    return truearm.calibrate("irb120", data())


def test_a_parameter_has_its_value_and_its_deviation() -> None:
    found = calibrated().parameters["a_3"]
    assert found.deviation is not None
    assert 0.0 < found.deviation < 1e-4
    assert abs(found.value - 0.27) < 5e-4


def test_the_report_of_the_fit_has_a_line_for_every_parameter() -> None:
    text = str(calibrated())
    assert text.startswith("\n".join(calibrated().lines()))
    rows = text.splitlines()[len(calibrated().lines()) + 1 :]
    assert [row.split()[0] for row in rows] == ["parameter", *calibrated().parameters]
    assert re.search(r"^a_3 +270\.000 +270\.\d+ +0\.0\d+  mm$", text, re.M)
    assert re.search(r"^a_1 .*not told by the data$", text, re.M)


def test_a_split_made_apart_finds_the_same() -> None:
    training, judging = data().split(0.7, seed=0)
    apart = truearm.calibrate("irb120", training, train="all")
    assert apart.parameters["a_3"].value == calibrated().parameters["a_3"].value
    held_out = truearm.validate(apart.robot, judging).errors.position
    assert held_out is not None
    assert calibrated().validation is not None
    assert held_out.mean == pytest.approx(calibrated().validation.position.mean, rel=1e-12)  # type: ignore[union-attr]
    assert data().split(5, seed=1)[0].configurations == 5


@pytest.mark.parametrize("train", [0, 1.5, -0.3, 20, float("nan"), "all"])
def test_a_split_that_leaves_nothing_is_refused(train: float) -> None:
    with pytest.raises(InputError) as refusal:
        data().split(train)
    assert refusal.value.parameter == "train"


@pytest.mark.parametrize("seed", [-1, 1.5, "x", None])
def test_a_split_by_no_seed_is_refused(seed: Any) -> None:
    with pytest.raises(InputError) as refusal:
        data().split(0.7, seed=seed)
    assert refusal.value.parameter == "seed"
