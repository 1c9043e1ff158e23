"""Link bending and run-out: one joint by hand, the direction of gravity by Pinocchio, and what has other axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.engine.robot.test_chain import random_frame, random_robot
from tests.engine.robot.test_conversion import check_same
from tests.engine.robot.test_loads import by_pinocchio
from tests.pinocchio_oracle import PinocchioChain

from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.effects.link_bending import bending_names
from truearm.engine.robot.effects.run_out import run_out_names
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import free_fall
from truearm.engine.robot.parts import Joint, Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin

BOTH = ("link-bending", "run-out")
QUARTERS = np.array([0.0, 0.3, math.pi / 2, -2.0, math.pi])


def one_joint(effect: str, gravity: tuple[float, float, float] = (0.0, 0.0, -9.81), **values: float) -> Robot:
    """A joint about the upright z of the base, and a tip 0.5 m away from its axis."""
    arm = Robot("one", "", "", "standard-dh", (Joint("J1", "revolute", {"a": 0.5}),), gravity=gravity)
    return arm.with_effects([effect]).with_values({f"{name}_1": value for name, value in values.items()})


def tips(robot: Robot, q: Array = QUARTERS) -> Array:
    """The flange by the model, and the same by the twin."""
    found = robot.forward(q[:, None])[0]
    twin = Twin(robot.with_frames(robot.base, {"tip": (0.0, 0.0, 0.0)}), joint_truths(robot))
    assert_allclose(found, twin.frames(q[:, None])["tip"][:, :3, 3], rtol=0, atol=1e-12)
    return found


def drawn(robot: Robot, rng: np.random.Generator, size: float = 1.0) -> Robot:
    """A robot that bends and whose joints run out, by some times what is expected of each."""
    robot = robot.with_effects(BOTH)
    own = [p for effect in robot.effects for p in effect.parameters if p.group in BOTH]
    return robot.with_values({p.name: size * p.prior * float(rng.normal()) for p in own})


# -- by hand -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("bending_xz", lambda q: (0.5 * np.cos(q), 0.5 * np.sin(q), 0.0 * q)),  # about its own arm
        ("bending_yz", lambda q: (0.5 * np.cos(2e-3) * np.cos(q), 0.5 * np.cos(2e-3) * np.sin(q), 1e-3 + 0.0 * q)),
        ("bending_zz", lambda q: (0.5 * np.cos(q - 2e-3), 0.5 * np.sin(q - 2e-3), 0.0 * q)),
        ("bending_yx", lambda q: (0.5 * np.cos(q), 0.5 * np.sin(q), 0.0 * q)),  # gravity is along z
    ],
)
def test_an_upright_joint_bends_alike_at_every_angle(name: str, place: Callable[[Array], tuple[Array, ...]]) -> None:
    expected: Array = np.transpose(place(QUARTERS))
    assert_allclose(tips(one_joint("link-bending").with_values({f"{name}_1": 2e-3})), expected, rtol=0, atol=1e-9)


def test_a_joint_on_a_wall_turns_with_the_first_harmonics_of_its_angle() -> None:
    """Gravity along x of the base is (cos q, -sin q, 0) behind the joint's turn."""
    arm = one_joint("link-bending", (5.0, 0.0, 0.0), bending_zx=2e-3, bending_zy=-3e-3, bending_zz=1.0)
    own = QUARTERS + 2e-3 * np.cos(QUARTERS) + 3e-3 * np.sin(QUARTERS)
    assert_allclose(tips(arm)[:, :2], 0.5 * np.transpose([np.cos(own), np.sin(own)]), rtol=0, atol=1e-5)
    for _ in range(3):  # and the fall is that behind the turn as the arm has bent
        own = QUARTERS + 2e-3 * np.cos(own) + 3e-3 * np.sin(own)
    assert_allclose(tips(arm)[:, :2], 0.5 * np.transpose([np.cos(own), np.sin(own)]), rtol=0, atol=1e-11)


def test_what_falls_does_not_matter_nor_how_fast() -> None:
    arm = one_joint("link-bending", (5.0, 0.0, -5.0), bending_zx=2e-3, bending_yz=1e-3)
    for other in (
        replace(arm, gravity=(1.0, 0.0, -1.0)),
        arm.with_payload(Payload(7.0, (0.1, 0.2, 0.3))),
    ):
        assert_allclose(tips(other), tips(arm), rtol=0, atol=1e-12)
    moving = Postures(QUARTERS[:, None], np.ones((5, 1)), np.ones((5, 1)), wrench=np.ones((5, 6)))
    assert_array_equal(arm.world_poses(moving)[0], arm.world_poses(QUARTERS[:, None])[0])
    weightless = replace(arm, gravity=(0.0, 0.0, 0.0))
    assert_array_equal(tips(weightless), tips(weightless.rigid))


def test_an_axis_runs_out_on_an_ellipse() -> None:
    s, c = np.sin(QUARTERS), np.cos(QUARTERS)
    arm = one_joint("run-out", run_out_x_sin=1e-4, run_out_x_cos=2e-4, run_out_y_cos=-3e-4, run_out_z_sin=4e-4)
    expected = np.transpose([0.5 * c + 1e-4 * s + 2e-4 * c, 0.5 * s - 3e-4 * c, 4e-4 * s])
    assert_allclose(tips(arm), expected, rtol=0, atol=1e-15)


def test_a_circle_that_goes_round_with_the_joint_is_an_offset_of_the_link() -> None:
    longer = replace(one_joint("run-out"), joints=(Joint("J1", "revolute", {"a": 0.5003}),))
    assert_allclose(tips(one_joint("run-out", run_out_x_cos=3e-4, run_out_y_sin=3e-4)), tips(longer), atol=1e-15)


def test_the_angle_is_the_joint_position_and_the_axes_are_those_before_the_turn() -> None:
    """Two joints: what carries the second one turns with the first, and not with its zero."""
    joints = (Joint("J1", "revolute", {"a": 0.4}), Joint("J2", "revolute", {"a": 0.3, "theta_offset": math.pi / 2}))
    arm = Robot("two", "", "", "standard-dh", joints).with_effects(["run-out"])
    arm = arm.with_values({"run_out_x_cos_2": 1e-3})
    q = np.array([[0.0, 0.0], [math.pi / 2, 0.0], [0.0, math.pi]])
    assert_allclose(
        arm.forward(q)[0] - arm.rigid.forward(q)[0], [[1e-3, 0, 0], [0, 1e-3, 0], [-1e-3, 0, 0]], atol=1e-15
    )


def test_the_weight_of_a_link_turns_the_joints_before_it() -> None:
    """About z, gravity along -y: a first moment of link 2 along its x turns joint 1 by -cos(q1 + q2)."""
    joints = (Joint("J1", "revolute", {"a": 0.5}), Joint("J2", "revolute", {"a": 0.3}))
    arm = Robot("two", "", "", "standard-dh", joints, gravity=(0.0, -9.81, 0.0)).with_effects(["link-bending"])
    q = np.random.default_rng(2).uniform(-math.pi, math.pi, (8, 2))
    for name, shape in (("moment_x2_1", -np.cos(q.sum(axis=1))), ("moment_y2_1", np.sin(q.sum(axis=1)))):
        hung = arm.with_values({name: 1e-6})
        assert_allclose(hung.variables(q, hung.values)[0] - q[:, 0], 1e-6 * shape, rtol=0, atol=1e-11)
        twin = Twin(hung.with_frames(hung.base, {"tip": (0.0, 0.0, 0.0)}), joint_truths(hung))
        assert_allclose(hung.forward(q)[0], twin.frames(q)["tip"][:, :3, 3], rtol=0, atol=1e-12)


# -- by Pinocchio --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_gravity_falls_as_a_weight_at_the_flange_pulls(convention: Convention) -> None:
    """At rest the force at every joint is the weight of what hangs there, whatever the way to it."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        robot = random_robot(convention, (), rng, ("revolute", "prismatic", "revolute", "revolute"))
        robot = replace(robot.with_frames(random_frame(rng), {}), masses=(), balancers=(), payload=Payload(2.0))
        robot = replace(robot, gravity=(1.0, -2.0, 3.0))
        variables = robot.random_configurations(6, rng).T
        force = by_pinocchio(robot, variables, 0 * variables, 0 * variables, np.zeros((6, 6)))[:, :3]
        assert_allclose(
            free_fall(robot, variables)[: len(variables)], force / (2.0 * math.sqrt(14.0)), rtol=0, atol=1e-12
        )


def test_the_chain_with_tilts_and_slides_is_that_of_pinocchio() -> None:
    for name in ("irb120", "katana450", "ur5"):
        rng = np.random.default_rng(3)
        robot = drawn(load_robot(name), rng, 100.0)
        q = robot.random_configurations(5, rng)
        variables = robot.variables(q, robot.values)
        assert np.abs(variables[len(robot.joints) :]).max() > 1e-3
        oracle = PinocchioChain(robot.trunk, robot.values)
        position, rotation = robot.world_poses(q)
        for k in range(len(q)):
            p, R, _ = oracle.tip(variables[:, k])
            assert_allclose(position[k], p, rtol=0, atol=1e-12)
            assert_allclose(rotation[k], R, rtol=0, atol=1e-12)


# -- other axes, and the way back --------------------------------------------------------------------------------


def check_alike(made: Robot, robot: Robot, rng: np.random.Generator) -> None:
    """A tilt is Rx Ry of its axes: in others it is the same but for the product of two small angles."""
    straight = {name: 0.0 for name in robot.values if name.startswith("bending_")}
    check_same(made.with_values(straight), robot.with_values(straight), rng)
    q = robot.random_configurations(10, rng)
    for actual, expected in zip(made.world_poses(q), robot.world_poses(q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=2e-8)


@pytest.mark.parametrize("robot_id", ["irb120", "katana450", "kr5", "ur5"])
def test_a_conversion_gives_the_parameters_in_the_axes_of_the_other_convention(robot_id: str) -> None:
    rng = np.random.default_rng(6)
    plain = replace(load_robot(robot_id), gravity=(3.0, -2.0, -9.0))
    robot = drawn(plain.with_frames(Transform((0.1, 0.2, 0.3)), {"tip": (0.05, 0.02, 0.1)}), rng)
    for name in CONVERSIONS:
        made = converted(robot, name)
        check_alike(made, robot, rng)
        for i in robot.layout.turning:
            for names in (bending_names(i + 1), run_out_names(i + 1)):  # turned, and no longer or shorter
                own, other = (np.linalg.norm([r.values[n] for n in names]) for r in (robot, made))
                assert own == pytest.approx(other, rel=1e-12)
    assert converted(plain.with_effects(BOTH), "s-model").known.keys() == converted(plain, "s-model").known.keys()


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_a_robot_of_any_convention_is_converted_with_what_moves_its_axes(convention: Convention) -> None:
    rng = np.random.default_rng(7)
    robot = drawn(replace(random_robot(convention, (), rng), gravity=(1.0, -2.0, -9.0)), rng)
    for name in CONVERSIONS:
        check_alike(converted(robot, name), robot, rng)


@pytest.mark.parametrize("effects", [("run-out",), ("link-bending",), (*BOTH, "compliance", "gain", "clearance")])
def test_forward_of_inverse_is_the_pose(effects: tuple[str, ...]) -> None:
    rng = np.random.default_rng(8)
    robot = load_robot("irb120").with_payload(Payload(2.0, (0.05, 0.03, 0.1))).with_effects(effects)
    own = [p for effect in robot.effects for p in effect.parameters]
    robot = robot.with_values({p.name: p.nominal + 0.3 * p.prior * abs(float(rng.normal())) for p in own})
    q = robot.random_configurations(150, rng)
    found = inverse(robot, *robot.world_poses(q), frame="world", seed=q)
    reached = found.singular_value > 0.05
    assert reached.sum() > 50
    assert np.abs(robot.world_poses(found.joints)[0] - robot.world_poses(q)[0])[reached].max() < 1e-9
    assert np.abs(found.joints - q)[reached].max() < 1e-8


def test_the_direction_of_gravity_goes_with_the_loads() -> None:
    robot = drawn(load_robot("irb120"), np.random.default_rng(9))
    q = robot.random_configurations(6, np.random.default_rng(1))
    at = robot.loaded(q)
    assert_allclose(np.linalg.norm(at.free_fall[:6], axis=1), 1.0, rtol=1e-12)
    assert_array_equal(at.between(2, 5).free_fall, at.free_fall[..., 2:5])
    assert at.between(2, 5).loads is not None
    of_others = robot.rigid.with_effects(["compliance"]).loaded(q)
    assert of_others.fall is None  # and where another robot's loads are held, the direction is found
    assert_allclose(robot.loaded(of_others).free_fall, at.free_fall, rtol=0, atol=1e-12)
    for bare in (at.at(np.arange(3)), Postures(q), robot.rigid.loaded(q)):
        assert (bare.loads, bare.fall) == (None, None)
        with pytest.raises(ValueError, match="no direction of gravity"):
            _ = bare.free_fall
