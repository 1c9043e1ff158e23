"""The error to expect over the workspace: closed forms, true errors of simulated robots, and the notice it raises."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.special import chdtri, fdtri
from tests.expecting import known
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import error_by_order, expected_error, expected_map, moved_by_order
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.models import FRAMES, MODELS, Model
from truearm.engine.fit.variance_components import CovariancePart
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth

MODEL: Mapping[str, Model] = {m.name: m for m in (FRAMES, *MODELS)}
IRB120 = load_robot("irb120")
ARM = """truearm: truearm-robot/1
name: arm
units: {length: mm, angle: deg}
convention: standard-dh
joints:
  - {name: turn, a: 500, alpha: 0, d: 0, theta_offset: 0}
tools: {tip: {targets: {tip: [0, 0, 0]}}}
"""
SLIDE = ARM.replace(
    "{name: turn, a: 500, alpha: 0, d: 0, theta_offset: 0}",
    "{name: slide, type: prismatic, limits: [0, 800], a: 0, alpha: 0, d: 0, theta_offset: 0}",
)


def fitted(text: str, folder: Path) -> Fit:
    """Return the fit of an arm of one joint whose parameters are known exactly."""
    path = folder / "arm.yaml"
    path.write_text(text)
    robot = load_robot(path)
    rng = np.random.default_rng(0)
    data = measure(truth_twin(robot, "nominal", rng), robot.random_configurations(20, rng), 1e-5, rng)
    fit = identify(robot, data, MODEL["geometric"])
    return uncertain(fit)


def uncertain(fit: Fit, freedom: float = np.inf, **deviations: float) -> Fit:
    """Return a fit that knows some parameters only to so much [SI]."""
    covariance = np.diag([deviations.get(name, 0.0) ** 2 for name in fit.free.names])
    return replace(fit, covariance=covariance, covariance_parts=(CovariancePart(covariance, freedom),))


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    return fitted(ARM, tmp_path_factory.mktemp("arm"))


def test_closed_forms_of_one_joint(arm: Fit, tmp_path: Path) -> None:
    result = expected_error(uncertain(arm, theta_offset_1=1e-4)).overall  # it moves its target by the arm
    assert result.mean == pytest.approx(0.5e-4 * np.sqrt(2 / np.pi), rel=0.1)
    assert result.interval_90[0] == pytest.approx(0.5e-4 * 0.0627, rel=0.4)
    assert result.interval_90[1] == pytest.approx(0.5e-4 * 1.960, rel=0.15)
    assert result.p95 == pytest.approx(result.mean, rel=1e-3)
    result = expected_error(uncertain(arm, base_x=1e-4, base_y=1e-4, base_z=1e-4)).overall  # known alike in all
    assert result.mean == pytest.approx(1e-4 * np.sqrt(8 / np.pi), rel=0.1)
    np.testing.assert_allclose(result.interval_90, [0.593e-4, 2.795e-4], rtol=0.2)
    result = expected_error(uncertain(fitted(SLIDE, tmp_path), d_1=1e-4)).overall
    assert result.mean == pytest.approx(1e-4 * np.sqrt(2 / np.pi), rel=0.1)
    result = expected_error(uncertain(arm, theta_offset_1=1.0)).overall  # large angles go round
    angles = np.random.default_rng(1).standard_normal(100_000)
    assert result.mean == pytest.approx(float(np.mean(np.abs(np.sin(angles / 2)))), rel=0.1)
    assert result.interval_90[1] <= 1.0
    loop = replace(uncertain(arm, theta_offset_1=1e-4), gauge_freedoms=("base",))
    assert expected_error(loop).overall.mean < 1e-12  # a motion of everything does not count in a closed loop


def test_an_error_of_every_visit_is_in_the_error_to_expect_and_makes_it_a_lower_bound(arm: Fit) -> None:
    fit = replace(arm, joint_error=np.array([1e-4]), weight=np.ones(10**6))
    result = expected_error(fit)
    assert result.by_joint_error == pytest.approx(0.5e-4, rel=1e-3)
    assert result.overall.mean == pytest.approx(0.5e-4 * np.sqrt(2 / np.pi), rel=0.02)
    assert result.overall.p95 == pytest.approx(0.5e-4 * 1.960, rel=0.05)
    low, high = result.overall.interval_90
    assert result.overall.mean * 0.85 < low < high < result.overall.mean * 1.15
    assert result.lower_bound
    assert "the model cannot express" in result.omissions[0]


def test_joint_errors_count_as_far_as_the_residuals_allow() -> None:
    """Errors of a visit in all joints, found ten times too large."""
    twin, data = campaign("irb120", 40, 0.02e-3, 1)
    rng = np.random.default_rng(0)
    repeatability = np.radians(0.01)
    jogged = measure(twin, data.joints + repeatability * rng.standard_normal(data.joints.shape), 0.02e-3, rng)
    data = replace(data, position=jogged.position)
    fit = identify(IRB120, data, MODEL["geometric"])
    true = replace(fit, joint_error=np.full(6, repeatability), sigma={"position": 0.02e-3})
    np.testing.assert_allclose(as_residuals_allow(true, data).joint_error, repeatability, rtol=0.25)
    large = replace(true, joint_error=10 * true.joint_error)
    np.testing.assert_allclose(as_residuals_allow(large, data).joint_error, repeatability, rtol=0.35)
    assert not as_residuals_allow(replace(large, sigma={"position": 1.0}), data).joint_error.any()


def test_noise_that_was_estimated_widens_the_interval(arm: Fit) -> None:
    """A length of three normal numbers with a variance of 4 degrees of freedom: the square is 3 F."""
    fit = uncertain(arm, freedom=4, base_x=1e-4, base_y=1e-4, base_z=1e-4)
    low, high = expected_error(fit).overall.interval_90
    assert low == pytest.approx(1e-4 * np.sqrt(3 * fdtri(3, 4, 0.05)), rel=0.3)
    assert high == pytest.approx(1e-4 * np.sqrt(3 * fdtri(3, 4, 0.95)), rel=0.15)
    # an error of the joints is known as well as its degrees of freedom say
    fit = replace(arm, joint_error=np.array([1e-4]), joint_freedom=np.array([20.0]))
    low, high = expected_error(fit).overall.interval_90
    mean = 0.5e-4 * np.sqrt(2 / np.pi)
    assert low == pytest.approx(mean * np.sqrt(20 / chdtri(20, 0.05)), rel=0.03)
    assert high == pytest.approx(mean * np.sqrt(20 / chdtri(20, 0.95)), rel=0.05)


def test_parameters_are_uncertain_together_with_the_error_of_the_joints_that_they_are_found_by(arm: Fit) -> None:
    """The same variance stands behind both: where it is larger, both are."""
    fit = uncertain(arm, freedom=8, theta_offset_1=1e-4)
    part = fit.covariance_parts[0]
    nothing = replace(part, covariance=0.0 * part.covariance)
    fit = replace(fit, joint_error=np.array([1e-4]), joint_freedom=np.array([8.0]))
    alone = expected_error(replace(fit, covariance_parts=(nothing, part))).overall.interval_90
    together = expected_error(replace(fit, covariance_parts=(nothing, replace(part, joints=(0,))))).overall.interval_90
    assert together[1] - together[0] > 1.03 * (alone[1] - alone[0])


def test_what_makes_it_a_lower_bound(arm: Fit) -> None:
    fit = uncertain(arm, base_x=1e-4)
    assert not expected_error(fit).lower_bound
    for changed, words in (
        (replace(fit, status=Status.NOT_CONVERGED), "did not converge"),
        (replace(fit, model=FRAMES), "geometry counts as exact"),
        (replace(fit, at_bound=("a_1",)), "values at a bound"),
        (replace(fit, excess=2.0), "the residuals are larger than the declared deviations"),
    ):
        (omission,) = expected_error(changed).omissions
        assert words in omission
    bare = calibrate(IRB120, campaign("irb120", 30, 0.02e-3, 1, "nominal")[1], model="frames").expected
    assert (bare.lower_bound, bare.omissions[0]) == (True, "the robot's own geometry counts as exact")
    _, data = campaign("irb120", 30, 0.02e-3, 1)
    result = calibrate(IRB120, replace(data, position=data.position * 1e3), model="geometric")
    assert result.status is Status.IMPLAUSIBLE
    assert "what was fitted cannot be this robot" in result.expected.omissions
    assert "narrow-data" not in {n.code for n in result.warnings}


def test_what_is_left_is_not_said_to_be_the_robots_where_readings_are_doubted() -> None:
    _, data = campaign("irb120", 30, 0.02e-3, 1)
    position = data.position.copy()
    position[[5, 50]] += [[0.02], [0.01]]
    off = calibrate(IRB120, replace(data, position=position), model="geometric")
    assert "outliers" in {n.code for n in off.warnings}
    (words,) = off.expected.omissions
    assert words.startswith("readings are doubted")
    (declared,) = calibrate(
        IRB120, replace(data, sigma=np.full(len(position), 4e-6)), model="geometric"
    ).expected.omissions
    assert declared.startswith("the residuals are larger than the declared deviations")
    assert all("the robot does" not in word for word in (words, declared))


def narrowed(degrees: float) -> Robot:
    """Return an IRB 120 that stays within so much of one posture."""
    centre = np.array([10.0, 20.0, 10.0, 20.0, 40.0, 10.0])
    limits = np.radians([centre - degrees, centre + degrees]).T
    joints = zip(IRB120.joints, limits.tolist(), strict=True)
    return replace(IRB120, joints=tuple(replace(joint, limits=tuple(pair)) for joint, pair in joints))


@cache
def read_narrowly(degrees: float, seed: int) -> tuple[Twin, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(IRB120, "random", rng)
    return twin, measure(twin, narrowed(degrees).random_configurations(60, rng), 0.02e-3, rng)


def true_error(fit: Fit, twin: Twin) -> float:
    rng = np.random.default_rng(99)
    unseen = measure(twin, IRB120.random_configurations(100, rng), 0.0, rng)
    return known(errors_of(fit.robot, unseen).position).mean


def test_true_errors_are_as_expected() -> None:
    for degrees in (5.0, 40.0):
        ratios, inside = [], []
        for seed in range(10):
            twin, data = read_narrowly(degrees, seed)
            fit = identify(IRB120, data, MODEL["geometric"])
            result, true = expected_error(fit).overall, true_error(fit, twin)
            ratios.append(true / result.mean)
            inside.append(result.interval_90[0] <= true <= result.interval_90[1])
        assert 0.7 < np.median(ratios) < 1.4, degrees
        assert np.mean(inside) >= 0.7, degrees
    ratios = []  # parameters that were held are uncertain too
    for seed in range(4):
        twin, data = read_narrowly(5.0, seed)
        fit = identify(IRB120, data, MODEL["geometric"], redundancy="drop")
        ratios.append(true_error(fit, twin) / expected_error(fit).overall.mean)
    assert 0.4 < np.median(ratios) < 2.5


def test_each_target_has_its_own_figures_and_all_are_in_the_overall_one() -> None:
    _, data = read_narrowly(40.0, 0)
    result = expected_error(identify(IRB120, data, MODEL["geometric"]))
    assert list(result.targets) == ["1", "2", "3"]
    assert np.mean([target.mean for target in result.targets.values()]) == pytest.approx(result.overall.mean)
    assert result.frame == "the instrument's frame"
    assert result.overall.interval_90[0] < result.overall.mean < min(result.overall.interval_90[1], result.overall.p95)


def test_a_map_is_dark_where_nothing_was_measured() -> None:
    _, data = read_narrowly(15.0, 0)
    fit = identify(IRB120, data, MODEL["geometric"])
    places, error = expected_map(fit, 900)
    assert places.shape == (900, 3)
    assert error.shape == (900,)
    measured = fit.robot.forward(data.joints, target="2")[0].mean(axis=0)
    near = np.argsort(np.linalg.norm(places - measured, axis=1))
    assert error[near[:50]].mean() < 0.8 * error[near[-200:]].mean()


def calibrated(degrees: float | None, train: str | None = None) -> Calibration:
    data = read_narrowly(degrees, 3)[1] if degrees else campaign("irb120", 60, 0.02e-3, 3)[1]
    return calibrate(IRB120, data, train=train, model="geometric")  # type: ignore[arg-type]


def test_narrow_data_are_an_error_that_names_the_joints() -> None:
    result = calibrated(5.0)
    (notice,) = (n for n in result.warnings if n.code == "narrow-data")
    assert notice.level == "error"
    assert not result.finished
    assert result.status is Status.CONVERGED
    assert "where the held-out error is 0.03" in notice.message
    for joint in IRB120.joints:
        assert f"{joint.name} (measured " in notice.message
    assert "axis_2 (measured 16 to 24 deg, limits -110 to 110)" in notice.message
    (notice,) = (n for n in calibrated(5.0, "all").warnings if n.code == "narrow-data")
    assert "where the training error is 0.0" in notice.message
    # less narrow data are a warning
    rng = np.random.default_rng(3)
    twin = truth_twin(IRB120, "random", rng)
    narrow = replace(twin, robot=twin.robot.with_frames(twin.robot.base, {"1": (0.0, 0.0, 0.125)}))
    data = measure(narrow, narrowed(40.0).random_configurations(60, rng), 0.02e-3, rng)
    result = calibrate(IRB120, data, model="geometric")
    (notice,) = (n for n in result.warnings if n.code == "narrow-data")
    assert notice.level == "warning"
    assert result.finished


def test_data_of_one_orientation_name_a_region() -> None:
    """All joints move over half of their limits, but always so that the targets look the same way."""
    rng = np.random.default_rng(3)
    twin = truth_twin(IRB120, "random", rng)
    q = IRB120.random_configurations(10_000, rng)
    places, turned = IRB120.forward(q)
    near = np.argsort(-np.einsum("nij,ij->n", turned, turned[0]))[:80]
    alike = IRB120.inverse(places[near], np.repeat(turned[:1], len(near), axis=0), seed=q[near]).joints
    alike = alike[np.isfinite(alike).all(axis=1)][:60]
    assert (np.ptp(alike, axis=0) > 0.5 * np.minimum(2 * np.pi, [np.ptp(j.range) for j in IRB120.joints])).all()
    result = calibrate(IRB120, measure(twin, alike, 0.02e-3, rng), model="geometric")
    (notice,) = (n for n in result.warnings if n.code == "narrow-data")
    assert "also with targets about" in notice.message


def test_data_of_the_whole_workspace_and_without_noise_are_not_called_narrow() -> None:
    for seed in range(2):
        result = calibrate(IRB120, campaign("irb120", 60, 0.02e-3, seed)[1], model="geometric")
        assert "narrow-data" not in {n.code for n in result.warnings}
        assert result.expected.overall.mean < known(known(result.validation).position).mean
    result = calibrate(IRB120, campaign("irb120", 40, 0.0, 1)[1], model="geometric")
    assert "narrow-data" not in {n.code for n in result.warnings}


def test_a_closed_loop_is_expected_up_to_its_gauge_freedoms() -> None:
    rng = np.random.default_rng(0)
    twin = truth_twin(IRB120, "random", rng)
    result = calibrate(IRB120, measured_with(named_device("gauges"), IRB120, twin, 60, rng), model="geometric")
    assert result.expected.frame.startswith("the robot's base frame, up to its pose")
    (notice,) = (n for n in result.warnings if n.code == "closed-loop")
    assert f"accurate to about {result.expected.overall.mean * 1e3:.2g} mm" in notice.message
    assert "narrow-data" not in {n.code for n in result.warnings}


def test_what_follows_the_order_is_expected_of_predictions_that_do_not_know_it() -> None:
    rng = np.random.default_rng(3)
    joints = {1: JointTruth(hysteresis=math.radians(0.01), warm_up=6e-4), 2: JointTruth(hysteresis=math.radians(0.01))}
    twin = replace(truth_twin(IRB120, "nominal", rng), joints=joints)
    data = measure(twin, IRB120.random_configurations(60, rng), 1e-6, rng)
    fit = identify(IRB120, data, MODEL["geometric"].also(["approach", "warm-up"]))
    by_order = moved_by_order(fit.robot, data)
    np.testing.assert_allclose(by_order, [*[math.radians(0.01)] * 2, 0, 0, 0, 0], atol=1e-5)
    numbers = rng.integers(0, 60, 60).astype(float)
    other = measure(twin, IRB120.random_configurations(60, rng), 0.0, rng, number=numbers)
    known_order = errors_of(fit.robot, other).position_norms.mean()
    unknown = float(errors_of(fit.robot, replace(other, number=None, approach=None)).position_norms.mean())
    low, high = expected_error(fit, by_order=by_order).overall.interval_90
    assert known_order < 0.1 * low < low < unknown < high
    assert error_by_order(fit.robot, data) == pytest.approx(unknown, rel=0.25)
    assert fit.unfitted == ("warm_up_left",)
    assert not moved_by_order(fit.robot, replace(data, approach=None)).any()
