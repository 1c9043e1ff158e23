"""Machines that were measured again: a drift is found, chance is not taken for one, and the gauge hides nothing."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from tests.fleets.simulated_series import Calibrations, calibrations, campaign, kind_of, rows

from truearm.engine.robot.chain import Array
from truearm.fleets.analysis import analysed, differences
from truearm.fleets.drift import MONTH, Drifts, drifts
from truearm.fleets.series import FoundParameters, Row
from truearm.fleets.words import analysis_notices

COUNT = len(campaign().own)
NAMES = campaign().names


def campaigns(
    truth: Array,
    months: tuple[int, ...],
    rng: np.random.Generator,
    hows: tuple[Calibrations, ...],
    rate: Array | None = None,
    *,
    correlated: bool = True,
) -> Drifts:
    """Measure machines with true differences ``(machines, parameters)`` in some months, with a change a month."""
    told: list[Row] = []
    for machine in range(len(truth)):
        for month, how in zip(months, hows, strict=True):
            days = date(2026, month + 1, 1).toordinal() - date(2026, months[0] + 1, 1).toordinal()
            there = truth[machine] + (0.0 if rate is None else rate * days / MONTH)
            told += rows(
                there[None],
                rng,
                how,
                names=[f"m{machine}-{month}"],
                of=f"m{machine}",
                date=f"2026-{month + 1:02d}-01",
                correlated=correlated,
            )
    return drifts(kind_of(told))


STRONG, OTHER, POOR = (
    calibrations(campaign()),
    calibrations(campaign(30, 1)),
    calibrations(campaign(8, 3), 3e-4),
)


@pytest.mark.parametrize("hows", [(STRONG, OTHER), (STRONG, POOR)], ids=["alike", "one of them poor"])
def test_few_fleets_without_a_change_tell_one(hows: tuple[Calibrations, ...]) -> None:
    rng = np.random.default_rng(1)
    times: dict[str, list[float]] = {}
    alarms = 0
    for _ in range(25):
        found = campaigns(rng.standard_normal((4, COUNT)), (0, 6), rng, hows)
        alarms += bool(found.significant)
        for one in found.found:
            times.setdefault(one.parameter, []).append(one.times)
    assert alarms <= 4
    assert {"d_2", "d_3"} <= set(times)  # their sum is seen
    for those in times.values():
        assert 0.85 < np.std(those) < 1.15


def test_without_correlations_nothing_is_told_that_they_would_not_tell() -> None:
    rng = np.random.default_rng(2)
    rate = np.zeros(COUNT)
    rate[NAMES.index("d_3")] = 0.2
    truth = rng.standard_normal((1, COUNT))
    known = campaigns(truth, (0, 6), rng, (STRONG, OTHER), rate)
    blind = campaigns(truth, (0, 6), rng, (STRONG, OTHER), rate, correlated=False)
    assert {one.parameter for one in known.significant} == {"d_2", "d_3"}
    assert known.significant[0].together in (("d_2",), ("d_3",))
    assert not blind.significant


def test_a_drift_is_found_with_its_rate_and_where_it_is() -> None:
    rng = np.random.default_rng(3)
    rate = np.zeros(COUNT)
    rate[NAMES.index("theta_offset_4")] = 0.2  # 0.02 deg a month
    found = campaigns(rng.standard_normal((1, COUNT)), (0, 3, 6, 11), rng, (STRONG, OTHER, STRONG, OTHER), rate)
    (one,) = found.significant
    assert (one.machine, one.parameter, one.campaigns, one.steady) == ("m0", "theta_offset_4", 4, True)
    assert np.degrees(one.low) < 0.02 < np.degrees(one.high)
    assert np.degrees(one.change) == pytest.approx(0.02 * 334 / MONTH, abs=0.005)
    assert one.changes[0] == 0.0
    assert np.degrees(one.changes[-1]) == pytest.approx(0.02 * 334 / MONTH, abs=0.005)


def test_intervals_of_rates_cover_the_truth_all_together() -> None:
    rng = np.random.default_rng(4)
    rate = 0.03 * rng.standard_normal(COUNT)
    off, together = [], []
    for _ in range(20):
        found = campaigns(rng.standard_normal((3, COUNT)), (0, 4, 9), rng, (STRONG, OTHER, OTHER), rate)
        alone = [one for one in found.found if one.alone]
        true = [rate[NAMES.index(one.parameter)] * campaign().prior[NAMES.index(one.parameter)] for one in alone]
        off += [(one.slope - t) / (one.slope / one.times) for one, t in zip(alone, true, strict=True)]
        together.append(all(one.low <= t <= one.high for one, t in zip(alone, true, strict=True)))
    assert 0.92 <= np.mean(np.abs(off) < 1.96) <= 0.98
    assert sum(together) >= 17  # 19 are promised; chance gives fewer than 17 in 1 of 60 runs


def test_an_interval_without_zero_is_a_change_by_more_than_chance() -> None:
    rng = np.random.default_rng(6)
    rate = 0.03 * rng.standard_normal(COUNT)
    found = campaigns(rng.standard_normal((3, COUNT)), (0, 4, 9), rng, (STRONG, OTHER, OTHER), rate).found
    assert {one.significant for one in found} == {True, False}
    assert all(one.significant == (one.low > 0.0 or one.high < 0.0) for one in found)


def test_a_jump_is_a_change_but_not_steady() -> None:
    rng = np.random.default_rng(5)
    truth = rng.standard_normal((1, COUNT))
    told = []
    for month, jump in ((0, 0.0), (4, 0.0), (8, 3.0)):
        there = truth.copy()
        there[0, NAMES.index("theta_offset_3")] += jump
        told += rows(there, rng, names=[f"c{month}"], of="m", date=f"2026-{month + 1:02d}-01")
    (one,) = drifts(kind_of(told)).significant
    assert one.parameter == "theta_offset_3"
    assert one.steady is False


def test_what_base_or_target_can_do_instead_is_not_told() -> None:
    rng = np.random.default_rng(6)
    rate = np.zeros(COUNT)
    rate[NAMES.index("theta_offset_1")] = 3.0
    found = campaigns(rng.standard_normal((2, COUNT)), (0, 6), rng, (STRONG, OTHER), rate)
    assert not found.significant
    assert {"theta_offset_1", "d_1", "theta_offset_6"} <= set(found.unknown)


def test_a_change_of_all_machines_alike_is_named() -> None:
    rng = np.random.default_rng(17)
    rate = np.zeros(COUNT)
    rate[NAMES.index("a_3")] = 0.05
    found = campaigns(rng.standard_normal((8, COUNT)), (0, 6), rng, (STRONG, OTHER), rate)
    alike = {one.parameter: one for one in found.alike}
    assert alike["a_3"].low < 0.05e-3 < alike["a_3"].high
    assert len(alike) <= 2


def test_machines_without_two_dates_are_named() -> None:
    rng = np.random.default_rng(8)
    truth = rng.standard_normal((1, COUNT))
    told = rows(truth, rng, names=["a"], of="m") + rows(truth, rng, names=["b"], of="m", date="2026-01-01")
    found = drifts(kind_of(told))
    assert found.undated == ("m",)
    assert not found.found


def test_of_many_machines_the_surest_of_each_is_kept() -> None:
    rng = np.random.default_rng(9)
    rate = np.zeros(COUNT)
    rate[[NAMES.index("a_3"), NAMES.index("theta_offset_4")]] = 0.5
    found = campaigns(rng.standard_normal((60, COUNT)), (0, 6), rng, (STRONG, OTHER), rate)
    assert {one.parameter for one in found.significant} == {"a_3", "theta_offset_4"}
    assert len(found.significant) == 120
    assert len(found.found) == 120
    assert found.compared == 60 * 19


def test_another_robot_under_the_same_serial_number_is_suspected() -> None:
    rng = np.random.default_rng(10)
    truth = rng.standard_normal((3, COUNT))
    first, later = "2026-01-01", "2026-07-01"
    told = [
        *rows(truth[:1], rng, names=["a"], of="m", date=first),
        *rows(truth[1:2], rng, names=["b"], of="m", date=later),
        *rows(truth[2:], rng, names=["c"], of="n", date=first),
        *rows(truth[2:], rng, names=["d"], of="n", date=later),
    ]
    found = drifts(kind_of(told))
    assert found.others == ("m",)
    (notice,) = [each for each in analysis_notices(analysed(told)) if each.code == "another-machine"]
    assert (notice.level, "of m changed" in notice.message) == ("warning", True)


def test_a_parameter_that_few_robots_identified_is_not_compared_with_the_others() -> None:
    rng = np.random.default_rng(11)
    told = rows(rng.standard_normal((20, COUNT)), rng)
    for number in range(4, 20):
        kept = {name: one for name, one in told[number].parameters.items() if name != "a_3"}
        told[number] = replace(told[number], parameters=FoundParameters.of(kept), covariance=())
    wrong = {**told[0].parameters, "a_3": replace(told[0].parameters["a_3"], value=9.0)}
    told[0] = replace(told[0], parameters=FoundParameters.of(wrong))
    assert not [one for one in differences(kind_of(told)) if one.parameter == "a_3"]
