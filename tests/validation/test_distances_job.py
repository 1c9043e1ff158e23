"""The job that judges a robot by distances between measured points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset


def seen(poses: int, seed: int, device: str | None = None) -> Dataset:
    return truearm.simulate("irb120", truth="nominal", poses=poses, noise=1e-5, device=device, seed=seed).data


def test_the_histogram_holds_every_pair() -> None:
    data = seen(20, 1)
    robot = truearm.calibrate("irb120", data, model="frames").robot
    judged = truearm.distances(robot, data)
    result = judged.errors
    assert result.pairs == int(result.counts.sum()) == 9 * 20 * 19 // 2
    first, *_ = result.edges.tolist()
    width = float(f"{np.diff(result.edges)[0]:.12g}")
    assert f"{width:e}"[0] in "125"
    assert first == pytest.approx(round(first / width) * width)
    messages, figures, share, *bars = judged.lines()[1:]
    assert messages == "1710 distances between points of 20 configurations of twin:"
    assert (
        figures
        == f"  mean {1e3 * result.mean:.3f}  deviation {1e3 * result.deviation:.3f}  max {1e3 * result.maximum:.3f} mm"
    )
    assert share == f"  {100 * result.positive:.0f} % of the predicted distances are too long"
    step = max(1, len(result.counts) // 20)
    sums = [int(result.counts[k : k + step].sum()) for k in range(0, len(result.counts), step)]
    assert [bar.count("#") for bar in bars] == [round(50 * count / max(sums)) for count in sums]
    assert [float(bar.split()[0]) for bar in bars] == pytest.approx(1e3 * result.edges[:-1:step], abs=6e-4)
    ends = [*(1e3 * result.edges[step:-1:step]), 1e3 * result.edges[-1]]
    assert [float(bar.split()[2]) for bar in bars] == pytest.approx(ends, abs=6e-4)
    content = judged.summary()
    assert (content["configurations"], content["positive"]) == (20, result.positive)
    assert content["distance_mm"]["max"] == pytest.approx(1e3 * result.maximum)
    assert content["histogram"]["counts"] == result.counts.tolist()


def test_loads_and_readings_that_do_not_fit_are_refused() -> None:
    data = seen(20, 1)
    robot = truearm.calibrate("irb120", data, model="frames").robot
    nothing = replace(data, position=np.full_like(data.position, np.nan))
    warm = robot.with_effects(["thermal-growth"])
    for arm, readings, parameter, words in (
        ("irb120", data, "robot", "the robot has no targets"),
        (robot, replace(data, targets=("1", "2", "x"), source="t.csv"), "data", "^t.csv: .* no target of this name"),
        (robot, nothing, "data", "there is no reading"),
        (warm, data, "data", "the data hold no temperature"),
        (robot, data.of_configurations([0]), "data", "two configurations or more"),
    ):
        with pytest.raises(InputError, match=words) as refusal:
            truearm.distances(arm, readings)
        assert refusal.value.parameter == parameter
    assert truearm.distances(warm, replace(data, temperature=np.full(20, 20.0))).errors.pairs == 1710


def test_a_robot_that_no_instrument_placed_can_be_judged() -> None:
    """As the refusal of ``validate`` advises."""
    robot = truearm.calibrate("irb120", seen(60, 1, "ballbar"), model="offsets").robot
    data = seen(10, 2)
    tip = replace(data.of_readings(data.target == 0), targets=(robot.targets[0].name,))
    with pytest.raises(InputError, match="compare distances with 'truearm distances'"):
        truearm.validate(robot, tip)
    assert truearm.distances(robot, tip).errors.pairs == 45
