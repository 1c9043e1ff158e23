"""The job that judges a robot by distances between measured points."""

from __future__ import annotations

from dataclasses import replace

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset


def seen(poses: int, seed: int, device: str | None = None) -> Dataset:
    return truearm.simulate("irb120", truth="nominal", poses=poses, noise=1e-5, device=device, seed=seed).data


def test_the_histogram_holds_every_pair() -> None:
    data = seen(20, 1)
    judged = truearm.distances(truearm.calibrate("irb120", data, model="frames").robot, data)
    assert judged.errors.pairs == int(judged.errors.counts.sum()) == 9 * 20 * 19 // 2
    assert judged.lines()[1] == "1710 distances between points of 20 configurations of twin:"
    assert judged.summary()["configurations"] == 20


def test_a_robot_that_no_instrument_placed_can_be_judged() -> None:
    """As the refusal of ``validate`` advises."""
    robot = truearm.calibrate("irb120", seen(60, 1, "ballbar"), model="offsets").robot
    data = seen(10, 2)
    tip = replace(data.of_readings(data.target == 0), targets=(robot.targets[0].name,))
    with pytest.raises(InputError, match="compare distances with 'truearm distances'"):
        truearm.validate(robot, tip)
    assert truearm.distances(robot, tip).errors.pairs == 45


def test_one_configuration_has_no_distances() -> None:
    data = seen(20, 1)
    robot = truearm.calibrate("irb120", data, model="frames").robot
    with pytest.raises(InputError, match="two configurations or more") as refusal:
        truearm.distances(robot, data.of_configurations([0]))
    assert refusal.value.parameter == "data"
