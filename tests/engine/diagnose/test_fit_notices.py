"""What is said of a fit: its gain, its deviations and noise, how few its readings are, and what moved meanwhile."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import wilcoxon
from tests.expecting import known, refused
from tests.simulated import campaign

import truearm
from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.changes import find_change, notices_of_change
from truearm.engine.diagnose.gain import check_gain, signed_rank_probability
from truearm.engine.diagnose.narrow_data import FEW_READINGS, check_few_readings
from truearm.engine.diagnose.unmodelled import LeftOver, chi_squared_tail
from truearm.engine.diagnose.visits import check_sigma
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.engine.twin.twin import Twin
from truearm.importing.files import read_matrices

# -- whether it is better than the nominal robot -------------------------------------------------------------------


def test_the_probability_is_that_of_all_ways_to_choose_signs() -> None:
    for seed in range(4):
        d = np.random.default_rng(seed).integers(-4, 6, 10).astype(float)  # with zeros, and equal sizes
        d = d[d != 0.0]
        ranks = np.array([(np.abs(d) < size).sum() + ((np.abs(d) == size).sum() + 1) / 2 for size in np.abs(d)])
        reached = ranks[d > 0.0].sum()
        sums = [ranks[np.array(signs)].sum() for signs in product([False, True], repeat=len(d))]
        assert signed_rank_probability(d) == pytest.approx(np.mean(np.array(sums) >= reached - 1e-9)), seed
    for n in (100, 101, 300):
        d = np.random.default_rng(n).normal(0.15, 1.0, n)
        exact = wilcoxon(d, alternative="greater", method="exact").pvalue
        assert signed_rank_probability(d) == pytest.approx(exact, rel=0.05)
    assert signed_rank_probability(np.zeros(20)) == 1.0


def compared(old: Array, new: Array, joints: Array | None = None) -> list[tuple[str, str]]:
    """Return what is said of errors along x [mm], one at each configuration."""
    n = len(old)
    data = Dataset.of(np.arange(n)[:, None] if joints is None else joints, np.zeros((n, 3)))
    before, after = (Errors(n, size[:, None] * np.array([1e-3, 0.0, 0.0]), None) for size in (old, new))
    return [(notice.code, notice.level) for notice in check_gain(before, after, data)]


def test_pairs_tell_gain_loss_and_neither() -> None:
    old = np.linspace(0.5, 1.5, 20)
    assert compared(old, 0.9 * old) == []  # of unpaired errors nothing could be told
    assert compared(old, old) == [("no-gain", "warning")]
    assert compared(old, 1.05 * old) == [("no-gain", "warning")]
    assert compared(old, 1.2 * old) == [("worse-than-nominal", "error")]
    mixed = old * np.where(np.arange(20) % 2 == 0, 0.8, 1.2)
    assert compared(old, mixed) == [("no-gain", "warning")]
    # a few wrong readings, which both miss, do not decide
    old, wrong = np.linspace(0.5, 1.5, 30), np.where(np.arange(30) < 2, 100.0, 0.0)
    assert compared(old + wrong, 0.8 * old + 1.01 * wrong) == []
    assert compared(old + wrong, 1.5 * old + 0.99 * wrong) == [("worse-than-nominal", "error")]
    # nothing is claimed of few pairs
    for factor in (0.01, 100.0):
        assert compared(np.ones(6), np.full(6, factor)) == [("few-held-out", "note")]
    assert compared(np.ones(7), np.full(7, 0.01)) == []
    assert compared(np.ones(7), np.full(7, 100.0)) == [("worse-than-nominal", "error")]
    again = np.repeat(np.arange(6.0), 5)[:, None]  # visits of one posture share its errors
    assert compared(np.ones(30), np.full(30, 0.01), again) == [("few-held-out", "note")]


def test_a_robot_that_is_accurate_already_is_no_error() -> None:
    for seed in (5, 3):
        accurate = campaign("irb120", 40, 2e-5, seed, "nominal")[1]
        result = truearm.calibrate("irb120", accurate, model="geometric")
        assert [(n.code, n.level) for n in result.warnings] == [("no-gain", "warning")], seed
        assert (result.finished, result.faults) == (True, ("no-gain",)), seed
        assert truearm.calibrate("irb120", campaign("irb120", 40, 2e-5, seed)[1], model="geometric").faults == (), seed
    # without a held-out part or another robot nothing is compared
    codes = {notice.code for notice in truearm.calibrate("irb120", accurate, train="all", model="geometric").warnings}
    assert codes == {"nothing-held-out"}
    assert truearm.calibrate("irb120", accurate, model="frames").warnings == ()
    # one that was calibrated before is accurate already
    twin_data = campaign("irb120", 80, 2e-5, 3)[1]
    first, second = twin_data.of_configurations(np.arange(40)), twin_data.of_configurations(np.arange(40, 80))
    before = truearm.calibrate("irb120", first, model="geometric")
    assert before.faults == ()
    assert truearm.calibrate(before.robot, second, model="geometric").faults == ("no-gain",)
    assert truearm.calibrate("irb120", second, model="geometric").faults == ()


# -- declared deviations, and what is far from nominal -------------------------------------------------------------


def declaring(data: Dataset, factor: float) -> Dataset:
    return replace(data, sigma=known(data.sigma) * factor)


def judged(robot: str, data: Dataset) -> list[Notice]:
    return check_sigma(LeftOver.of(identify(load_robot(robot), data, named_model("geometric")), data))


def test_sigma_that_is_too_large_is_a_warning_and_an_error_where_it_holds_the_robot_at_its_priors() -> None:
    for poses in (12, 40):
        run = calibrate("irb120", declaring(campaign("irb120", poses, 0.02e-3, 0)[1], 1000.0), model="geometric")
        assert not run.finished
        (notice,) = [n for n in run.warnings if n.code == "sigma-too-large"]
        assert notice.level == "error"
        assert notice.message.startswith("The declared deviations (20 mm) are about ")
        assert "So the priors hold the robot near its nominal values" in notice.message
        times = float(notice.message.split("about ")[1].split(" times")[0])
        assert times == pytest.approx(1000.0, rel=0.15), poses
    (notice,) = judged("irb120", declaring(campaign("irb120", 40, 0.02e-3, 0)[1], 5.0))
    assert (notice.code, notice.level) == ("sigma-too-large", "warning")
    assert "deviations of the parameters are too large" in notice.message


def test_sigma_that_is_right_or_stated_with_some_reserve_is_left_alone() -> None:
    for seed, robot in enumerate(("irb120", "katana450", "ur10")):
        for factor in (0.2, 1.0, 1.5):
            assert judged(robot, declaring(campaign(robot, 15, 0.03e-3, seed)[1], factor)) == [], (robot, factor)
    data = campaign("irb120", 20, 0.02e-3, 0)[1]
    assert judged("irb120", replace(data, sigma=None)) == []
    few = data.of_configurations(np.arange(3))
    assert judged("irb120", declaring(few, 1000.0)) == []


def noted(robot: str, data: Dataset, redundancy: Redundant = "prior") -> list[Notice]:
    run = calibrate(robot, data, model="geometric", redundancy=redundancy)
    return [notice for notice in run.warnings if notice.code == "far-from-nominal"]


@pytest.mark.parametrize("robot", ["irb120", "ur10", "kr5", "katana450", "li3"])
def test_honest_robots_are_not_far_from_nominal(robot: str) -> None:
    assert noted(robot, campaign(robot, 12, 5e-5, 5)[1]) == []
    assert noted(robot, campaign(robot, 30, 5e-5, 5)[1], "drop") == []


def test_a_joint_that_was_mastered_badly_is_noted() -> None:
    data = campaign("irb120", 30, 5e-5, 5)[1]
    off = np.radians([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    (notice,) = noted("irb120", replace(data, joints=data.joints + off))
    assert notice.level == "note"
    assert notice.message.startswith("theta_offset_3 moved by more than 6 standard deviations of its prior.")
    assert "nominal values are those of its controller" in notice.message
    # and nothing where the robot is another one
    codes = {
        notice.code for notice in calibrate("irb120", campaign("irb1600", 30, 5e-5, 5)[1], model="geometric").warnings
    }
    assert "wrong-robot" in codes
    assert "far-from-nominal" not in codes


# -- few readings --------------------------------------------------------------------------------------------------


FINE = 0.02e-3


def in_turn(poses: int, seed: int, *, declared: bool) -> Dataset:
    """Return a campaign that reads one of three targets at each configuration."""
    data = campaign("ur5e", poses, FINE, seed)[1]
    position = np.where((data.configuration % 3 == data.target)[:, None], data.position, np.nan)
    return replace(data, position=position, sigma=data.sigma if declared else None)


def fitted(data: Dataset, loss: Loss = "linear") -> Fit:
    return identify(load_robot("ur5e"), data, named_model("geometric"), loss=loss)


@pytest.mark.parametrize("seed", [0, 5])
def test_a_fit_that_leaves_nothing_is_not_taken_for_one_without_noise(seed: int) -> None:
    """33 numbers for 41 parameters: the expected error was a ten thousandth of the true one, and the advice to stop."""
    twin = campaign("ur5e", 16, FINE, seed)[0]
    result = calibrate("ur5e", in_turn(16, seed, declared=False), seed=seed, model="geometric")
    q = load_robot("ur5e").random_configurations(100, np.random.default_rng(1))
    apart = [result.robot.world_poses(q, name)[0] - twin.robot.world_poses(q, name)[0] for name in ("1", "2", "3")]
    true = float(np.linalg.norm(apart, axis=2).mean())
    assert result.expected.overall.interval_90[1] > true
    assert result.expected.overall.mean > 0.1e-3
    (notice,) = [n for n in result.warnings if n.code == FEW_READINGS.code]
    assert notice.level == "warning"
    assert "The training readings are 33 numbers. The 41 parameters take up 3" in notice.message
    assert "no deviation is declared: it is assumed, 0.1 mm (position)" in notice.message
    assert result.next[0].code == "measure-more"
    assert "read more targets" in result.next[0].message
    assert not {"stop", "unexplained"} & {step.code for step in result.next}


def test_declared_deviations_are_never_made_smaller_by_what_is_left() -> None:
    """The covariance is that of the readings as declared, (J' J + K)^-1 with J whitened and K of the priors."""
    data = in_turn(9, 1, declared=True)
    fit = fitted(data)
    problem = Problem(fit.robot, data, fit.free, {})
    J = problem.linearised(np.array([fit.robot.values[name] for name in fit.free.names]))[1]
    expected = np.linalg.inv(J.T @ J + np.diag(fit.free.prior**-2.0))
    np.testing.assert_allclose(np.diag(fit.covariance), np.diag(expected), rtol=1e-3)
    (notice,) = check_few_readings(fit)
    assert "27 numbers" in notice.message
    assert "assumed" not in notice.message
    assert "sigma" not in notice.message
    # noise from few numbers is said to be uncertain
    (notice,) = check_few_readings(fitted(in_turn(13, 0, declared=False)))
    assert "so 6.1 are left to judge the fit by" in notice.message
    assert "The noise may be 1.9 times as large as is estimated" in notice.message
    assert "column sigma" in notice.message


def test_other_losses_say_nothing_of_so_few() -> None:
    losses: tuple[Loss, ...] = ("huber", "cauchy", "l1", "l1-components")
    for loss in losses:
        fit = fitted(in_turn(11, 0, declared=False), loss)
        assert fit.sigma["position"] >= 0.99e-4, loss
        (notice,) = check_few_readings(fit)
        assert (notice.level, "Use the linear loss" in notice.message) == ("error", True), loss
    # one that may meet readings exactly needs more of them than another
    data = campaign("irb120", 16, FINE, 3)[1]
    data = replace(data, position=np.where((data.target == 0)[:, None], data.position, np.nan))
    (notice,) = check_few_readings(identify(load_robot("irb120"), data, named_model("geometric"), loss="cauchy"))
    assert notice.level == "error"
    assert not check_few_readings(identify(load_robot("irb120"), data, named_model("geometric"), loss="huber"))


def test_readings_enough_are_no_notice() -> None:
    data = replace(campaign("ur5e", 11, FINE, 0)[1], sigma=None)
    fit = fitted(data)
    assert not check_few_readings(fit)
    assert fit.numbers == 99
    assert fit.spent == pytest.approx(33.0, abs=0.1)
    assert not fit.assumed
    # noise as large as what is assumed agrees with it, which stays: that is no want of readings
    data = replace(campaign("irb120", 30, 0.1e-3, 4)[1], sigma=None)
    fit = identify(load_robot("irb120"), data, named_model("geometric"))
    assert fit.sigma["position"] == pytest.approx(0.1e-3, rel=0.02)
    assert not fit.assumed
    assert not check_few_readings(fit)


def test_a_check_counts_the_numbers_and_says_to_measure_more() -> None:
    result = check("ur5e", in_turn(16, 0, declared=False))
    (notice,) = result.warnings[-1:]
    assert notice.code == FEW_READINGS.code
    assert "48 numbers, for 41 parameters of the geometric model" in notice.message
    codes = [step.code for step in result.next]
    assert (codes[-1], "calibrate" in codes) == ("measure-more", False)


def test_errors_that_the_fit_has_eaten_do_not_make_data_narrow() -> None:
    """With nothing held out the expected error of an honest campaign was many times what the fit had left."""
    whole = replace(campaign("irb120", 13, FINE, 3)[1], sigma=None)
    masked = replace(whole, position=np.where((whole.target == 0)[:, None], whole.position, np.nan))
    for poses, few in ((11, True), (13, False)):
        result = calibrate("irb120", masked.of_configurations(np.arange(poses)), train="all", model="geometric")
        codes = [notice.code for notice in result.warnings]
        assert (FEW_READINGS.code in codes) is few
        assert "narrow-data" not in codes


# -- what moved during a campaign ----------------------------------------------------------------------------------


FIRST_MOVED = 23


@cache
def honest() -> tuple[Twin, Dataset]:
    twin, data = campaign("irb120", 50, 0.05e-3, 3)
    return twin, replace(data, sigma=None, number=np.arange(50.0))


def notices_of(data: Dataset, robot: str = "irb120") -> list[Notice]:
    left = LeftOver.of(identify(load_robot(robot), data, named_model("geometric")), data)
    change = find_change(left)
    return [] if change is None else notices_of_change(left, change)


def moved_instrument(data: Dataset, shift: Array, turn: Array | None = None) -> Dataset:
    R = np.eye(3) if turn is None else rotation_from_vector(turn)
    late = data.configuration >= FIRST_MOVED
    return replace(data, position=np.where(late[:, None], data.position @ R.T + shift, data.position))


def test_a_moved_instrument_is_named_with_its_configuration_and_size() -> None:
    (notice,) = notices_of(moved_instrument(honest()[1], np.array([1.2e-3, -1.6e-3, 0.0])))
    assert (notice.code, notice.level) == ("instrument-moved", "error")
    size = re.match(f"From configuration {FIRST_MOVED + 1} on, all readings stand ([0-9.]+) mm", notice.message)
    assert float(known(size)[1]) == pytest.approx(2.0, rel=0.05)
    assert "`base_changes`" in notice.message
    (notice,) = notices_of(moved_instrument(honest()[1], np.array([0.0, 0.0, 0.16e-3])))
    assert (notice.code, notice.level) == ("instrument-moved", "warning")


def test_a_moved_target_is_named() -> None:
    twin, data = honest()
    _, R = twin.robot.world_poses(data.joints)
    late = (data.configuration >= FIRST_MOVED) & (data.target == 1)
    shift = R[data.configuration] @ np.array([0.0, 1e-3, 0.0])
    (notice,) = notices_of(replace(data, position=np.where(late[:, None], data.position + shift, data.position)))
    assert (notice.code, notice.level) == ("target-moved", "error")
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, target 2 stands 1")
    assert 0.9 < float(re.findall(r"stands ([0-9.]+) mm", notice.message)[0]) < 1.1


def test_a_jumped_joint_zero_is_named() -> None:
    _, data = honest()
    for joint in (1, 3, 6):
        joints = data.joints.copy()
        joints[FIRST_MOVED:, joint - 1] += np.radians(0.2)
        (notice,) = notices_of(replace(data, joints=joints))
        assert (notice.code, notice.level) == ("joint-zero-jumped", "error")
        match = known(re.search(r"From configuration (\d+) on, joint (\d) stands ([0-9.]+) deg off", notice.message))
        assert (int(match[1]), int(match[2])) == (FIRST_MOVED + 1, joint)
        assert 0.18 < float(match[3]) < 0.22


def test_a_drift_is_told() -> None:
    _, data = honest()
    along = (data.configuration / data.configurations)[:, None] * np.array([0.5e-3, 0.0, 0.0])
    (notice,) = notices_of(replace(data, position=data.position + along))
    assert (notice.code, notice.level) == ("drift", "warning")
    assert "Measure reference points" in notice.message


def test_nothing_is_told_of_honest_campaigns() -> None:
    for robot, seed in product(("irb120", "katana450", "kr5", "ur10"), range(3)):
        _, data = campaign(robot, 40, 0.05e-3, seed)
        assert notices_of(replace(data, number=np.arange(40.0)), robot) == [], (robot, seed)


def test_rows_in_another_order_say_the_same() -> None:
    data = moved_instrument(honest()[1], np.array([2e-3, 0.0, 0.0]))
    shuffled = data.of_configurations(np.random.default_rng(0).permutation(50))
    (notice,) = notices_of(shuffled)
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, all readings stand 1.9")
    assert notices_of(data.of_configurations(np.arange(FIRST_MOVED - 9, FIRST_MOVED + 9))) == []


def test_without_an_order_that_of_the_file_is_tried_unless_it_follows_a_joint() -> None:
    data = replace(honest()[1], number=None, approach=None)
    moved = moved_instrument(data, np.array([2e-3, 0.0, 0.0]))
    (notice,) = notices_of(moved)
    assert (notice.code, notice.level) == ("instrument-moved", "warning")
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, all readings stand 1.9")
    assert notice.message.endswith("the order of the file was taken for that of measurement. If it is, number them so.")
    assert notices_of(data) == []
    assert notices_of(moved.of_configurations(np.argsort(data.joints[:, 1]))) == []
    sorted_first = data.of_configurations(np.argsort(-data.joints[:, 1]))
    late = moved_instrument(sorted_first, np.array([2e-3, 0.0, 0.0]))
    assert notices_of(late) == []
    (notice,) = notices_of(replace(late, number=np.arange(float(late.configurations))))
    assert notice.level == "error"
    assert "Joint 2 moved on with the order of measurement" in notice.message


def test_measured_campaigns_show_no_change(measured_data: Path) -> None:
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")[0]
    left = LeftOver.of(identify(load_robot("irb120"), data, named_model("geometric")), data)
    assert find_change(left) is None


def test_tails_of_chi_squared() -> None:
    # Abramowitz and Stegun, table 26.8: quantiles of 1 %.
    for freedom, quantile in ((1, 6.63490), (2, 9.21034), (3, 11.3449), (6, 16.8119)):
        assert chi_squared_tail(quantile, freedom) == pytest.approx(0.01, rel=1e-4)


# -- a second base -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shift", "turn"), [((2e-3, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.0, 0.3, 0.2), (0.1, 0.5, -1.0))])
def test_a_second_base_cures_a_moved_instrument(shift: tuple[float, ...], turn: tuple[float, ...]) -> None:
    _, data = honest()
    steady = calibrate("irb120", data)
    moved = moved_instrument(data, np.array(shift), np.array(turn))
    assert not calibrate("irb120", moved).finished
    cured = calibrate("irb120", moved, base_changes=[str(FIRST_MOVED + 1)])
    assert cured.finished
    after, before = (known(each.validation).position_norms.mean() for each in (cured, steady))
    assert after <= 1.1 * before
    (notice,) = [n for n in cured.warnings if n.code == "base-changed"]
    assert notice.level == "note"
    assert f"from {FIRST_MOVED + 1} on by " in notice.message
    assert f"another base from {FIRST_MOVED + 1} on" in cured.robot.history[-1]
    assert "base_changes=" in cured.command


def test_what_cannot_be_a_change_of_the_base_is_refused_and_what_is_none_moves_nothing() -> None:
    data = honest()[1]
    for labels, words in (
        (["nowhere"], "there is no configuration of this name"),
        (["1"], "nothing was measured before the first configuration"),
        (["3"], "too few training configurations"),
        ([2.5], "a name belongs here"),
        ("24", "a sequence of names belongs here"),
    ):
        refused(None, words, calibrate, "irb120", data, base_changes=labels)
    orderless = replace(data, number=None, approach=None)
    refused(None, "the order of measurement is not known", calibrate, "irb120", orderless, base_changes=["24"])
    (notice,) = [
        n
        for n in calibrate("irb120", data, base_changes=["24"], model="geometric").warnings
        if n.code == "base-changed"
    ]
    assert float(re.findall(r"by ([0-9.]+) mm", notice.message)[0]) < 0.06
