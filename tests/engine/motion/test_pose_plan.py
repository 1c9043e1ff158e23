"""The set of poses: on the planes, reached, and in an order in which all joints move."""

from __future__ import annotations

from collections import Counter
from itertools import permutations

import numpy as np
import pytest
from tests.pinocchio_oracle import PinocchioChain

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import PLANES, Cube
from truearm.engine.motion.largest_cube import plan_poses
from truearm.engine.motion.ordering import all_moving_order, smallest_moves
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform

ARMS = {
    "katana450": Cube((0.3, 0.0, 0.2), 0.25),
    "irb120": Cube((0.35, 0.0, 0.4), 0.3),
    "ur5": Cube((0.45, 0.0, 0.35), 0.4),
    "li3": Cube((0.29, 0.0, 0.2), 0.2),
}
BASE = Transform((1.0, -2.0, 0.3), (0.5, 0.5, 0.5, 0.5))


@pytest.mark.parametrize("name", ARMS)
def test_118_poses_are_reached_on_the_planes_and_all_joints_move(name: str) -> None:
    robot = load_robot(name)
    robot = robot.with_frames(BASE, {"tip": (0.0, 0.0, 0.02)})
    plan = plan_poses(robot, ARMS[name], target="tip")
    assert len(plan.joints) == len(plan.points) == len(plan.plane) == 118
    assert Counter(plan.plane) == dict(zip(PLANES, (30, 30, 29, 29), strict=True))
    for point, plane in zip(plan.points, plan.plane, strict=True):
        assert abs((point - plan.cube.centre) @ plan.cube.plane(plane).normal) < 1e-12
    low, high = np.array([joint.limits for joint in robot.joints], float).T
    assert ((plan.joints >= low - 1e-9) & (plan.joints <= high + 1e-9)).all()
    moves = np.abs(np.diff(plan.joints, axis=0)).min()
    assert plan.smallest_move == moves >= np.radians(2)

    oracle = PinocchioChain(robot.trunk, robot.values)
    for k in range(0, 118, 9):
        position, rotation, _ = oracle.tip(plan.joints[k])
        tip = BASE.rotation.T @ (position + 0.02 * rotation[:, 2] - np.array(BASE.translation))
        assert tip == pytest.approx(plan.points[k], abs=1e-8)
        assert BASE.rotation.T @ rotation[:, 2] == pytest.approx(plan.approach[k], abs=1e-8)


def test_some_poses_come_near_to_the_boundary_of_the_cube() -> None:
    plan = plan_poses(load_robot("ur5"), ARMS["ur5"])
    away = 0.2 - np.abs(plan.points - plan.cube.centre).max(axis=1)
    assert (away < 0.02).sum() > 15
    assert (away > 0.1).sum() > 15


def test_the_same_seed_gives_the_same_poses_and_another_one_other_joints() -> None:
    robot = load_robot("irb120")
    one, same, other = (plan_poses(robot, ARMS["irb120"], count=20, seed=seed) for seed in (0, 0, 1))
    assert (one.joints == same.joints).all()
    assert not (one.joints == other.joints).all()
    assert {tuple(p) for p in one.points} == {tuple(p) for p in other.points}


@pytest.mark.parametrize("count", [1, 2, 5])
def test_any_number_of_poses(count: int) -> None:
    plan = plan_poses(load_robot("irb120"), ARMS["irb120"], count=count)
    assert len(plan.joints) == count
    assert plan.smallest_move >= np.radians(2)


def test_the_order_is_short_and_has_no_forbidden_neighbours_if_it_can() -> None:
    ways = []
    for seed in range(20):
        q = np.random.default_rng(seed).uniform(-1, 1, (7, 3))
        least = 0.15
        best = np.inf
        for rest in permutations(range(1, 7)):
            way = q[[0, *rest]]
            if smallest_moves(way).min() >= least:
                best = min(best, float(np.abs(np.diff(way, axis=0)).max(axis=1).sum()))
        order = all_moving_order(q, least)
        assert sorted(order.tolist()) == list(range(7))
        assert order[0] == 0
        if np.isinf(best):
            continue
        assert smallest_moves(q[order]).min() >= least
        ways.append(float(np.abs(np.diff(q[order], axis=0)).max(axis=1).sum()) / best)
    assert len(ways) > 10
    assert max(ways) < 1.25
    assert np.mean(ways) < 1.05


def test_points_out_of_reach_are_named() -> None:
    with pytest.raises(InputError, match=r"does not reach all points.*\d+ of 16 points out of reach, such as \[.*mm"):
        plan_poses(load_robot("irb120"), Cube((0.6, 0.0, 0.4), 0.3), count=16)


def test_an_order_that_is_impossible_is_refused() -> None:
    with pytest.raises(InputError, match=r"no order of the poses was found.*too small for 60 deg"):
        plan_poses(load_robot("li3"), ARMS["li3"], count=30, least_move=np.radians(60))


def test_refusals() -> None:
    robot, cube = load_robot("irb120"), ARMS["irb120"]
    for words, options in (
        ("at least one pose", {"count": 0}),
        ("at least one pose", {"count": True}),
        ("a move must not be negative", {"least_move": -0.1}),
        ("a move must not be negative", {"least_move": np.nan}),
        ("no target of this name", {"target": "gripper"}),
    ):
        with pytest.raises(InputError, match=words):
            plan_poses(robot, cube, **options)
