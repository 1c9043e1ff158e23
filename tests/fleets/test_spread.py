"""Spread of parameters over a series: truth is the spread that robots are drawn with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.fleets.simulated_series import calibrations, campaign, kind_of, rows

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.fleets.analysis import ParameterSpread, differences, spreads, with_proposed

COUNT = len(campaign().own)


@pytest.mark.parametrize(("robots", "noise"), [(12, 3e-5), (40, 3e-4)])
def test_intervals_cover_the_true_spread_and_mean(robots: int, noise: float) -> None:
    rng = np.random.default_rng(1)
    scale = np.where(np.arange(COUNT) % 2, 0.5, 1.5)
    how = calibrations(campaign(20, 1), noise)
    spread, mean = [], []
    for _ in range(40):
        kind = kind_of(rows(rng.standard_normal((robots, COUNT)) * scale, rng, how))
        for one, factor in zip(spreads(kind), scale, strict=True):
            if one.low is not None and one.high is not None and one.mean_low is not None and one.mean_high is not None:
                spread.append(one.low <= factor * one.prior <= one.high)
                mean.append(one.mean_low <= 0.0 <= one.mean_high)
    assert len(spread) > 40 * 12
    assert 0.92 <= np.mean(spread) <= 0.98
    assert 0.92 <= np.mean(mean) <= 0.98


def test_what_the_estimates_are_uncertain_by_is_taken_off() -> None:
    rng = np.random.default_rng(2)
    how = calibrations(campaign(20, 1), 2e-4)
    kind = kind_of(rows(0.1 * rng.standard_normal((300, COUNT)), rng, how))
    number = kind.parameters.index("alpha_6")
    one = spreads(kind)[number]
    raw = np.std(kind.difference[:, number])
    assert raw > 1.5 * 0.1 * one.prior
    assert one.low is not None
    assert one.high is not None
    assert one.low <= 0.1 * one.prior <= one.high
    assert one.verdict == "narrower"


def test_verdicts_and_what_is_not_told() -> None:
    rng = np.random.default_rng(3)
    names = campaign().names
    scale = np.ones(COUNT)
    scale[names.index("a_3")], scale[names.index("alpha_3")] = 3.0, 0.2
    kind = kind_of(rows(rng.standard_normal((60, COUNT)) * scale, rng))
    told = {one.parameter: one for one in spreads(kind)}
    assert told["a_3"].verdict == "wider"
    assert told["alpha_3"].verdict == "narrower"
    assert told["d_2"].verdict == told["d_3"].verdict == "shared"
    assert told["theta_offset_1"].verdict == "prior only"
    assert told["theta_offset_1"].proposed is None
    few = kind_of(rows(rng.standard_normal((9, COUNT)), rng))
    assert {one.verdict for one in spreads(few)} == {"too few", "shared", "prior only"}


def test_a_robot_with_a_fault_does_not_widen_the_priors() -> None:
    rng = np.random.default_rng(4)
    truth = rng.standard_normal((30, COUNT))
    place = campaign().names.index("theta_offset_3")
    truth[3, place] += 12.0
    kind = kind_of(rows(truth, rng))
    faulty = {one.robot for one in differences(kind)}
    assert faulty == {"robot-4"}
    assert spreads(kind)[place].verdict == "wider"
    assert spreads(kind, faulty)[place].verdict == "agrees"


def test_proposed_priors_are_a_robot_file_that_can_be_read() -> None:
    rng = np.random.default_rng(5)
    names = campaign().names
    truth = rng.standard_normal((60, COUNT))
    truth[:, names.index("a_3")] = 2.0 + 0.3 * truth[:, names.index("a_3")]  # all robots are 2 mm longer
    told = spreads(kind_of(rows(truth, rng)))
    nominal = load_robot("irb120")
    made, proposed = with_proposed(nominal, told)
    assert "d_2" not in proposed
    shifted = made.parameters["a_3"]
    assert shifted.nominal == shifted.value == pytest.approx(nominal.values["a_3"] + 2e-3, abs=2e-4)
    assert shifted.prior == pytest.approx(3e-4, rel=0.3)
    assert made.parameters["d_4"].nominal == nominal.values["d_4"]


def test_a_file_with_proposed_priors_holds_them(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    made, proposed = with_proposed(load_robot("irb120"), spreads(kind_of(rows(rng.standard_normal((20, COUNT)), rng))))
    file = tmp_path / "priors.yaml"
    file.write_text(robot_text(made), "utf-8")
    again = read_robot(file)
    assert proposed
    for name in proposed:
        assert again.parameters[name].prior == pytest.approx(made.parameters[name].prior, rel=1e-12)
    assert "from the spread of 20 robots" in again.source


def test_too_few_robots_propose_nothing() -> None:
    rng = np.random.default_rng(7)
    nominal = load_robot("irb120")
    made, proposed = with_proposed(nominal, spreads(kind_of(rows(rng.standard_normal((5, COUNT)), rng))))
    assert not proposed
    assert made is nominal


def test_no_prior_is_proposed_where_values_scatter_less_than_they_are_uncertain_by() -> None:
    found = ParameterSpread("a_2", "m", 0.0, 1e-3, 1.0, 12, "narrower", spread=0.0, low=0.0, high=0.0)
    assert found.proposed is None
