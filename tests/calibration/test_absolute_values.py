"""Sums of absolute values: with priors and without, without anything dropped, and their deviations by bootstrap."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.simulated import campaign

from papers.li_table.arm import BOUNDS, CAMERA, TIP, arm, believed, board, fit, tables, touched_by_hand, truth
from truearm.calibration.calibrate import calibrate
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.fit.fit import Fit, Status, identify, refit_draws
from truearm.engine.fit.fixed_places import FixedPlaces
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import find_parameters
from truearm.engine.fit.solver import least_absolute, solve
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.devices.calibration_table import CalibrationTable
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.jobs import simulate

KNOWN = FixedPlaces(IDENTITY, {TIP: IDENTITY})
LOSSES: dict[str, Any] = {"l1": "distances", "l1-components": "components"}
OFFSETS, GEOMETRIC = named_model("offsets"), named_model("geometric")


@cache
def rolled(seed: int = 3) -> tuple[Robot, Dataset]:
    """Return Li's arm as a twin, and what its rolled table reads in the base frame."""
    rng = np.random.default_rng(seed)
    twin = truth(arm(), rng)
    table = CalibrationTable(tables(board())["roll"].in_world)
    return twin.robot, touched_by_hand(table, twin, rng)


def bounded(loss: Any, **more: Any) -> Fit:
    return identify(
        believed(arm()), rolled()[1], GEOMETRIC, loss=loss, redundancy="none", bounds=BOUNDS, fixed=KNOWN, **more
    )


def test_the_documents_fit_is_the_studys_and_each_sum_is_least_for_its_own_loss() -> None:
    _, data = rolled()
    left = {}
    for loss, objective in LOSSES.items():
        result, of_study = bounded(loss).robot, fit(arm(), data, objective, True)
        joints = result.random_configurations(50, np.random.default_rng(0))
        np.testing.assert_allclose(result.world_poses(joints, TIP)[0], of_study.world_poses(joints, TIP)[0], atol=2e-7)
        left[loss] = result.world_poses(data.joints, TIP)[0] - data.position
    assert np.linalg.norm(left["l1"], axis=1).sum() < np.linalg.norm(left["l1-components"], axis=1).sum()
    assert np.abs(left["l1-components"]).sum() < np.abs(left["l1"]).sum()


def test_single_coordinates_with_priors_are_weighed_one_by_one() -> None:
    """The minimum of the sum of absolute coordinates and half the squares of the priors: no direction is downhill."""
    robot = arm()
    rng = np.random.default_rng(5)
    data = measure(Twin(robot), robot.random_configurations(25, rng), 2e-3, rng)
    names = ("theta_offset_1", "theta_offset_2", "a_2", "theta_offset_3", "a_3")
    problem = Problem(robot, data, FreeParameters(tuple(robot.parameters[n] for n in names)), {"position": 2e-3})
    of_one = 2.7955 / 1.9600  # how a loss counts a single number beside readings of three

    def cost(x: np.ndarray) -> float:
        return float(
            of_one * np.abs(problem.residual(x)).sum() / of_one**2 + 0.5 * np.sum(problem.prior_rows(x)[0] ** 2)
        )

    result = solve(problem, "l1-components")
    assert result.converged
    steps = rng.standard_normal((60, len(names))) * problem.free.prior * 1e-2
    assert all(cost(result.vector) < cost(result.vector + step) for step in steps)
    assert np.abs(result.vector - solve(problem, "l1").vector).max() > 1e-6


def test_linear_programs_agree_with_reweighting_where_priors_are_wide() -> None:
    _, data = rolled()
    free = FreeParameters(tuple(replace(p, prior=1e3 * p.prior) for p in (arm().parameters[n] for n in ("a_2", "a_3"))))
    problem = Problem(arm(), data, free, {"position": CAMERA})
    solved, converged, _ = least_absolute(replace(problem, priors=False))
    assert converged
    np.testing.assert_allclose(solve(problem, "l1-components").vector, solved.vector, atol=2e-6)


# -- without priors, nothing dropped ------------------------------------------------------------------------------


def test_what_neither_readings_nor_bounds_determine_is_a_loss_of_rank() -> None:
    """The slides along two parallel axes: no reading tells them apart, and without bounds nothing else does."""
    robot = arm()
    rng = np.random.default_rng(2)
    data = measure(Twin(robot), robot.random_configurations(25, rng), 0.1e-3, rng)
    alone = identify(robot, data, GEOMETRIC, redundancy="none", fixed=KNOWN)
    assert alone.status is Status.RANK_LOSS
    assert {"d_2", "d_3"} <= set(alone.unobservable)
    assert alone.parameter_status("d_2") == "not-determined"
    assert not alone.redundancies
    within = identify(robot, data, GEOMETRIC, redundancy="none", fixed=KNOWN, bounds=BOUNDS)
    assert within.status in (Status.CONVERGED, Status.AT_BOUND)
    # Nothing is known worse than if it were anywhere between its bounds.
    lengths = [i for i, p in enumerate(within.free.parameters) if p.unit == "m"]
    assert np.sqrt(np.diag(within.covariance)[lengths]).max() < 1.01 * 10e-3 / np.sqrt(12.0)


# -- bootstrap ----------------------------------------------------------------------------------------------------


def test_draws_depend_on_their_seed_alone() -> None:
    _, data = rolled()
    solved = find_parameters(believed(arm()), data, OFFSETS, loss="l1", fixed=KNOWN)
    messages: list[str] = []
    first, again, other = (refit_draws(solved, "l1", 20, seed, messages.append) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)
    assert messages[0] == "bootstrap [....................] 1 of 20"
    assert messages[19] == "bootstrap [###################.] 20 of 20"


def test_a_bootstrap_and_the_residuals_say_about_the_same_of_least_squares() -> None:
    data = campaign("irb120", 40, 0.1e-3, 4)[1]
    plain = identify(load_robot("irb120"), data, OFFSETS)
    drawn = identify(load_robot("irb120"), data, OFFSETS, bootstrap=60)
    assert drawn.robot.values == plain.robot.values
    zeros = [i for i, name in enumerate(plain.free.names) if name.startswith("theta")]
    ratio = np.sqrt(np.diag(drawn.covariance)[zeros] / np.diag(plain.covariance)[zeros])
    assert np.all((ratio > 0.6) & (ratio < 1.6))


def test_intervals_of_a_bootstrap_hold_what_they_say() -> None:
    """95 of 100 intervals, within three deviations; of sums of absolute values see docs/simulations.md."""
    robot = arm()
    inside = []
    for trial in range(30):
        rng = np.random.default_rng((trial, 7))
        data = measure(Twin(robot), robot.random_configurations(20, rng), 0.2e-3, rng)
        other_fit = identify(robot, data, OFFSETS, redundancy="none", fixed=KNOWN, bootstrap=20, seed=trial)
        for name in ("theta_offset_1", "theta_offset_2", "theta_offset_3"):
            p = other_fit.robot.parameters[name]
            inside.append(abs(p.value - robot.values[name]) <= 1.96 * known(p.deviation))
    assert np.mean(inside) == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / len(inside)))


def test_where_deviations_come_from_is_said(tmp_path: Path) -> None:
    data = campaign("irb120", 20, 0.1e-3, 3)[1]
    result = calibrate("irb120", data, model="offsets", loss="l1", bootstrap=20, out=tmp_path / "out")
    assert result.fit.bootstrap == 20
    words = "20 fits to configurations drawn anew (bootstrap)"
    assert f"Deviations of the parameters: from {words}" in result.lines()
    assert f"follow from {words}" in (tmp_path / "out" / "report.html").read_text()
    assert result.result()["noise"]["bootstrap"] == 20
    assert ", bootstrap 20" in result.history
    assert "bootstrap=20" in result.command
    assert "bootstrap" not in calibrate("irb120", data, model="offsets").result()["noise"]


def test_numbers_of_fits_that_say_nothing_are_refused() -> None:
    data = campaign("irb120", 20, 0.1e-3, 3)[1]
    for count, words in (
        (5, r"the number is out of range; got 5; allowed: 20 to 10000"),
        (True, r"a whole number belongs here"),
        (20_000, r"the number is out of range; got '20000 fits'; allowed: 10000 fits or fewer"),
    ):
        refused(None, words, calibrate, "irb120", data, bootstrap=count)
    words = r"too few training configurations to draw from; got 6; allowed: 10 or more"
    few = data.of_configurations(np.arange(8))
    refused(None, words, calibrate, "irb120", few, model="offsets", bootstrap=20)
    words = r"without priors, bounds and places that are held nothing tells base and joints"
    refused(None, words, calibrate, "irb120", data, redundancy="none")


def test_readings_that_are_met_exactly_do_not_pass_for_perfect() -> None:
    """As many distances as parameters: nearly all residuals are zero, and say nothing of the noise."""
    data = simulate("irb120", truth="random", device="sphere", poses=28, seed=3).data
    options: Any
    for options in LOSSES:
        other_fit = identify(load_robot("irb120"), replace(data, sigma=None), GEOMETRIC, loss=options)
        assert expected_error(other_fit).overall.mean > 0.1e-3, options
