"""Curves of joints: what they do for twins whose gears err."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.curves import check_curves
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.diagnose.narrow_data import check_narrow_data
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.effects.joint_curve import curve_names, curve_waves
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT, JointTruth

GEOMETRIC, ELASTIC = named_model("geometric"), named_model("elastic")
CURVED = GEOMETRIC.also(["joint-curve"])
NOISE = 2e-5
#: Of three joints: an eccentric wheel, an oval one, teeth and an encoder.
GEARS = {
    1: ((1, 3e-4, 0.3), (13, 2e-4, 1.0)),
    2: ((2, 2e-4, 2.0), (20, 2e-4, -1.0), (57, 1e-4, 0.5)),
    4: ((1, 2e-4, -2.0), (3, 2e-4, 0.1), (31, 2e-4, 1.2)),
}


def geared(truth: str = "random", seed: int = 1) -> Twin:
    twin = truth_twin(load_robot("irb120"), truth, np.random.default_rng(seed))
    more = {number: replace(twin.joints.get(number, PERFECT), gear=gear) for number, gear in GEARS.items()}
    return replace(twin, joints={**twin.joints, **more})


def campaign(twin: Twin, count: int, seed: int, spread: float = 1.0) -> Dataset:
    rng = np.random.default_rng(seed)
    return measure(twin, spread * load_robot("irb120").random_configurations(count, rng), NOISE, rng)


def mean_error(robot: Robot, data: Dataset) -> float:
    spread = errors_of(robot, data).position
    assert spread is not None
    return spread.mean


def test_curves_that_were_found_are_not_lost_where_noise_is_small() -> None:
    robot, rng = load_robot("ur5"), np.random.default_rng(4)
    twin = truth_twin(robot, "gear-errors", rng)
    data = measure(twin, robot.random_configurations(200, rng), 5e-6, rng)
    fit = identify(robot, data.of_configurations(np.arange(140)), named_model("geometric").also(["joint-curve"]))
    assert mean_error(fit.robot, data.of_configurations(np.arange(140, 200))) < 2e-5  # it was 0.05 mm and more


@pytest.fixture(scope="module")
def fitted() -> tuple[Twin, Dataset, Fit]:
    twin = geared()
    data = campaign(twin, 200, 11)
    return twin, data, identify(load_robot("irb120"), data, CURVED)


def test_gears_and_encoders_that_err_are_found(fitted: tuple[Twin, Dataset, Fit]) -> None:
    twin, data, fit = fitted
    fresh = campaign(twin, 200, 12)
    floor = 2.0 * math.sqrt(2.0 / math.pi) * NOISE  # mean length of noise in three coordinates
    assert fit.status is Status.CONVERGED
    assert mean_error(fit.robot, fresh) < 1.3 * floor
    assert mean_error(identify(load_robot("irb120"), data, GEOMETRIC).robot, fresh) > 3.0 * floor
    free = set(fit.free.names)
    assert {number for number in range(1, 7) if free & {*curve_names(number)}} == set(GEARS)
    assert len(free) < 400


def test_deviations_of_predictions_cover(fitted: tuple[Twin, Dataset, Fit]) -> None:
    twin, _, fit = fitted
    fresh = load_robot("irb120").random_configurations(200, np.random.default_rng(13))
    truth = np.array([posture.targets["1"][:3, 3] for posture in twin.postures(fresh)])
    kinematics = fit.robot.forward_kinematics(fresh, "1")
    J = fit.robot.position_jacobian(kinematics, fresh, fit.free.names)
    deviation = np.sqrt(np.einsum("pan,pq,qan->na", J, fit.covariance, J))
    off = np.abs(kinematics.position.T - truth) / deviation
    assert 0.88 < (off < 1.96).mean() <= 1.0


def test_nothing_is_said_of_single_coefficients(fitted: tuple[Twin, Dataset, Fit]) -> None:
    codes = {notice.code for notice in check_fit(fitted[2], expected_error(fitted[2]))}
    assert not codes & {"effects-uninformed", "too-many-effects", "effects-idle", "rank-loss"}


def test_outside_the_measured_range_the_curve_is_uncertain() -> None:
    twin = geared()
    data = campaign(twin, 150, 21, spread=0.35)
    fit = identify(load_robot("irb120"), data, CURVED)
    messages = {notice.code: notice.message for notice in check_curves(fit, data)}
    assert "axis_1 from -57 to 58 deg" in messages["curve-range"]
    assert "contains what that may be off by" in messages["curve-range"]
    names = [name for name in curve_names(1) if name in fit.free.names]
    places = [fit.free.names.index(name) for name in names]
    angle = np.radians([-30.0, 0.0, 30.0, 120.0, 150.0, 180.0])
    waves = curve_waves(angle, 60)[[curve_names(1).index(name) for name in names]]
    # Up to a constant, which is the joint's zero: what the curve does between two angles is compared.
    between = waves - waves[:, [1]]
    deviation = np.sqrt(np.einsum("kn,kl,ln->n", between, fit.covariance[np.ix_(places, places)], between))
    assert deviation[3:].min() > 3.0 * max(deviation[0], deviation[2])
    wide = campaign(twin, 200, 22)
    target = fit.robot.targets[0].name
    kinematics = fit.robot.forward_kinematics(wide.postures, target)
    J = fit.robot.position_jacobian(kinematics, wide.postures, fit.free.names)
    spread = np.sqrt(np.einsum("pan,pq,qan->na", J, fit.covariance, J))
    rows = wide.target == wide.targets.index(target)
    off = np.abs(wide.position[rows] - kinematics.position.T[wide.configuration[rows]])
    # Not all of it: through a third of a turn a line may be taken for its neighbour, which goes another way outside.
    assert ((off < 1.96 * np.hypot(spread, NOISE)[wide.configuration[rows]]).mean()) > 0.7


def test_the_expected_error_holds_where_a_joint_was_measured_through_a_sixth_of_its_turn() -> None:
    robot, rng = load_robot("ur5"), np.random.default_rng((1, 7))
    twin = truth_twin(robot, "gear-errors", np.random.default_rng(1001))
    joints = rng.uniform(-math.pi, math.pi, (150, 6))
    joints[:, 1] /= 6.0
    data = measure(twin, joints, 3e-5, rng)
    fit = identify(robot, data, CURVED)
    whole = expected_error(fit)
    stated = whole.overall
    true = mean_error(fit.robot, measure(twin, rng.uniform(-math.pi, math.pi, (300, 6)), 2e-9, rng))
    assert stated.interval_90[0] < true < stated.interval_90[1]  # it was said to be at most a third of the truth
    assert stated.interval_90[1] < 4.0 * true
    zero = [name for name in fit.unfitted if name.endswith("_2")]
    assert zero
    assert all(fit.robot.values[name] == 0.0 for name in zero)
    # The held-out error, which is hardly more than noise, does not show that the workspace is known much worse.
    errors = errors_of(fit.robot, measure(twin, joints, 3e-5, rng))
    (notice,) = check_narrow_data(fit, whole, data, errors, held_out=True)
    assert (notice.code, notice.level) == ("narrow-data", "warning")
    assert "shoulder (measured" in notice.message
    assert "without the noise of a reading" in notice.message
    noisy = replace(whole, overall=replace(stated, mean=0.9 * errors.position.mean))  # type: ignore[union-attr]
    assert check_narrow_data(fit, noisy, data, errors, held_out=True) == []


def test_the_same_data_are_not_counted_twice(fitted: tuple[Twin, Dataset, Fit]) -> None:
    _, data, once = fitted
    twice = identify(once.robot, data, CURVED)
    assert twice.free.names == once.free.names
    assert_allclose(np.diag(twice.covariance), np.diag(once.covariance), rtol=0.1)
    curves = [name for name in once.free.names if name.startswith("curve_")]
    before, after = (np.array([fit.robot.values[name] for name in curves]) for fit in (once, twice))
    assert_allclose(after, before, atol=2e-7)
    result = identify(once.robot, data, GEOMETRIC)  # without the effect the curves stay
    assert [result.robot.values[name] for name in curves] == before.tolist()


def test_without_errors_of_gears_there_are_no_curves() -> None:
    twin = truth_twin(load_robot("irb120"), "random", np.random.default_rng(2))
    data = campaign(twin, 40, 31)
    plain, curved = (identify(load_robot("irb120"), data, model) for model in (GEOMETRIC, CURVED))
    assert curved.free.names == plain.free.names
    for name, value in plain.robot.values.items():
        assert curved.robot.values[name] == pytest.approx(value, rel=1e-6, abs=1e-9)
    notice = check_curves(curved, data)[0]
    assert notice.code == "curve-left-out"
    assert notice.level == "note"
    assert "no error that follows the angle of axis_1 (" in notice.message
    assert check_curves(plain, data) == []


def test_a_joint_that_hardly_turned_has_no_curve() -> None:
    arm, rng = load_robot("li3"), np.random.default_rng(5)
    joints = arm.random_configurations(120, rng)
    joints[:, 2] = 0.1 + 0.003 * rng.normal(size=120)
    gears = {number: JointTruth(gear=((5, 3e-4, 0.3),)) for number in (1, 2)}
    data = measure(replace(truth_twin(arm, "random", rng), joints=gears), joints, NOISE, rng)
    fit = identify(arm, data, CURVED)
    message = next(notice.message for notice in check_curves(fit, data) if notice.code == "curve-left-out")
    assert f"{arm.joints[2].name} (1 deg) turned" in message
    assert {"curve_sin1_3", "curve_cos1_3"} <= set(fit.unfitted)  # the others have some


def test_under_another_payload_curves_do_no_harm() -> None:
    heavy, light = Payload(2.7, (0.05, 0.025, 0.1)), Payload(0.3, (0.0, 0.0, 0.05))
    twin = geared("tracker-triangular", 1)
    data = campaign(twin, 100, 41)
    robot = load_robot("irb120").with_payload(heavy)
    other = campaign(replace(twin, robot=replace(twin.robot, payload=light)), 100, 51)
    plain, curved = (identify(robot, data, model).robot for model in (ELASTIC, ELASTIC.also(["joint-curve"])))
    assert mean_error(curved.with_payload(light), other) < 0.7 * mean_error(plain.with_payload(light), other)


@pytest.mark.parametrize("redundancy", ["drop", "none"])
def test_curves_need_priors(redundancy: str) -> None:
    with pytest.raises(InputError, match=r"curves of joints are found with priors.*allowed: prior"):
        identify(load_robot("irb120"), campaign(geared(), 30, 1), CURVED, redundancy=redundancy)  # type: ignore[arg-type]


def test_a_joint_truth_is_what_the_curve_says() -> None:
    assert JointTruth(gear=((3, 1e-4, 0.2),)).turn(0.7, 0.0, 0.0) == pytest.approx(1e-4 * math.sin(3 * 0.7 + 0.2))


# -- a measured robot


def measured_ur5(folder: Path, name: str) -> Dataset:
    rows = np.genfromtxt(folder / "ur5-tracker" / name, delimiter=",", skip_header=1)
    return Dataset.of(np.radians(rows[:, 7:]), 1e-3 * (rows[:, 1:4] + rows[:, 4:7]))


def test_a_measured_ur5_has_curves(measured_data: Path) -> None:
    grid, others = (measured_ur5(measured_data, name) for name in ("grid.csv", "random.csv"))
    order = np.random.default_rng(0).permutation(grid.configurations)
    training, held_out = grid.of_configurations(order[:700]), grid.of_configurations(order[700:])
    robot = load_robot("ur5")
    plain, curved = (identify(robot, training, model) for model in (GEOMETRIC, CURVED))
    assert curved.status is Status.CONVERGED
    assert mean_error(plain.robot, held_out) > 0.1e-3
    assert mean_error(curved.robot, held_out) < 0.055e-3
    assert mean_error(curved.robot, others) < 0.062e-3
    messages = {notice.code: notice.message for notice in check_curves(curved, training)}
    assert "shoulder from -105 to" in messages["curve-range"]
    assert "wrist_3 (50 deg)" in messages["curve-left-out"]
