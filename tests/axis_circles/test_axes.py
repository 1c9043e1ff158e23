"""Axes, frames, parameters and joint errors from circles, against twins; runs and turns of single joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.test_joint_errors import with_table_3
from tests.expecting import refused

from truearm.axis_circles.fit import (
    NORMAL_95,
    AxisAnalysis,
    AxisProblem,
    analyse,
    axis_circles,
    find_runs,
    fit_axes,
    turn_of,
)
from truearm.axis_circles.result import AxisCalibration
from truearm.engine.data.circles import fit_circle
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.lines import base_and_flange, frame_between, joint_axes
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth


def runs(step: float = 6.0, posture: tuple[float, ...] = (0, 0, 0, 0, 30, 0)) -> Array:
    """Every joint alone from -60 to 60 deg and back, the others in a posture."""
    forward = np.arange(-60.0, 60.1, step)
    rows = []
    for joint in range(6):
        run = np.tile(np.array(posture, float), (2 * len(forward), 1))
        run[:, joint] = np.concatenate([forward, forward[::-1]])
        rows.append(run)
    return np.asarray(np.radians(np.concatenate(rows)))


def campaign(
    robot: str, noise: float, seed: int = 1, posture: tuple[float, ...] = (0, 0, 0, 0, 30, 0)
) -> tuple[Twin, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(load_robot(robot), "random", rng)
    return twin, measure(twin, runs(posture=posture), noise, rng)


def left_over(analysis: AxisAnalysis, twin: Twin) -> float:
    """Largest error at configurations that move every joint [m]."""
    q = analysis.nominal.random_configurations(40, np.random.default_rng(9))
    return float(errors_of(analysis.robot, measure(twin, q, 0.0, np.random.default_rng(0))).position_norms.max())


# -- the truth comes back --------------------------------------------------------------------------------


def test_without_noise_the_robot_is_found() -> None:
    for robot in ("irb120", "kr5", "ur5", "puma560", "lrmate200ic"):
        twin, data = campaign(robot, 0.0)
        analysis = analyse(load_robot(robot), data)
        assert left_over(analysis, twin) < 1e-8, robot
        q = analysis.nominal.random_configurations(20, np.random.default_rng(3))
        ours, plain = (arm.world_poses(q, "3")[0] for arm in (analysis.robot_with_errors, analysis.robot))
        assert_allclose(ours, plain, rtol=0, atol=1e-8, err_msg=robot)


def test_axes_base_and_flange_are_where_the_twin_has_them() -> None:
    twin, data = campaign("irb120", 0.0)
    analysis = analyse(load_robot("irb120"), data)
    for axis, true in zip(joint_axes(analysis.measured.robot), joint_axes(twin.robot), strict=True):
        assert_allclose(axis.along, true.along, rtol=0, atol=1e-9)
        assert np.linalg.norm(true.nearest(axis.point) - axis.point) < 1e-9
    axes, plain = joint_axes(twin.robot), joint_axes(analysis.nominal)
    base, flange = base_and_flange(analysis.nominal)
    for (place, _, _), (first, second), nominal in (
        (analysis.base, (0, 1), base),
        (analysis.flange, (5, 4), flange),
    ):
        of_axes = np.linalg.inv(frame_between(plain[first], plain[second])) @ nominal
        expected = frame_between(axes[first], axes[second]) @ of_axes
        assert_allclose(place.rotation, expected[:3, :3], rtol=0, atol=1e-8)
        assert_allclose(place.translation, expected[:3, 3], rtol=0, atol=1e-8)
    assert_allclose(analysis.robot.base.translation, analysis.base[0].translation, rtol=0, atol=1e-9)


def test_dh_and_s_model_of_measured_axes_are_those_of_the_true_robot() -> None:
    """A build without parallel axes: joint 3 of an IRB 120 turned by a quarter."""
    plain = load_robot("irb120")
    third = replace(plain.joints[2], row={**plain.joints[2].row, "alpha": math.pi / 3})
    robot = replace(plain, joints=(*plain.joints[:2], third, *plain.joints[3:]), truths={})
    rng = np.random.default_rng(4)
    twin = truth_twin(robot, "random", rng)
    analysis = analyse(robot, measure(twin, runs(), 0.0, rng))
    for name in ("standard-dh", "s-model"):
        true = converted(analysis.framed(converted(twin.robot, "zero-reference")), name)
        for row, joint in zip(analysis.table(name), true.joints, strict=True):
            for column, (value, _) in row.items():
                assert value == pytest.approx(joint.row[column], abs=1e-7)


def test_parallel_axes_leave_hayatis_table_alone() -> None:
    _, data = campaign("irb120", 0.01e-3)
    tables = AxisCalibration(analyse(load_robot("irb120"), data)).summary()["tables"]
    assert "nearly parallel" in tables["standard-dh"]["refused"]
    assert "nearly parallel" in tables["s-model"]["refused"]
    assert len(tables["hayati"]["rows"]) == 6
    assert tables["hayati"]["rows"][1]["a"]["value"] == pytest.approx(270.0, abs=5.0)


def test_stated_deviations_of_a_table_are_those_of_repetitions() -> None:
    rng = np.random.default_rng(5)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    perfect = measure(twin, runs(15.0), 0.0, rng)
    sigma = np.full(len(perfect.position), 2e-5)
    wanted = ((1, "a"), (3, "alpha"), (2, "theta_offset"), (4, "d"))
    values = []
    for _ in range(12):
        noisy = perfect.position + rng.normal(0, 2e-5, perfect.position.shape)
        analysis = analyse(load_robot("irb120"), replace(perfect, position=noisy, sigma=sigma))
        joints = converted(analysis.framed(analysis.measured.robot), "hayati").joints
        values.append([joints[joint].row[column] for joint, column in wanted])
    rows = analysis.table("hayati")
    assert_allclose(np.std(values, axis=0), [rows[joint][column][1] for joint, column in wanted], rtol=0.45)


def test_noise_leaves_hundredths_of_a_millimetre() -> None:
    twin, data = campaign("irb120", 0.01e-3)
    analysis = analyse(load_robot("irb120"), data)
    assert left_over(analysis, twin) < 0.1e-3
    assert analysis.found.excess == 1.0
    assert analysis.calibrated.residual == pytest.approx(1.0, abs=0.4)


# -- joint errors of the KR5 -----------------------------------------------------------------------------

TABLE_2 = {
    1: (-54, 126, 9, (0, 0, 0, 0, 0, 0)),
    2: (-160, -24, 8, (-90, 0, 0, 0, 0, 0)),
    3: (0, 140, 7, (90, -90, 0, 0, 0, 0)),
    4: (-180, 180, 18, (0, -90, 90, 0, 0, 0)),
    5: (-108, 108, 12, (90, -90, 90, 0, 0, 0)),
    6: (-180, 180, 18, (0, -90, 90, 0, 0, 0)),
}


@pytest.fixture(scope="module")
def kr5() -> Dataset:
    """Table 2 without noise, in the robot's frame."""
    rows = []
    for joint, (low, high, step, posture) in TABLE_2.items():
        run = np.tile(np.array(posture, float), (len(range(low, high + 1, step)), 1))
        run[:, joint - 1] = np.arange(low, high + 1, step)
        rows.append(run)
    twin = Twin(with_table_3().with_frames(IDENTITY, {"smr": (0.07, 0.05, 0.03)}))
    return measure(twin, np.radians(np.concatenate(rows)), 0.0, np.random.default_rng(0))


def test_circles_see_24_sums_and_name_the_rest(kr5: Dataset) -> None:
    fit = analyse(load_robot("kr5"), kr5, in_robot_frame=True).errors
    true = with_table_3().values
    assert len(fit.free.names) == 24
    for name in fit.free.names:
        expected = sum(weight * true[n] for n, weight in fit.combination(name).items())
        assert fit.robot.values[name] == pytest.approx(expected, abs=1e-8)
    fixed = ["ez_1 - ey_2", "ez_2 - ey_4", "ez_3 - ey_4", "ez_4 + ey_5", "ez_5 - ey_6", "ez_6"]
    assert [r.combination for r in fit.redundancies] == fixed
    assert fit.moving_flange == ("ez_6",)


def test_intervals_hold_what_they_say(kr5: Dataset) -> None:
    nominal = converted(load_robot("kr5"), "joint-errors")
    exact = fit_axes(nominal, axis_circles(kr5).circles, ("geometry",))
    true = np.array([exact.robot.values[n] for n in exact.free.names])
    rng, inside = np.random.default_rng(7), []
    for _ in range(120):
        noisy = kr5.position + rng.normal(0, 2e-5, kr5.position.shape)
        data = replace(kr5, position=noisy, sigma=np.full(len(noisy), 2e-5))
        fit = fit_axes(nominal, axis_circles(data).circles, ("geometry",), exact.redundancies)
        deviation = np.array([p.deviation or 0.0 for p in fit.free.parameters])
        inside.append(np.abs([p.value for p in fit.free.parameters] - true) <= NORMAL_95 * deviation)
    share = np.mean(inside, axis=0)
    assert 0.93 <= share.mean() <= 0.97
    assert share.min() > 0.87


def test_jacobian_is_that_of_central_differences(kr5: Dataset) -> None:
    robot = with_table_3()
    free = FreeParameters(tuple(p for p in robot.parameters.values() if p.group != "target"))
    noisy = replace(kr5, position=kr5.position + np.random.default_rng(1).normal(0, 1e-4, kr5.position.shape))
    problem = AxisProblem(robot, axis_circles(noisy).circles, free)
    start = free.start + 1e-3
    J = problem.linearised(start)[1]
    step = 1e-6
    for column, unit in zip(J.T, np.eye(len(start)), strict=True):
        forth, back = (problem.at(start + sign * step * unit).residual for sign in (1, -1))
        assert_allclose(column, (forth - back) / (2 * step), rtol=1e-5, atol=1e-4 * np.abs(J).max())


# -- what is said, and what is refused -------------------------------------------------------------------


def test_an_arm_that_gives_way_is_said_and_widens_deviations() -> None:
    rng = np.random.default_rng(2)
    twin = truth_twin(load_robot("irb120"), "nominal", rng)
    soft = replace(twin, joints={3: JointTruth(compliance=2e-4), 5: JointTruth(compliance=1e-3)})
    stiff, yielding = (analyse(load_robot("irb120"), measure(t, runs(), 5e-6, rng)) for t in (twin, soft))
    assert {n.code for n in stiff.notices} == {"no-circle"}
    assert "not-circular" in {n.code for n in yielding.notices}
    assert yielding.found.excess > 1.5
    assert yielding.found.circles[0].circle.sigma == pytest.approx(5e-6 * yielding.found.excess)


def test_undeclared_noise_is_found_from_what_the_circles_leave() -> None:
    _, data = campaign("irb120", 0.03e-3)
    circles = axis_circles(replace(data, sigma=None))
    assert not circles.declared
    assert circles.circles[0].circle.sigma == pytest.approx(0.03e-3, rel=0.05)
    # a target on the axis is left out if there are others
    _, data = campaign("irb120", 0.02e-3)
    circles = axis_circles(data)
    assert {c.target for c in circles.circles if c.joint == 6} == {"2", "3"}
    assert all("joint 6, target 1" in str(refusal) for refusal in circles.refused)


def test_poses_that_belong_to_no_run_are_counted() -> None:
    rng = np.random.default_rng(3)
    twin = truth_twin(load_robot("irb120"), "nominal", rng)
    outlying = load_robot("irb120").random_configurations(4, rng)
    analysis = analyse(load_robot("irb120"), measure(twin, np.concatenate([runs(), outlying]), 1e-5, rng))
    assert analysis.found.left_out == 4
    assert "left-out" in {n.code for n in analysis.notices}


def test_what_cannot_be_used_is_refused() -> None:
    rng = np.random.default_rng(0)
    twin = truth_twin(load_robot("irb120"), "nominal", rng)
    few, outlying = (
        measure(twin, q, 0.0, rng) for q in (runs()[:168], load_robot("irb120").random_configurations(9, rng))
    )
    data = measure(twin, runs(), 1e-5, rng)
    refused(None, "other joints than katana450.*allowed: 5", analyse, load_robot("katana450"), data)
    for wrong, words in (
        (few, "no run of joint 5, 6"),
        (outlying, "one joint moves alone"),
        (replace(data, joints=data.joints * [1, 1, 1, -1, 1, 1]), "joint 4 does not turn as the robot file says"),
        (
            measure(twin, np.concatenate([runs()[:210], runs()[210:214] * 0.01]), 2e-5, rng),
            "joint 6.*arc is too short|no run of joint 6",
        ),
        (replace(data, joint_kinds=(*data.joint_kinds[:5], "prismatic")), "joint 6: a joint that slides"),
    ):
        refused(None, words, analyse, load_robot("irb120"), wrong)


# -- runs and turns ------------------------------------------------------------------------------------------------


def read_at(joints: Array) -> Dataset:
    rng = np.random.default_rng(0)
    return measure(truth_twin(load_robot("irb120"), "nominal", rng), joints, 0.0, rng)


def sweep(joint: int, degrees: Array, others: Array) -> Array:
    rows = np.tile(np.radians(others), (len(degrees), 1))
    rows[:, joint - 1] = np.radians(degrees)
    return rows


def test_runs_are_where_one_joint_alone_moves() -> None:
    home, ahead = np.zeros(6), np.array([10.0, -20, 30, 0, 20, 0])
    angles = np.arange(-60.0, 61.0, 15)
    both = np.concatenate([angles, angles[::-1]])
    rng = np.random.default_rng(1)
    flicker = np.radians(rng.uniform(-0.002, 0.002, (len(angles), 6)))
    outlying = load_robot("irb120").random_configurations(5, rng)
    joints = np.concatenate(
        [sweep(1, both, home), outlying, sweep(5, angles, ahead) + flicker, sweep(5, angles[:3], home)]
    )
    runs = find_runs(read_at(joints))
    assert [run.joint for run in runs] == [1, 5]
    assert runs[0].configurations.tolist() == list(range(18))
    assert runs[1].configurations.tolist() == list(range(23, 32))
    assert find_runs(read_at(load_robot("irb120").random_configurations(12, np.random.default_rng(2)))) == ()


def test_a_run_may_begin_where_another_ended() -> None:
    angles = np.arange(0.0, 50.0, 10)
    second = sweep(3, angles[1:], np.array([40.0, 0, 0, 0, 0, 0]))
    runs = find_runs(read_at(np.concatenate([sweep(1, angles, np.zeros(6)), second])))
    assert [(run.joint, run.configurations.tolist()) for run in runs] == [(1, [0, 1, 2, 3, 4]), (3, [4, 5, 6, 7, 8])]


def test_errors_and_backlash_of_more_than_a_turn_come_back() -> None:
    reading = np.radians(np.concatenate([np.arange(-400.0, 401, 10), np.arange(400.0, -401, -10)]))
    lag = np.radians(0.03) * np.repeat([-0.5, 0.5], len(reading) // 2)
    angle = reading + lag + np.radians(0.05) * np.sin(2 * reading)
    for sense in (1, -1):
        points = np.column_stack([0.2 * np.cos(angle), sense * 0.2 * np.sin(angle), np.full(len(angle), 0.1)])
        turn = turn_of(fit_circle(points), reading)
        assert_allclose(turn.circle.normal, [0, 0, sense], atol=1e-12)
        assert turn.backlash == pytest.approx(math.radians(0.03), abs=1e-9)
        assert turn.angular == pytest.approx(math.radians(0.13), rel=2e-2)
        assert turn.tangential == pytest.approx(0.2 * turn.angular)
    # a run one way shows none
    reading = np.radians(np.arange(0.0, 100, 10))
    points = np.column_stack([np.cos(reading), np.sin(reading), np.zeros(len(reading))])
    assert turn_of(fit_circle(points), reading).backlash is None


def test_a_lagging_joint_of_a_twin_is_seen() -> None:
    twin = truth_twin(load_robot("irb120"), "nominal", np.random.default_rng(0))
    lazy = Twin(replace(twin.robot), {4: JointTruth(hysteresis=-math.radians(0.037) / 2)})
    angles = np.arange(-150.0, 151.0, 10)
    joints = sweep(4, np.concatenate([angles, angles[::-1]]), np.zeros(6))
    data = measure(lazy, joints, 0.0, np.random.default_rng(0))
    (run,) = find_runs(data)
    turn = turn_of(fit_circle(data.position[data.target == 1]), joints[run.configurations, 3])
    assert turn.backlash == pytest.approx(math.radians(0.037), rel=1e-6)
