"""What a fleet says: quantiles of errors, spread, robots that differ or drift, and which to look at first.

Truth is the distribution that errors and robots are drawn from: what is there is found, and chance is not taken for it.
"""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known
from tests.fleets.simulated_series import Calibrations, calibrations, campaign, kind_of, rows

from truearm.engine.document.document import json_of, lines_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.fleets.analysis import Analysis, ParameterSpread, analysed, differences, spreads, with_proposed
from truearm.fleets.drift import MONTH, Drifts, drifts, quantiles, share_interval
from truearm.fleets.figures import fleet_figures
from truearm.fleets.series import Accuracy, FoundParameters, Row
from truearm.fleets.words import analysis_blocks, analysis_notices

NAMES = campaign().names
COUNT = len(NAMES)


def drawn(robots: int, rng: np.random.Generator, size: float = 1.0, **off: float) -> Array:
    """Return true differences in priors `(robots, parameters)`; some are larger by so much in the second robot."""
    truth = size * rng.standard_normal((robots, COUNT))
    for name, more in off.items():
        truth[1, NAMES.index(name)] += more
    return truth


def changing(**rates: float) -> Array:
    """Return changes in priors a month."""
    rates_of_all = np.zeros(COUNT)
    for name, rate in rates.items():
        rates_of_all[NAMES.index(name)] = rate
    return rates_of_all


# -- quantiles ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("robots", "share"), [(20, 0.5), (100, 0.9), (100, 0.95)])
def test_the_interval_of_a_quantile_covers_it_in_95_of_100_series(robots: int, share: float) -> None:
    rng = np.random.default_rng(1)
    truth = -np.log(1.0 - share)  # of the exponential distribution
    covered = 0
    for _ in range(400):
        (quantile,) = quantiles(rng.exponential(size=robots), (share,))
        assert known(quantile.low) <= known(quantile.value) <= known(quantile.high)
        covered += known(quantile.low) <= truth <= known(quantile.high)
    assert covered >= 400 * 0.93


def test_what_few_robots_cannot_tell_is_not_told() -> None:
    median, ninety, *_ = quantiles(np.array([1.0, 2.0, 3.0]))
    assert (median.value, median.low, median.high) == (2.0, None, None)
    assert (ninety.value, ninety.needed) == (None, 36)
    for share in (0.5, 0.9, 0.95):
        needed = quantiles(np.arange(3.0), (share,))[0].needed
        for robots, is_known in ((needed, True), (needed - 1, False)):
            (quantile,) = quantiles(np.arange(float(robots)), (share,))
            assert (quantile.low is not None and quantile.high is not None) == is_known


def test_the_share_of_robots_that_fail() -> None:
    for count, of, low, high in ((0, 10, 0.0, 0.3085), (10, 10, 0.6915, 1.0), (1, 20, 0.0013, 0.2487)):
        assert share_interval(count, of) == pytest.approx((low, high), abs=1e-4)  # Clopper and Pearson's tables


# -- spread ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("robots", "noise"), [(12, 3e-5), (40, 3e-4)])
def test_intervals_cover_the_true_spread_and_mean(robots: int, noise: float) -> None:
    rng = np.random.default_rng(1)
    scale = np.where(np.arange(COUNT) % 2, 0.5, 1.5)
    calibrated = calibrations(campaign(20, 1), noise)
    spread, mean = [], []
    for _ in range(40):
        kind = kind_of(rows(rng.standard_normal((robots, COUNT)) * scale, rng, calibrated))
        for parameter, factor in zip(spreads(kind), scale, strict=True):
            if (
                parameter.low is not None
                and parameter.high is not None
                and parameter.mean_low is not None
                and parameter.mean_high is not None
            ):
                spread.append(parameter.low <= factor * parameter.prior <= parameter.high)
                mean.append(parameter.mean_low <= 0.0 <= parameter.mean_high)
    assert len(spread) > 40 * 12
    assert 0.92 <= np.mean(spread) <= 0.98
    assert 0.92 <= np.mean(mean) <= 0.98


def test_what_the_estimates_are_uncertain_by_is_taken_off() -> None:
    rng = np.random.default_rng(2)
    calibrated = calibrations(campaign(20, 1), 2e-4)
    kind = kind_of(rows(0.1 * rng.standard_normal((300, COUNT)), rng, calibrated))
    number = kind.parameters.index("alpha_6")
    parameter = spreads(kind)[number]
    raw = np.std(kind.difference[:, number])
    assert raw > 1.5 * 0.1 * parameter.prior
    assert known(parameter.low) <= 0.1 * parameter.prior <= known(parameter.high)
    assert parameter.verdict == "narrower"


def test_verdicts_and_what_is_not_told() -> None:
    rng = np.random.default_rng(3)
    scale = np.ones(COUNT)
    scale[NAMES.index("a_3")], scale[NAMES.index("alpha_3")] = 3.0, 0.2
    kind = kind_of(rows(rng.standard_normal((60, COUNT)) * scale, rng))
    by_name = {parameter.parameter: parameter for parameter in spreads(kind)}
    verdicts = {"a_3": "wider", "alpha_3": "narrower", "d_2": "shared", "d_3": "shared", "theta_offset_1": "prior only"}
    assert {name: by_name[name].verdict for name in verdicts} == verdicts
    assert by_name["theta_offset_1"].proposed is None
    few = kind_of(rows(rng.standard_normal((9, COUNT)), rng))
    assert {parameter.verdict for parameter in spreads(few)} == {"too few", "shared", "prior only"}


@pytest.mark.parametrize("robots", [10, 40])
def test_few_series_that_are_as_their_priors_say_are_called_wider_or_narrower(robots: int) -> None:
    rng = np.random.default_rng(robots)
    trials, found = 60, []
    for _ in range(trials):
        truth = rng.standard_normal((robots, COUNT))
        honest = {parameter.verdict for parameter in spreads(kind_of(rows(truth, rng)))}
        truth[:, NAMES.index("a_3")] *= 4.0
        wider = [
            parameter.parameter for parameter in spreads(kind_of(rows(truth, rng))) if parameter.verdict == "wider"
        ]
        found.append((bool(honest & {"wider", "narrower"}), "a_3" in wider))
    alarms, named = np.sum(found, axis=0)
    assert alarms <= 3  # 0.6 is promised at most; chance gives 4 of 60 in 1 of 300 runs
    assert named >= 0.9 * trials


def test_a_robot_with_a_fault_does_not_widen_the_priors() -> None:
    rng = np.random.default_rng(4)
    place = NAMES.index("theta_offset_3")
    kind = kind_of(rows(drawn(30, rng, theta_offset_3=12.0), rng))
    faulty = {difference.robot for difference in differences(kind)}
    assert faulty == {"robot-2"}
    of_all, of_sound = spreads(kind)[place], spreads(kind, faulty)[place]
    assert known(of_all.proposed) > 1.8 * of_all.prior
    assert known(of_sound.proposed) < 1.3 * of_sound.prior
    assert of_sound.verdict == "agrees"


def test_proposed_priors_are_a_robot_file_that_can_be_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    truth = drawn(60, rng)
    truth[:, NAMES.index("a_3")] = 2.0 + 0.3 * truth[:, NAMES.index("a_3")]  # all robots are 2 mm longer
    of_series = spreads(kind_of(rows(truth, rng)))
    nominal = load_robot("irb120")
    with_priors, proposed = with_proposed(nominal, of_series)
    assert "d_2" not in proposed
    shifted = with_priors.parameters["a_3"]
    assert shifted.nominal == shifted.value == pytest.approx(nominal.values["a_3"] + 2e-3, abs=2e-4)
    assert shifted.prior == pytest.approx(3e-4, rel=0.3)
    assert with_priors.parameters["d_4"].nominal == nominal.values["d_4"]
    (tmp_path / "priors.yaml").write_text(robot_text(with_priors), "utf-8")
    again = read_robot(tmp_path / "priors.yaml")
    assert "a_3" in proposed
    for name in proposed:
        assert again.parameters[name].prior == pytest.approx(with_priors.parameters[name].prior, rel=1e-12)
    assert "from the spread of 60 robots" in again.source
    with_priors, proposed = with_proposed(nominal, spreads(kind_of(rows(drawn(5, rng), rng))))
    assert (bool(proposed), with_priors) == (False, nominal)  # of too few robots
    # no prior is proposed where values scatter less than they are uncertain by
    without_spread = ParameterSpread("a_2", "m", 0.0, 1e-3, 1.0, 12, "narrower", spread=0.0, low=0.0, high=0.0)
    assert without_spread.proposed is None


# -- robots that differ ------------------------------------------------------------------------------------


@pytest.mark.parametrize("robots", [4, 12, 40])
def test_few_series_without_a_fault_name_a_robot(robots: int) -> None:
    rng = np.random.default_rng(robots)
    trials = 60
    alarms = sum(bool(differences(kind_of(rows(drawn(robots, rng), rng)))) for _ in range(trials))
    assert alarms <= 7  # 3 are promised at most; chance gives 8 of 60 in 1 of 100 runs


@pytest.mark.parametrize("robots", [3, 12, 60])
def test_a_slipped_zero_is_found_in_its_joint(robots: int) -> None:
    rng = np.random.default_rng(3)
    truth = 0.5 * drawn(robots, rng)
    truth[1, NAMES.index("theta_offset_3")] += 10.0  # a degree, where the prior is 0.1
    first, *_ = differences(kind_of(rows(truth, rng)))
    assert (first.robot, first.parameter, first.alone) == ("robot-2", "theta_offset_3", True)
    assert first.off == pytest.approx(np.radians(1.0), abs=np.radians(0.15))
    assert first.beside == ("prior" if robots < 10 else "series")


def test_a_link_that_only_a_sum_shows_is_told_with_its_partner() -> None:
    rng = np.random.default_rng(4)
    differing = {
        difference.parameter: difference for difference in differences(kind_of(rows(drawn(20, rng, 0.3, d_3=6.0), rng)))
    }
    assert {"d_2", "d_3"} <= set(differing)
    assert not differing["d_3"].alone
    assert differing["d_3"].together == ("d_2",)
    assert differing["d_3"].off == pytest.approx(6e-3, abs=1.5e-3)  # of the sum
    # what only priors hold is not compared: the base turns as well
    assert not differences(kind_of(rows(drawn(20, rng, 0.3, theta_offset_1=30.0), rng)))


def test_a_robot_that_was_measured_badly_is_not_taken_for_another() -> None:
    rng = np.random.default_rng(6)
    poor = calibrations(campaign(8, 3), 3e-4)
    alarms = 0
    for _ in range(60):
        truth = 0.05 * rng.standard_normal((16, COUNT))  # less than the poor campaign's own uncertainty
        alarms += bool(differences(kind_of([*rows(truth[:15], rng), *rows(truth[15:], rng, poor, names=["poor"])])))
    assert alarms <= 7


def test_parameters_whose_nominal_values_differ_or_that_few_robots_identified_are_not_compared() -> None:
    rng = np.random.default_rng(7)
    measured = rows(rng.standard_normal((12, COUNT)), rng)
    link = measured[3].parameters["a_3"]
    others = {**measured[3].parameters, "a_3": replace(link, nominal=link.nominal + 0.05)}
    measured[3] = replace(measured[3], parameters=FoundParameters.of(others))
    kind = kind_of(measured)
    assert np.isnan(kind.prior[kind.parameters.index("a_3")])
    assert not [each for each in differences(kind) if each.parameter == "a_3"]
    rng = np.random.default_rng(11)
    measured = rows(rng.standard_normal((20, COUNT)), rng)
    for number in range(4, 20):
        remaining = {name: value for name, value in measured[number].parameters.items() if name != "a_3"}
        measured[number] = replace(measured[number], parameters=FoundParameters.of(remaining), covariance=())
    wrong = {**measured[0].parameters, "a_3": replace(measured[0].parameters["a_3"], value=9.0)}
    measured[0] = replace(measured[0], parameters=FoundParameters.of(wrong))
    assert not [difference for difference in differences(kind_of(measured)) if difference.parameter == "a_3"]


# -- machines that were measured again ---------------------------------------------------------------------


def campaigns(
    truth: Array,
    months: tuple[int, ...],
    rng: np.random.Generator,
    calibrated: tuple[Calibrations, ...],
    rate: Array | None = None,
    *,
    correlated: bool = True,
) -> Drifts:
    """Measure machines with true differences ``(machines, parameters)`` in some months, with a change a month."""
    measured: list[Row] = []
    for machine in range(len(truth)):
        for month, of_month in zip(months, calibrated, strict=True):
            days = date(2026, month + 1, 1).toordinal() - date(2026, months[0] + 1, 1).toordinal()
            true = truth[machine] + (0.0 if rate is None else rate * days / MONTH)
            measured += rows(
                true[None],
                rng,
                of_month,
                names=[f"m{machine}-{month}"],
                of=f"m{machine}",
                date=f"2026-{month + 1:02d}-01",
                correlated=correlated,
            )
    return drifts(kind_of(measured))


STRONG, OTHER, POOR = calibrations(campaign()), calibrations(campaign(30, 1)), calibrations(campaign(8, 3), 3e-4)


@pytest.mark.parametrize("hows", [(STRONG, OTHER), (STRONG, POOR)], ids=["alike", "one of them poor"])
def test_few_fleets_without_a_change_tell_one(hows: tuple[Calibrations, ...]) -> None:
    rng = np.random.default_rng(1)
    times: dict[str, list[float]] = {}
    alarms = 0
    for _ in range(25):
        changes = campaigns(rng.standard_normal((4, COUNT)), (0, 6), rng, hows)
        alarms += bool(changes.significant)
        for change in changes.changes:
            times.setdefault(change.parameter, []).append(change.times)
    assert alarms <= 4
    assert {"d_2", "d_3"} <= set(times)  # their sum is seen
    for those in times.values():
        assert 0.85 < np.std(those) < 1.15


def test_without_correlations_nothing_is_told_that_they_would_not_tell() -> None:
    rng = np.random.default_rng(2)
    rate, truth = changing(d_3=0.2), drawn(1, rng)
    known = campaigns(truth, (0, 6), rng, (STRONG, OTHER), rate)
    blind = campaigns(truth, (0, 6), rng, (STRONG, OTHER), rate, correlated=False)
    assert {change.parameter for change in known.significant} == {"d_2", "d_3"}
    assert known.significant[0].together in (("d_2",), ("d_3",))
    assert not blind.significant


def test_a_drift_is_found_with_its_rate_and_where_it_is() -> None:
    rng = np.random.default_rng(3)
    rate = changing(theta_offset_4=0.2)  # 0.02 deg a month
    fleet_drifts = campaigns(drawn(1, rng), (0, 3, 6, 11), rng, (STRONG, OTHER, STRONG, OTHER), rate)
    (drift,) = fleet_drifts.significant
    assert (drift.machine, drift.parameter, drift.campaigns, drift.steady) == ("m0", "theta_offset_4", 4, True)
    assert np.degrees(drift.low) < 0.02 < np.degrees(drift.high)
    assert np.degrees(drift.change) == pytest.approx(0.02 * 334 / MONTH, abs=0.005)
    assert drift.changes[0] == 0.0
    assert np.degrees(drift.changes[-1]) == pytest.approx(0.02 * 334 / MONTH, abs=0.005)


def test_intervals_of_rates_cover_the_truth_all_together() -> None:
    rng = np.random.default_rng(4)
    rate = 0.03 * rng.standard_normal(COUNT)
    off, together = [], []
    for _ in range(20):
        fleet_drifts = campaigns(rng.standard_normal((3, COUNT)), (0, 4, 9), rng, (STRONG, OTHER, OTHER), rate)
        alone = [drift for drift in fleet_drifts.changes if drift.alone]
        true = [rate[NAMES.index(drift.parameter)] * campaign().prior[NAMES.index(drift.parameter)] for drift in alone]
        off += [(drift.slope - t) / (drift.slope / drift.times) for drift, t in zip(alone, true, strict=True)]
        together.append(all(drift.low <= t <= drift.high for drift, t in zip(alone, true, strict=True)))
        assert all(drift.significant == (drift.low > 0.0 or drift.high < 0.0) for drift in fleet_drifts.changes)
    assert 0.92 <= np.mean(np.abs(off) < 1.96) <= 0.98
    assert sum(together) >= 17  # 19 are promised; chance gives fewer than 17 in 1 of 60 runs


def test_a_jump_is_a_change_but_not_steady() -> None:
    rng = np.random.default_rng(5)
    truth = rng.standard_normal((1, COUNT))
    measured = []
    for month, jump in ((0, 0.0), (4, 0.0), (8, 3.0)):
        true = truth.copy()
        true[0, NAMES.index("theta_offset_3")] += jump
        measured += rows(true, rng, names=[f"c{month}"], of="m", date=f"2026-{month + 1:02d}-01")
    (drift,) = drifts(kind_of(measured)).significant
    assert drift.parameter == "theta_offset_3"
    assert drift.steady is False


def test_what_base_or_target_can_do_instead_is_not_told() -> None:
    rng = np.random.default_rng(6)
    fleet_drifts = campaigns(drawn(2, rng), (0, 6), rng, (STRONG, OTHER), changing(theta_offset_1=3.0))
    assert not fleet_drifts.significant
    assert {"theta_offset_1", "d_1", "theta_offset_6"} <= set(fleet_drifts.unknown)


def test_a_change_of_all_machines_alike_is_named() -> None:
    rng = np.random.default_rng(17)
    fleet_drifts = campaigns(drawn(8, rng), (0, 6), rng, (STRONG, OTHER), changing(a_3=0.05))
    alike = {change.parameter: change for change in fleet_drifts.alike}
    assert alike["a_3"].low < 0.05e-3 < alike["a_3"].high
    assert len(alike) <= 2


Warm = tuple[float | None, ...]


def warmed(rng: np.random.Generator, grown: float, temperatures: Warm) -> Drifts:
    """Measure three machines at temperatures [degC], whose lengths have grown by a share from the second one on."""
    own = [campaign().parameters[place] for place in campaign().own]
    lengths = np.array([p.nominal / p.prior if p.unit == "m" else 0.0 for p in own])
    measured = []
    for machine in (f"m{number}" for number in range(3)):
        truth = rng.standard_normal(COUNT)
        for number, temperature in enumerate(temperatures):
            true = truth + (grown * lengths if number else 0.0)
            how = OTHER if number else STRONG
            (row,) = rows(true[None], rng, how, names=[f"{machine}-{number}"], of=machine)
            measured.append(replace(row, date=f"2026-0{1 + 3 * number}-01", temperature=temperature))
    return drifts(kind_of(measured))


@pytest.mark.parametrize(
    ("grown", "temperatures"),
    [(2.3e-4, (None, None)), (-2.3e-4, (None, 20.0)), (2.3e-4, (20.0, 30.0)), (-1.15e-4, (30.0, 20.0))],
)
def test_few_fleets_that_are_only_warmer_or_colder_tell_a_change(grown: float, temperatures: Warm) -> None:
    rng = np.random.default_rng(1)
    fleets = [warmed(rng, grown, temperatures) for _ in range(20)]
    assert sum(bool(each.significant) for each in fleets) <= 4  # 1 is promised; chance gives 5 in 1 of 400 runs
    growths = [growth for each in fleets for growth in each.grown]
    assert len(growths) >= 57
    assert np.mean([growth.share for growth in growths]) == pytest.approx(grown, rel=0.1)
    assert {growth.warmer for growth in growths} == {None if None in temperatures else float(np.sign(grown)) * 10.0}


@pytest.mark.parametrize(
    ("grown", "temperatures"),
    [(2.3e-4, (20.0, 20.0)), (2.3e-4, (30.0, 20.0)), (9e-4, (None, None)), (6e-4, (20.0, 30.0))],
)
def test_growth_that_no_temperature_makes_is_told(grown: float, temperatures: Warm) -> None:
    found = warmed(np.random.default_rng(2), grown, temperatures)
    assert {"a_3", "d_4"} <= {drift.parameter for drift in found.significant}
    assert not found.grown


def test_a_temperature_that_was_not_recorded_at_every_campaign_explains_nothing_by_itself() -> None:
    found = warmed(np.random.default_rng(3), 2.3e-4, (20.0, None, 20.5))
    assert [growth.warmer for growth in found.grown] == [None] * 3


def test_machines_without_two_dates_are_named() -> None:
    rng = np.random.default_rng(8)
    truth = rng.standard_normal((1, COUNT))
    measured = rows(truth, rng, names=["a"], of="m") + rows(truth, rng, names=["b"], of="m", date="2026-01-01")
    fleet_drifts = drifts(kind_of(measured))
    assert fleet_drifts.undated == ("m",)
    assert not fleet_drifts.changes


def test_of_many_machines_the_surest_of_each_is_kept() -> None:
    rng = np.random.default_rng(9)
    fleet_drifts = campaigns(drawn(60, rng), (0, 6), rng, (STRONG, OTHER), changing(a_3=0.5, theta_offset_4=0.5))
    assert {drift.parameter for drift in fleet_drifts.significant} == {"a_3", "theta_offset_4"}
    assert (len(fleet_drifts.significant), len(fleet_drifts.changes), fleet_drifts.compared) == (120, 120, 60 * 19)


def test_another_robot_under_the_same_serial_number_is_suspected() -> None:
    rng = np.random.default_rng(10)
    truth = rng.standard_normal((3, COUNT))
    first, later = "2026-01-01", "2026-07-01"
    measured = [
        *rows(truth[:1], rng, names=["a"], of="m", date=first),
        *rows(truth[1:2], rng, names=["b"], of="m", date=later),
        *rows(truth[2:], rng, names=["c"], of="n", date=first),
        *rows(truth[2:], rng, names=["d"], of="n", date=later),
    ]
    fleet_drifts = drifts(kind_of(measured))
    assert fleet_drifts.others == ("m",)
    (notice,) = [each for each in analysis_notices(analysed(measured)) if each.code == "another-machine"]
    assert (notice.level, "of m changed" in notice.message) == ("warning", True)


# -- all that a fleet says ---------------------------------------------------------------------------------


def analysis_lines(analysis: Analysis) -> list[str]:
    return lines_of(analysis_blocks(analysis))


def series(robots: int, seed: int = 1, error: float = 5e-5) -> list[Row]:
    rng = np.random.default_rng(seed)
    judged = []
    for row in rows(rng.standard_normal((robots, COUNT)), rng):
        mean = error * float(np.exp(0.1 * rng.standard_normal()))
        accuracy = Accuracy(mean, 1.1 * mean, 2.0 * mean, 20)
        judged.append(replace(row, held_out=accuracy, nominal=Accuracy(2e-3, 2.2e-3, 4e-3, 20)))
    return judged


def test_robots_are_looked_at_in_the_order_of_their_reasons() -> None:
    fleet = series(20)
    worse = Accuracy(4e-4, 5e-4, 9e-4, 20)
    fleet[2] = replace(fleet[2], held_out=worse)
    fleet[4] = replace(fleet[4], errors=("wrong-robot",))
    fleet[6] = replace(fleet[6], fit_status="rank-loss")
    fleet[8] = replace(fleet[8], held_out=Accuracy(3e-3, 3e-3, 3e-3, 20))
    fleet[9] = Row("robot-10", "failed", "there is no reading", robot="")
    zero = fleet[11].parameters["theta_offset_3"]
    turned = {**fleet[11].parameters, "theta_offset_3": replace(zero, value=zero.value + np.radians(2.0))}
    fleet[11] = replace(fleet[11], parameters=FoundParameters.of(turned))
    analysis = analysed(fleet)
    why = {look.robot: [reason.why for reason in look.reasons] for look in analysis.looks}
    assert why == {
        "robot-10": ["failed"],
        "robot-5": ["error"],
        "robot-7": ["unsound"],
        "robot-9": ["not better", "inaccurate", "largest error"],
        "robot-3": ["inaccurate"],
        "robot-12": ["differs"],
    }
    assert list(why) == ["robot-10", "robot-5", "robot-7", "robot-9", "robot-3", "robot-12"]
    assert analysis.failed == (("robot-10", "there is no reading"),)
    text = "\n".join(analysis_lines(analysis))
    for words in (
        "not calibrated: there is no reading",
        "should not be used as it is (wrong-robot)",
        "the fit ended with rank-loss",
        "is more than before",
        "more than those of the others allow",
        "theta_offset_3 +",
        "Not calibrated: 1 of 20",
    ):
        assert words in text


def test_robots_that_are_all_alike_give_only_the_largest_error() -> None:
    alarms = sum(
        [reason.why for look in analysed(series(30, seed)).looks for reason in look.reasons] != ["largest error"]
        for seed in range(20)
    )
    assert alarms <= 5  # two questions of 5 % each


def test_a_machine_counts_once_with_its_last_measurement() -> None:
    first, second, other = series(3)
    first = replace(first, of="m", date="2026-05-01", held_out=Accuracy(1.0, 1.0, 1.0, 5))
    second = replace(second, of="m", date="2026-01-01", held_out=Accuracy(2.0, 2.0, 2.0, 5))
    analysis = analysed([first, second, other])
    assert (analysis.measurements, analysis.machines) == (3, 2)
    assert sorted(analysis.errors["held_out"].mean.tolist())[-1] == 1.0
    assert [analysis.kinds[0].kind.names[i] for i in analysis.kinds[0].kind.latest] == ["robot-1", "robot-3"]
    wrong = replace(first, errors=("wrong-units",))  # of a machine the last campaign without an error counts
    assert analysed([wrong, second]).errors["held_out"].mean.tolist() == [2.0]


def test_kinds_of_robots_are_compared_among_themselves() -> None:
    fleet = series(12) + [replace(row, name=f"{row.name}-b", robot="other") for row in series(4, 2)]
    analysis = analysed(fleet)
    assert [(kind.kind.robot, len(kind.kind.names)) for kind in analysis.kinds] == [("irb120", 12), ("other", 4)]
    begin = "other: Parameters of 4 robots compared with their priors"
    assert any(line.startswith(begin) for line in analysis_lines(analysis))


def test_notices_say_what_figures_do_not() -> None:
    rng = np.random.default_rng(5)
    truth = 0.2 * rng.standard_normal((6, COUNT))
    truth[2, NAMES.index("theta_offset_3")] = 20.0
    drifted = truth.copy()
    drifted[:, NAMES.index("a_3")] += 1.0
    fleet = []
    for i in range(6):
        fleet += rows(truth[i : i + 1], rng, names=[f"r{i}"], of=f"m{i}", date="2026-01-01")
        fleet += rows(drifted[i : i + 1], rng, names=[f"r{i}-again"], of=f"m{i}", date="2026-07-01")
    fleet += rows(truth[:1], rng, names=["x"], of="u") + rows(truth[:1], rng, names=["y"], of="u")
    notices = {notice.code: notice for notice in analysis_notices(analysed(fleet))}
    assert {code: notice.level for code, notice in notices.items()} == {
        "robots-differ": "warning",
        "robots-drift": "warning",
        "drift-alike": "warning",
        "drift-undated": "note",
    }
    assert "r2-again" in notices["robots-differ"].message
    assert "6 machines" in notices["robots-drift"].message
    assert "a_3" in notices["drift-alike"].message
    assert "Correct the dates" in notices["drift-undated"].message


def test_json_holds_figures_in_mm_and_deg() -> None:
    content = json_of(analysis_blocks(analysed(series(12))))
    (kind,) = content["kinds"]
    parameters = {row["name"]: row for row in kind["parameters"]}
    assert parameters["a_3"]["unit"] == "mm"
    assert parameters["a_3"]["prior"] == pytest.approx(1.0)
    assert 0.3 < parameters["a_3"]["spread"] < 3.0
    assert parameters["theta_offset_3"]["prior"] == pytest.approx(0.1)
    assert parameters["d_2"]["spread"] is None
    assert content["errors_mm"]["held_out"]["of_means"][0]["value"] == pytest.approx(0.05, rel=0.2)
    assert content["errors_mm"]["held_out"]["of_means"][3]["value"] is None


def test_a_fleet_without_any_result_and_a_series_beside_nominal_say_so() -> None:
    analysis = analysed([Row("a", "failed", "no"), Row("b", "failed", "no")])
    assert not analysis.kinds
    assert not analysis.errors
    assert analysis_lines(analysis)[0].startswith("Not calibrated: 2 of 2; of such a series 15.8 to 100 %")
    rng = np.random.default_rng(6)
    truth = drawn(20, rng, 0.3)
    truth[:, NAMES.index("d_4")] += 2.0
    (line,) = (each for each in analysis_lines(analysed(rows(truth, rng))) if "beside nominal" in each)
    assert line.startswith("  The whole series lies beside nominal: d_4 +")


def test_results_that_end_with_an_error_are_in_no_figure() -> None:
    fleet = series(12)
    whole = analysed([row for number, row in enumerate(fleet) if number != 4])
    wrong = {
        name: replace(parameter, value=parameter.value + 50.0 * parameter.prior)
        for name, parameter in fleet[4].parameters.items()
    }
    fleet[4] = replace(
        fleet[4],
        errors=("wrong-units",),
        parameters=FoundParameters.of(wrong),
        held_out=Accuracy(1.0, 1.0, 2.0, 20),
        nominal=Accuracy(2.0, 2.0, 3.0, 20),
    )
    analysis = analysed(fleet)
    assert (analysis.left_out, analysis.measurements, whole.left_out) == (("robot-5",), 12, ())
    for name, errors in whole.errors.items():
        assert analysis.errors[name].mean.tolist() == errors.mean.tolist()
    assert analysis.kinds[0].spreads == whole.kinds[0].spreads
    assert analysis.kinds[0].differences == whole.kinds[0].differences
    first = analysis.looks[0]
    assert (first.robot, [reason.why for reason in first.reasons]) == ("robot-5", ["error"])
    line = "Left out of all figures, because their results end with an error: 1 robot (robot-5)."
    assert line in analysis_lines(analysis)
    assert json_of(analysis_blocks(analysis))["left_out"] == ["robot-5"]


# -- pictures: of few robots every value, of many no more than a picture needs -------------------------------------


def fleet(robots: int, off: float = 12.0, worst: float = 1.0) -> Analysis:
    rng = np.random.default_rng(1)
    truth = rng.standard_normal((robots, COUNT))
    truth[1, NAMES.index("theta_offset_3")] = off
    errors = rng.uniform(4e-5, 6e-5, robots)
    errors[1] *= worst
    return analysed(
        replace(row, held_out=Accuracy(e, e, 2 * e, 9), nominal=Accuracy(2e-3, 2e-3, 4e-3, 9))
        for row, e in zip(rows(truth, rng), errors.tolist(), strict=True)
    )


@pytest.mark.parametrize("robots", [4, 12, 60])
def test_a_robot_a_thousand_times_off_does_not_hide_the_others(robots: int) -> None:
    figures = fleet_figures(fleet(robots, 1000.0, 1000.0))
    parameters = figures["parameters"]
    marked = next(trace for trace in parameters["data"] if trace.get("name") == "differs")
    far = marked["text"].index("robot-2")
    assert (marked["x"][far], marked["marker"]["symbol"][far]) == ("theta_offset_3", "triangle-up")
    assert marked["customdata"][far] == pytest.approx(1000.0, rel=0.05)
    drawn = [abs(y) for trace in parameters["data"] if trace["type"] == "scatter" for y in trace["y"]]
    assert max(drawn) < 12.0
    assert parameters["layout"]["yaxis"]["title"]["text"].endswith("triangles: beyond (robot-2)")
    assert figures["accuracy"]["layout"]["yaxis"]["type"] == "log"
    if robots > 10:
        histogram = figures["histogram"]
        assert max(histogram["data"][0]["x"]) < 0.07
        assert sum(histogram["data"][0]["y"]) == robots - 1
        assert histogram["layout"]["annotations"][0]["text"].startswith("beyond: robot-2 ")


def test_values_that_lie_together_are_all_drawn_at_their_places() -> None:
    figures = fleet_figures(fleet(12, 3.0))
    assert "beyond" not in figures["parameters"]["layout"]["yaxis"]["title"]["text"]
    assert figures["histogram"]["layout"]["annotations"] == []


def test_of_three_robots_every_value_is_drawn() -> None:
    figures = fleet_figures(fleet(3))
    assert set(figures) == {"accuracy", "parameters"}
    assert [len(trace["x"]) for trace in figures["accuracy"]["data"]] == [3, 3]
    marked = figures["parameters"]["data"][-1]
    assert (marked["name"], marked["x"], marked["text"]) == ("differs", ["theta_offset_3"], ["robot-2"])
    assert marked["y"][0] == pytest.approx(12.0, abs=0.5)


def test_of_many_robots_the_pictures_stay_small() -> None:
    figures = fleet_figures(fleet(2000))
    assert set(figures) == {"accuracy", "histogram", "parameters", "spread"}
    assert len(json.dumps(figures)) < 30_000
    assert sum(figures["histogram"]["data"][0]["y"]) == 2000
    box, marked = figures["parameters"]["data"]
    assert box["type"] == "box"
    assert box["median"][box["x"].index("a_3")] == pytest.approx(0.0, abs=0.1)
    assert box["upperfence"][box["x"].index("a_3")] == pytest.approx(1.96, abs=0.15)
    assert marked["text"] == ["robot-2"]
    spread = dict(zip(figures["spread"]["data"][0]["x"], figures["spread"]["data"][0]["y"], strict=True))
    assert spread["a_3"] == pytest.approx(1.0, abs=0.06)
    assert "d_2" not in spread


def test_changes_are_drawn_in_their_unit() -> None:
    rng = np.random.default_rng(2)
    truth = rng.standard_normal((1, COUNT))
    later = truth.copy()
    later[0, NAMES.index("theta_offset_4")] += 2.0
    measured = [
        *rows(truth, rng, names=["a"], of="<m>", date="2026-01-01"),
        *rows(later, rng, names=["b"], of="<m>", date="2026-07-01"),
    ]
    figures = fleet_figures(analysed(measured))
    marks, line = figures["drift-angles"]["data"]
    legend = figures["drift-angles"]["layout"]["legend"]
    assert (legend["yref"], legend["y"]) == ("container", 0)  # the toolbar is at the top
    assert marks["name"] == "&lt;m&gt;, theta_offset_4"
    assert marks["y"][-1] == pytest.approx(0.2, abs=0.01)
    assert marks["error_y"]["array"][0] == 0.0
    assert line["y"][-1] == pytest.approx(0.2, abs=0.01)
    assert all("no more than chance" in t["name"] for t in figures["drift-lengths"]["data"] if "name" in t)
