"""Readings that are hardly more numbers than parameters: what they cannot tell is assumed, and said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.narrow_data import FEW_READINGS, check_few_readings
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.library import load_robot

NOISE = 0.02e-3


def in_turn(poses: int, seed: int, *, declared: bool) -> Dataset:
    """Return a campaign that reads one of three targets at each configuration."""
    data = campaign("ur5e", poses, NOISE, seed)[1]
    position = np.where((data.configuration % 3 == data.target)[:, None], data.position, np.nan)
    return replace(data, position=position, sigma=data.sigma if declared else None)


def fitted(data: Dataset, loss: Loss = "linear") -> Fit:
    return identify(load_robot("ur5e"), data, named_model("geometric"), loss=loss)


@pytest.mark.parametrize("seed", [0, 5])
def test_a_fit_that_leaves_nothing_is_not_taken_for_one_without_noise(seed: int) -> None:
    """33 numbers for 41 parameters: the expected error was a ten thousandth of the true one, and the advice to stop."""
    twin = campaign("ur5e", 16, NOISE, seed)[0]
    found = calibrate("ur5e", in_turn(16, seed, declared=False), seed=seed)
    q = load_robot("ur5e").random_configurations(100, np.random.default_rng(1))
    apart = [found.robot.world_poses(q, name)[0] - twin.robot.world_poses(q, name)[0] for name in ("1", "2", "3")]
    true = float(np.linalg.norm(apart, axis=2).mean())
    assert found.expected.overall.interval_90[1] > true
    assert found.expected.overall.mean > 0.1e-3
    (notice,) = [n for n in found.warnings if n.code == FEW_READINGS]
    assert notice.level == "warning"
    assert "The training readings are 33 numbers. The 41 parameters take up 3" in notice.message
    assert "no deviation is declared: it is assumed, 0.1 mm (position)" in notice.message
    assert found.next[0].code == "measure-more"
    assert "read more targets" in found.next[0].message
    assert not {"stop", "unexplained"} & {step.code for step in found.next}


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
    data = campaign("irb120", 16, NOISE, 3)[1]
    data = replace(data, position=np.where((data.target == 0)[:, None], data.position, np.nan))
    (notice,) = check_few_readings(identify(load_robot("irb120"), data, named_model("geometric"), loss="cauchy"))
    assert notice.level == "error"
    assert not check_few_readings(identify(load_robot("irb120"), data, named_model("geometric"), loss="huber"))


def test_readings_enough_are_no_notice() -> None:
    data = replace(campaign("ur5e", 11, NOISE, 0)[1], sigma=None)
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
    found = check("ur5e", in_turn(16, 0, declared=False))
    (notice,) = found.warnings[-1:]
    assert notice.code == FEW_READINGS
    assert "48 numbers, for 41 parameters of the geometric model" in notice.message
    codes = [step.code for step in found.next]
    assert (codes[-1], "calibrate" in codes) == ("measure-more", False)


def test_errors_that_the_fit_has_eaten_do_not_make_data_narrow() -> None:
    """With nothing held out the expected error of an honest campaign was many times what the fit had left."""
    whole = replace(campaign("irb120", 13, NOISE, 3)[1], sigma=None)
    one = replace(whole, position=np.where((whole.target == 0)[:, None], whole.position, np.nan))
    for poses, few in ((11, True), (13, False)):
        found = calibrate("irb120", one.of_configurations(np.arange(poses)), train="all")
        codes = [notice.code for notice in found.warnings]
        assert (FEW_READINGS in codes) is few
        assert "narrow-data" not in codes
