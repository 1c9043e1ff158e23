"""Jogging: joints as controller and model count them, poses in base, world and tool, branches, limits, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.studio.arms import GANTRY, POINT, SCARA

from truearm.engine.base.errors import InputError
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform, rotation_vector
from truearm.robot_files.jobs import inverse
from truearm.studio.jogging import Jogging

Q = np.deg2rad([10.0, 20.0, -15.0, 30.0, 40.0, -50.0])


@pytest.fixture
def arm() -> Jogging:
    robot = load_robot("irb120").with_frames(
        Transform((0.5, 0.1, 0.2), (0.8, 0.0, 0.6, 0.0)), {"ball": (0.02, 0.03, 0.1)}
    )
    return Jogging(robot, Q)


def test_numbers_are_the_models_or_the_controllers() -> None:
    arm = Jogging(load_robot("lrmate200ic"), np.deg2rad([0.0, 20.0, 10.0, 0.0, 5.0, 0.0]))
    assert arm.whose == "controller"
    assert arm.numbers == pytest.approx(np.rad2deg(arm.robot.controller.from_model(arm.joints[None])[0]))
    assert arm.numbers[2] != pytest.approx(10.0)
    arm.whose = "model"
    assert arm.numbers == pytest.approx([0.0, 20.0, 10.0, 0.0, 5.0, 0.0])


def test_a_number_moves_what_the_controller_couples_with_it() -> None:
    arm = Jogging(load_robot("lrmate200ic"))
    before = arm.numbers
    arm.set_number(1, 25.0)
    # The controller's third number stays, so the model's third joint turns against the second.
    assert arm.numbers == pytest.approx([before[0], 25.0, *before[2:]])
    assert np.rad2deg(arm.joints[2]) == pytest.approx(-25.0)


@pytest.mark.parametrize("name", ["irb120", "lrmate200ic", "fr3", "li3"])
def test_ranges_end_where_the_first_joint_meets_its_limit(name: str) -> None:
    robot = load_robot(name)
    for joints in robot.random_configurations(3, np.random.default_rng(0)):
        for k in range(len(robot.joints)):
            for end in (0, 1):
                arm = Jogging(robot, joints)
                limit = arm.ranges()[k][end]
                arm.set_number(k, limit)
                assert arm.numbers[k] == pytest.approx(limit, abs=1e-9)
                assert (arm.joints >= arm.low - 1e-12).all()
                assert (arm.joints <= arm.high + 1e-12).all()
                assert np.isclose(arm.joints, (arm.low, arm.high)[end], atol=1e-9).any() or name == "lrmate200ic"
                arm.set_number(k, limit + (-1000.0, 1000.0)[end])
                assert arm.numbers[k] == pytest.approx(limit, abs=1e-9)


def test_joints_without_limits_and_slides_have_ranges_too() -> None:
    free = Jogging(POINT)
    assert free.ranges()[0] == pytest.approx((-720.0, 720.0))
    slides = Jogging(GANTRY)
    assert slides.units == ["mm"] * 3
    slides.set_number(0, 700.0)
    assert slides.joints[0] == pytest.approx(0.7)
    assert slides.ranges()[0] == pytest.approx((0.0, 1500.0))


def test_what_is_no_number_is_refused(arm: Jogging) -> None:
    with pytest.raises(InputError, match="a number belongs here"):
        arm.set_number(0, float("nan"))
    with pytest.raises(InputError, match="a pose is six numbers"):
        arm.go_to_numbers("base", (0.0, float("inf"), 0.0), (0.0, 0.0, 0.0))
    assert np.array_equal(arm.joints, Q)


@pytest.mark.parametrize("frame", ["base", "world"])
@pytest.mark.parametrize("tip", [None, "ball"])
def test_numbers_of_a_pose_lead_back_to_it(arm: Jogging, frame: str, tip: str | None) -> None:
    arm.tip = tip
    position, turns = arm.pose_numbers(frame)  # type: ignore[arg-type]
    p, _ = arm.robot.forward(Q, frame=frame, target=tip)  # type: ignore[arg-type]
    assert position == pytest.approx((p[0] * 1e3).tolist(), abs=1e-5)
    arm.joints = arm.joints + 0.05
    assert arm.go_to_numbers(frame, position, turns) is PoseStatus.REACHED  # type: ignore[arg-type]
    assert arm.joints == pytest.approx(Q, abs=1e-7)


@pytest.mark.parametrize("target", [None, "ball"])
def test_in_the_axes_of_the_controller_numbers_are_those_of_the_pendant(target: str | None) -> None:
    placed = Transform((0.5, 0.1, 0.2), (0.8, 0.0, 0.6, 0.0))
    robot = load_robot("lrmate200id").with_frames(placed, {"ball": (0.02, 0.03, 0.1)})
    turned = Transform((0.0, 0.0, 0.01), (0.0, 1.0, 0.0, 0.0))
    robot = replace(robot, controller=replace(robot.controller, flange=turned))
    arm = Jogging(robot, Q)
    arm.tip = target
    assert arm.frames == ("base", "world", "controller", "tool")
    for got, meant in zip(arm.pose("controller"), robot.forward(Q, frame="controller", target=target), strict=True):
        assert got == pytest.approx(meant[0], abs=1e-12)
    position, turns = arm.pose_numbers("controller")
    arm.joints = arm.joints + 0.05
    assert arm.go_to_numbers("controller", position, turns) is PoseStatus.REACHED
    assert arm.joints == pytest.approx(Q, abs=1e-7)
    assert Jogging(load_robot("irb120")).frames == ("base", "world", "tool")


def test_in_the_tool_numbers_say_by_how_much(arm: Jogging) -> None:
    p, R = arm.pose()
    assert arm.pose_numbers("tool") == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    arm.go_to_numbers("tool", (5.0, 0.0, -3.0), (0.0, 0.0, 2.0))
    moved, turned = arm.pose()
    assert R.T @ (moved - p) == pytest.approx([0.005, 0.0, -0.003], abs=1e-9)
    assert np.rad2deg(rotation_vector(R.T @ turned)) == pytest.approx([0.0, 0.0, 2.0], abs=1e-7)


def test_a_pose_out_of_reach_is_refused_in_words_and_the_arm_stays(arm: Jogging) -> None:
    with pytest.raises(InputError, match=r"cannot go to this pose.*mm and .* deg are missing"):
        arm.go_to(np.array([3.0, 0.0, 0.5]), np.eye(3))
    assert np.array_equal(arm.joints, Q)


def test_joints_beyond_their_limits_are_refused(arm: Jogging) -> None:
    with pytest.raises(InputError, match=r"axis_3.*beyond its limits.*80 deg.*-110 to 70 deg"):
        arm.go(np.deg2rad([0.0, 0.0, 80.0, 0.0, 0.0, 0.0]))
    assert np.array_equal(arm.joints, Q)


def test_all_branches_lead_to_the_pose(arm: Jogging) -> None:
    p, R = arm.pose()
    branches = arm.branches()
    assert len(branches) == 8
    for branch in branches:
        if not branch.status.usable:
            continue
        arm.go(branch.joints)
        there, turned = arm.pose()
        assert there == pytest.approx(p, abs=1e-9)
        assert turned == pytest.approx(R, abs=1e-9)


@pytest.mark.parametrize("name", ["irb120", "katana450", "li3", "fr3"])
def test_the_singular_value_is_that_of_inverse_kinematics(name: str) -> None:
    robot = load_robot(name)
    for joints in robot.random_configurations(3, np.random.default_rng(5)):
        arm = Jogging(robot, joints)
        p, R = arm.pose()
        turned = None if arm.orientation == "free" else R[None]
        found = inverse(robot, p[None], turned, seed_joints=joints, orientation=arm.orientation).solutions
        assert arm.singular_value() == pytest.approx(float(found.singular_value[0]), abs=1e-9)


def test_words_name_limits_and_singular_postures() -> None:
    arm = Jogging(load_robot("irb120"), np.deg2rad([165.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert arm.words()[0] == "axis_1 is at its limit."
    assert "near a singular posture" in arm.words()[-1]
    arm.joints = Q
    assert len(arm.words()) == 1
    assert "singular posture" not in arm.words()[0]


def test_an_arm_starts_within_its_limits() -> None:
    for name in ("fr3", "irb120"):
        arm = Jogging(load_robot(name))
        assert (arm.joints >= arm.low).all()
        assert (arm.joints <= arm.high).all()
    assert Jogging(load_robot("irb120"), np.full(7, 0.1)).joints == pytest.approx(np.zeros(6))
    assert Jogging(SCARA).joints == pytest.approx(np.zeros(4))


def test_an_elastic_arm_reaches_the_pose_it_was_told() -> None:
    robot = load_robot("irb120").with_effects(["compliance"])
    robot = robot.with_values({name: 1e-4 for name in robot.parameters if name.startswith("compliance")})
    arm = Jogging(robot, Q)
    p, R = robot.rigid.forward(Q)
    assert np.linalg.norm(arm.pose()[0] - p[0]) > 1e-4
    arm.go_to(p[0], R[0])
    assert arm.pose()[0] == pytest.approx(p[0], abs=1e-8)
    assert np.abs(arm.joints - Q).max() > 1e-4


@pytest.mark.parametrize("name", ["irb120", "fr3", "katana450", "li3"])
@pytest.mark.parametrize("elastic", [False, True])
def test_a_pose_that_is_dragged_to_is_met_without_a_leap(name: str, elastic: bool) -> None:
    robot = load_robot(name)
    if elastic and name != "li3":
        robot = robot.with_effects(["compliance"])
        robot = robot.with_values({n: 1e-4 for n in robot.parameters if n.startswith("compliance")})
    middle = np.array([sum(joint.range) / 2.0 for joint in robot.joints]) + 0.3
    arm = Jogging(robot, middle)
    for k in range(8):
        p, R = robot.forward(middle + 0.1 * np.sin(0.5 * k + np.arange(len(middle))), frame="world")
        before = arm.joints
        assert arm.drag_to(p[0], R[0]) is PoseStatus.REACHED
        assert arm.pose("world")[0] == pytest.approx(p[0], abs=1e-8)
        assert np.abs(arm.joints - before).max() < 0.3
    far = arm.pose("world")[0] + [2.0, 0.0, 0.0]
    with pytest.raises(InputError, match="cannot go to this pose"):
        arm.drag_to(far, R[0])
    assert arm.pose("world")[0] == pytest.approx(p[0], abs=1e-8)


def test_an_arm_without_any_length_is_singular_everywhere() -> None:
    assert Jogging(POINT).singular_value() == 0.0
