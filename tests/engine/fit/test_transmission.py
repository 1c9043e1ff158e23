"""Periodic errors of gears: found where they are, not where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import MODELS, named_model
from truearm.engine.fit.transmission import check_transmission, periodic_errors
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT, JointTruth

ELASTIC = next(model for model in MODELS if model.name == "elastic")


def unknown_gears(robot: Robot) -> Robot:
    return replace(robot, joints=tuple(replace(joint, transmission_periods=None) for joint in robot.joints))


def campaign(robot: Robot, gears: dict[int, tuple[int, float]], poses: int, seed: int) -> tuple[Fit, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(robot, "random", rng)
    erring = {joint: JointTruth(gear=((periods, size, 0.7),)) for joint, (periods, size) in gears.items()}
    data = measure(replace(twin, joints=erring), robot.random_configurations(poses, rng), 3e-5, rng)
    return identify(robot.with_payload(twin.robot.payload), data, ELASTIC), data


def test_gears_that_err_are_found() -> None:
    gears = {2: (242, 6e-5), 3: (200, 1e-4), 5: (102, 2e-4)}
    for seed in range(3):
        fit, data = campaign(unknown_gears(load_robot("irb120")), gears, 150, seed)
        errors = {error.joint: (error.periods, error.amplitude) for error in periodic_errors(fit, data)}
        assert set(errors) == set(gears), seed
        for joint, (periods, size) in gears.items():
            assert errors[joint][0] == pytest.approx(periods, abs=1)
            assert errors[joint][1] == pytest.approx(size, rel=0.25)
        (notice,) = check_transmission(fit, data)
        assert notice.code == "transmission-error"
        assert "joint 3 200 times" in notice.message


def test_what_is_no_error_of_a_gear_or_said_already_is_left_in_peace() -> None:
    for seed in range(8):
        assert check_transmission(*campaign(unknown_gears(load_robot("irb120")), {}, 100, seed)) == [], seed
    assert periodic_errors(*campaign(load_robot("irb120"), {3: (200, 2e-4)}, 100, 1)) == ()  # its file describes it
    few = campaign(unknown_gears(load_robot("irb120")), {3: (200, 2e-3)}, 40, 2)
    assert periodic_errors(*few) == ()


def test_several_lines_of_a_gear_are_found_and_nothing_else() -> None:
    for seed in range(3):
        check_four_lines(seed)


@pytest.mark.slow
def test_lines_are_found_in_many_campaigns_and_none_where_there_are_none() -> None:
    for seed in range(3, 20):
        check_four_lines(seed)
    for seed in range(50):
        assert periodic_errors(*campaign(unknown_gears(load_robot("irb120")), {}, 150, seed), most=9) == (), seed


#: The stronger of each joint first, and amplitudes [rad].
LINES = {3: (400, 200), 4: (100, 300)}
SIZES = (2e-4, 1.5e-4)


def check_four_lines(seed: int) -> None:
    """Look for lines in two joints whose gears err at two numbers of periods each."""
    plain, rng = unknown_gears(load_robot("irb120")), np.random.default_rng(seed)
    twin = truth_twin(plain, "random", rng)
    gears = {joint: tuple(zip(periods, SIZES, (0.7, 2.0), strict=True)) for joint, periods in LINES.items()}
    erring = {joint: JointTruth(gear=gear) for joint, gear in gears.items()}
    data = measure(replace(twin, joints=erring), plain.random_configurations(200, rng), 3e-5, rng)
    fit = identify(plain.with_payload(twin.robot.payload), data, ELASTIC)
    found = periodic_errors(fit, data, most=9)
    assert [(e.joint, e.periods) for e in found] == [(joint, n) for joint in LINES for n in LINES[joint]], seed
    assert [error.amplitude for error in found] == pytest.approx([*SIZES, *SIZES], rel=0.35), seed
    assert [(e.joint, e.periods) for e in periodic_errors(fit, data)] == [(3, 400), (4, 100)], seed

    # A line that the robot knows is not told again, nor its neighbours, though the model leaves it in the residuals.
    robot = with_gears(fit.robot, {3: 400, 4: 300})
    assert periodic_errors(replace(fit, robot=robot), data) == ()
    further = periodic_errors(replace(fit, robot=robot), data, most=9)
    assert [(error.joint, error.periods) for error in further] == [(3, 200), (4, 100)], seed
    beside = with_gears(fit.robot, {3: (398, 200), 4: (101, 300)})
    assert periodic_errors(replace(fit, robot=beside), data, most=9) == (), seed


def with_gears(robot: Robot, periods: dict[int, int | tuple[int, ...]]) -> Robot:
    joints = (replace(j, transmission_periods=periods.get(i, j.periods)) for i, j in enumerate(robot.joints, 1))
    return replace(robot, joints=tuple(joints))


def test_the_effect_takes_the_error_out() -> None:
    robot = load_robot("irb120")
    fit, data = campaign(robot, {3: (200, 2e-4)}, 80, 3)
    better = identify(fit.start, data, replace(ELASTIC, effects=("compliance", "transmission-error")))
    sine, cosine = (better.robot.values[f"transmission_{part}_3"] for part in ("sin", "cos"))
    assert np.hypot(sine, cosine) == pytest.approx(2e-4, rel=0.05)
    assert np.arctan2(cosine, sine) == pytest.approx(0.7, abs=0.05)
    assert better.excess == 1.0
    assert fit.joint_error.max() > 4e-5
    assert not better.joint_error.any()


GEOMETRIC = next(model for model in MODELS if model.name == "geometric")


def moved_by_a_joint(
    robot: Robot, joints: np.ndarray, joint: int, motion: np.ndarray, noise: float = 2e-5
) -> tuple[Fit, Dataset]:
    """Return a fit to readings that a joint (from 0) has moved by so much [m] the way it moves its target."""
    data = measure(Twin(robot, {}), joints, noise, np.random.default_rng(5))
    way = robot.joint_jacobian(joints, "tip")[:, :3, joint]
    way /= np.linalg.norm(way, axis=1)[:, None]
    data = replace(data, position=data.position + motion[:, None] * way)
    return identify(robot.with_frames(robot.base, {}), data, GEOMETRIC), data


def test_a_joint_whose_axis_passes_the_only_target_is_not_named() -> None:
    # 0.05 mm at a target that is 0.01 mm off the axis of joint 6 would be a gear that errs by turns.
    plain = unknown_gears(load_robot("irb120"))
    robot = plain.with_frames(plain.base, {"tip": (1e-5, 0.0, 0.1)})
    joints = robot.random_configurations(150, np.random.default_rng(0))
    fit, data = moved_by_a_joint(robot, joints, 5, 5e-5 * np.sin(200 * joints[:, 5]))
    assert periodic_errors(fit, data) == ()
    seen = robot.with_frames(plain.base, {"tip": (0.2, 0.0, 0.1)})
    fit, data = moved_by_a_joint(seen, joints, 5, 5e-5 * np.sin(200 * joints[:, 5]))
    (error,) = periodic_errors(fit, data)
    assert (error.joint, error.periods) == (6, 200)
    assert error.amplitude == pytest.approx(5e-5 / 0.2, rel=0.25)


def test_a_joint_that_hardly_turns_or_stands_still_is_not_named() -> None:
    plain = unknown_gears(load_robot("irb120"))
    robot = plain.with_frames(plain.base, {"tip": (0.1, 0.05, 0.1)})
    for span in (1e-4, 1e-3, 2e-2):
        rng = np.random.default_rng(0)
        joints = robot.random_configurations(150, rng)
        joints[:, 3] = rng.uniform(-span, span, 150)
        # What grows with the cube of the joint's small turns is the slope of any slow sine.
        fit, data = moved_by_a_joint(robot, joints, 3, 5e-5 * (joints[:, 3] / span) ** 3)
        assert periodic_errors(fit, data) == (), span
    joints[:, 3] = 0.3
    fit, data = moved_by_a_joint(robot, joints, 3, 3e-5 * rng.normal(size=150))
    assert 4 not in [error.joint for error in periodic_errors(fit, data)]


def test_sag_that_the_model_does_not_follow_is_no_periodic_error() -> None:
    nominal = load_robot("ur10").with_payload(Payload(5.0, (0.05, 0.02, 0.15)))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        twin = truth_twin(nominal, "random", rng)
        soft = {j: replace(PERFECT, compliance=2e-6 * float(rng.uniform(5, 20))) for j in range(1, 7)}
        data = measure(replace(twin, joints=soft), nominal.random_configurations(150, rng), 0.02e-3, rng)
        data = replace(data, sigma=None)
        assert periodic_errors(identify(nominal, data, named_model("geometric")), data) == ()
