"""Monte Carlo repeats a calibration: where all is linear it agrees with the covariance, and where not it says so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.expecting import known, refused
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.parts import simulated_block
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.simulated_calibrations import SimulatedCalibrations, check_linear, simulated_calibrations
from truearm.engine.document.document import lines_of
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import PLACES
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

ROBOT = load_robot("irb120")
MODEL = {model.name: model for model in MODELS}


def read(repeat: float = 0.0, poses: int = 40, seed: int = 1) -> tuple[Twin, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(ROBOT, "random", rng)
    joints = ROBOT.random_configurations(poses, rng)
    driven = joints + repeat * rng.standard_normal(joints.shape)
    return twin, replace(measure(twin, driven, 0.05e-3, rng), joints=joints)


def informed(fit: Fit, names: Sequence[str]) -> NDArray[np.bool_]:
    parameters = [fit.robot.parameters[name] for name in names]
    return np.array([p.group not in PLACES and (p.informed or 0.0) > 0.5 for p in parameters])


@pytest.mark.parametrize(("repeat", "redundancy"), [(0.0, "prior"), (1.5e-4, "prior"), (0.0, "drop")])
def test_where_all_is_linear_it_agrees_with_the_covariance(repeat: float, redundancy: Redundant) -> None:
    _, data = read(repeat)
    fit = identify(ROBOT, data, MODEL["geometric"], redundancy=redundancy)
    assert fit.joint_error.any() == bool(repeat)
    simulated = simulated_calibrations(fit, data, data, 400, priors=redundancy == "prior")
    assert simulated.settled == 400
    own = informed(fit, simulated.names)
    assert own.sum() > 15
    ratio = (simulated.deviation / simulated.linear_deviation)[own]
    assert 0.85 < ratio.min() < ratio.max() < 1.15
    assert 0.935 < simulated.coverage[own].mean() < 0.965
    held_out = known(simulated.held_out)
    assert held_out.mean == pytest.approx(held_out.linear_mean, rel=0.06)
    assert (simulated.workspace is None) == (redundancy == "drop")
    assert check_linear(fit, simulated) == []


def test_its_intervals_hold_the_truth() -> None:
    within, count = 0, 0
    for seed in range(4):
        twin, data = read(seed=seed)
        fit = identify(ROBOT, data, MODEL["geometric"])
        simulated = simulated_calibrations(fit, data, data, 200, priors=True, seed=seed)
        own = informed(fit, simulated.names)
        truth = np.array([twin.robot.values.get(name, np.nan) for name in simulated.names])
        low, high = simulated.interval_95.T
        known = own & np.isfinite(truth)
        within += int(((low <= truth) & (truth <= high))[known].sum())
        count += int(known.sum())
    assert count > 40
    assert 0.85 < within / count <= 1.0


def test_residuals_that_joints_do_not_explain_are_drawn_as_they_are() -> None:
    _, data = campaign("irb120", 60, 0.02e-3, 1, truth="tracker-triangular")
    fit = identify(ROBOT, data, MODEL["geometric"])
    assert fit.scattered
    simulated = simulated_calibrations(fit, data, data, 200, priors=True)
    ratio = (simulated.deviation / simulated.linear_deviation)[informed(fit, simulated.names)]
    assert 0.6 < ratio.min() < ratio.max() < 1.3


def test_lengths_alone_are_simulated_too() -> None:
    rng = np.random.default_rng(5)
    twin = truth_twin(ROBOT, "random", rng)
    data = measured_with(named_device("ballbar"), ROBOT, twin, 80, rng)
    fit = identify(ROBOT, data, MODEL["geometric"])
    simulated = simulated_calibrations(fit, data, data, 100, priors=True)
    assert simulated.settled == 100
    assert known(simulated.held_out).mean == pytest.approx(known(simulated.held_out).linear_mean, rel=0.3)


def test_intervals_that_are_too_narrow_and_lost_trials_are_told() -> None:
    _, data = read()
    fit = identify(ROBOT, data, MODEL["geometric"])
    simulated = simulated_calibrations(fit, data, data, 100, priors=True)

    def lost(factor: float, settled: int) -> SimulatedCalibrations:
        return replace(simulated, error=factor * simulated.error[:settled], stated=simulated.stated[:settled])

    codes = [(n.code, n.level) for n in check_linear(fit, lost(2.5, 100))]
    assert codes == [("intervals-too-narrow", "warning")]
    assert [n.code for n in check_linear(fit, lost(1.0, 90))] == ["trials-lost"]
    nothing = lost(1.0, 0)
    assert [n.code for n in check_linear(fit, nothing)] == ["trials-lost"]
    assert "none of 100 simulated calibrations" in lines_of([simulated_block(nothing, fit.robot)])[0]


def test_the_job_puts_both_intervals_side_by_side(tmp_path: Path) -> None:
    _, data = read()
    messages: list[str] = []
    run = calibrate(ROBOT, data, monte_carlo=100, out=tmp_path / "out", progress=messages.append)
    content = run.result()["monte_carlo"]
    assert (content["trials"], content["settled"], content["seed"]) == (100, 100, 0)
    row = next(row for row in content["parameters"] if row["name"] == "a_3")
    low, high = row["interval_95"]
    assert low < run.robot.values["a_3"] * 1e3 < high
    assert row["linear_interval_95"][1] - row["linear_interval_95"][0] == pytest.approx(
        3.919928 * row["linear_deviation"]
    )
    assert high - low == pytest.approx(3.92 * row["linear_deviation"], rel=0.3)
    assert 0.8 < content["coverage"] <= 1.0
    assert [words for words in messages if words.endswith("100 of 100") and "[####################]" in words]
    assert any(line.startswith("Monte Carlo: in 100 simulated") for line in run.lines())
    page = (tmp_path / "out" / "report.html").read_text()
    assert 'id="coverage"' in page
    assert 'id="intervals"' in page
    assert "monte_carlo=100" in run.command
    again = calibrate(ROBOT, data, monte_carlo=100).result()["monte_carlo"]
    assert again == content
    assert "monte_carlo" not in calibrate(ROBOT, data, model="geometric").result()


def test_what_cannot_be_simulated_is_refused_and_what_leaves_things_open_is_not_simulated() -> None:
    _, data = read()
    refused(None, "out of range; got 99; allowed: 100 to 100000", calibrate, ROBOT, data, monte_carlo=99)
    refused(None, "a whole number belongs here", calibrate, ROBOT, data, monte_carlo=1e3)
    words = r"other losses are for noise that is not normal.*the loss l1.*`loss`"
    refused(None, words, calibrate, ROBOT, data, monte_carlo=100, loss="l1")
    limits = {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}, "within": {"a_3": 1.0}}
    bounds = Bounds.model_validate(limits)
    refused(None, r"simulated without bounds.*`bounds` out", calibrate, ROBOT, data, monte_carlo=100, bounds=bounds)
    run = calibrate(ROBOT, data.of_configurations(range(3)), monte_carlo=100)
    assert (run.status.value, run.monte_carlo, "monte_carlo" in run.result()) == ("rank-loss", None, False)
    assert ("not-simulated", "note") in {(notice.code, notice.level) for notice in run.warnings}
