"""Robots that differ: found where one does, and rarely named where none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.fleets.simulated_series import calibrations, campaign, kind_of, rows

from truearm.fleets.analysis import differences
from truearm.fleets.series import FoundParameters

COUNT = len(campaign().own)


@pytest.mark.parametrize("robots", [4, 12, 40])
def test_few_series_without_a_fault_name_a_robot(robots: int) -> None:
    rng = np.random.default_rng(robots)
    trials = 60
    alarms = sum(bool(differences(kind_of(rows(rng.standard_normal((robots, COUNT)), rng)))) for _ in range(trials))
    assert alarms <= 7  # 3 are promised at most; chance gives 8 of 60 in 1 of 100 runs


@pytest.mark.parametrize("robots", [3, 12, 60])
def test_a_slipped_zero_is_found_in_its_joint(robots: int) -> None:
    rng = np.random.default_rng(3)
    truth = 0.5 * rng.standard_normal((robots, COUNT))
    truth[1, campaign().names.index("theta_offset_3")] += 10.0  # a degree, where the prior is 0.1
    first, *_ = differences(kind_of(rows(truth, rng)))
    assert (first.robot, first.parameter, first.alone) == ("robot-2", "theta_offset_3", True)
    assert first.off == pytest.approx(np.radians(1.0), abs=np.radians(0.15))
    assert first.beside == ("prior" if robots < 10 else "series")


def test_a_link_that_only_a_sum_shows_is_told_with_its_partner() -> None:
    rng = np.random.default_rng(4)
    truth = 0.3 * rng.standard_normal((20, COUNT))
    truth[7, campaign().names.index("d_3")] += 6.0
    found = {one.parameter: one for one in differences(kind_of(rows(truth, rng)))}
    assert {"d_2", "d_3"} <= set(found)
    assert not found["d_3"].alone
    assert found["d_3"].together == ("d_2",)
    assert found["d_3"].off == pytest.approx(6e-3, abs=1.5e-3)  # of the sum


def test_what_only_priors_hold_is_not_compared() -> None:
    rng = np.random.default_rng(5)
    truth = 0.3 * rng.standard_normal((20, COUNT))
    truth[7, campaign().names.index("theta_offset_1")] += 30.0  # the base turns as well
    assert not differences(kind_of(rows(truth, rng)))


def test_a_robot_that_was_measured_badly_is_not_taken_for_another() -> None:
    rng = np.random.default_rng(6)
    poor = calibrations(campaign(8, 3), 3e-4)
    alarms = 0
    for _ in range(60):
        truth = 0.05 * rng.standard_normal((16, COUNT))  # less than the poor campaign's own uncertainty
        alarms += bool(differences(kind_of([*rows(truth[:15], rng), *rows(truth[15:], rng, poor, names=["poor"])])))
    assert alarms <= 7


def test_parameters_whose_nominal_values_differ_are_not_compared() -> None:
    rng = np.random.default_rng(7)
    told = rows(rng.standard_normal((12, COUNT)), rng)
    one = told[3].parameters["a_3"]
    others = {**told[3].parameters, "a_3": replace(one, nominal=one.nominal + 0.05)}
    told[3] = replace(told[3], parameters=FoundParameters.of(others))
    kind = kind_of(told)
    assert np.isnan(kind.prior[kind.parameters.index("a_3")])
    assert not [each for each in differences(kind) if each.parameter == "a_3"]
