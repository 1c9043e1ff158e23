"""The cube of ISO 9283 against its definition, and the largest one against closed forms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import combinations, permutations

import numpy as np
import pytest
from tests.expecting import refusing
from tests.pinocchio_oracle import PinocchioChain

from truearm.engine.motion.cube import PLANES, Cube
from truearm.engine.motion.largest_cube import largest_cube, plan_poses
from truearm.engine.motion.ordering import all_moving_order, smallest_moves
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

CUBE = Cube((0.4, 0.1, 0.3), 0.2)


def ball(radius: float) -> Robot:
    """Two crossing joints and a slide through their crossing: the tip gets to every point of a ball."""
    rows = [
        ("revolute", {"alpha": 0.0, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (-np.pi, np.pi)),
        ("revolute", {"alpha": np.pi / 2, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (-np.pi, np.pi)),
        ("prismatic", {"alpha": np.pi / 2, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (0.0, radius)),
    ]
    joints = tuple(Joint(f"j{i}", kind, row, limits) for i, (kind, row, limits) in enumerate(rows, 1))  # type: ignore[arg-type]
    robot = Robot("ball", "Ball", "invented", "modified-dh", joints)
    return robot.with_frames(robot.base, {"tip": (0.0, 0.0, 0.0)})


def test_corners_and_planes() -> None:
    corners = CUBE.corners
    assert np.abs(corners - CUBE.centre) == pytest.approx(0.1)
    assert corners[0] == pytest.approx([0.5, 0.2, 0.4])
    assert corners[4:] == pytest.approx(corners[:4] - [0, 0, 0.2])
    assert {tuple(np.sign(c - CUBE.centre)) for c in corners} == {
        (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)
    }
    for plane in CUBE.planes:
        named = corners[[int(name[1]) - 1 for name in plane.name.split("-")]]
        assert plane.points([1, -1, -1, 1], [1, 1, -1, -1]) == pytest.approx(named)
        assert plane.normal @ (named - CUBE.centre).T == pytest.approx(0)
        assert abs(plane.normal[2]) == pytest.approx(np.sqrt(0.5))  # inclined by 45 deg
        assert plane.across[2] > 0
    assert len({tuple(np.round(np.abs(p.normal) * np.sign(p.normal[2]) * p.normal, 6)) for p in CUBE.planes}) == 4


def test_measuring_points_lie_a_tenth_of_a_diagonal_from_its_ends() -> None:
    diagonal = 0.2 * np.sqrt(3)
    for name in PLANES:
        p = CUBE.plane(name).measuring_points
        assert p[0] == pytest.approx(CUBE.centre), name
        assert np.linalg.norm(p[1:] - CUBE.corners[list(PLANES[name])], axis=1) == pytest.approx(0.1 * diagonal), name
        assert np.linalg.norm(p[1:] - CUBE.centre, axis=1) == pytest.approx(0.4 * diagonal), name


def test_points_fill_a_plane_evenly() -> None:
    plane = CUBE.planes[1]
    for count in (1, 7, 29, 30, 200):
        points = plane.spread(count)
        u, v = (points - plane.centre) @ plane.along / 0.1, (points - plane.centre) @ plane.across / (0.1 * np.sqrt(2))
        assert (points - plane.centre) @ plane.normal == pytest.approx(0, abs=1e-15)
        assert max(np.abs(u).max(), np.abs(v).max()) < 1
        if count > 1:
            apart = min(float(np.linalg.norm(a - b)) for a, b in combinations(points, 2))
            assert apart > 0.55 * np.sqrt(0.2 * 0.2 * np.sqrt(2) / count)  # a square lattice has 1
        # Every eighth of the plane has its share.
        if count == 200:
            counts = np.histogram2d(u, v, bins=[2, 4], range=[[-1, 1], [-1, 1]])[0]
            assert np.abs(counts - 25).max() <= 3


def test_paths_on_the_plane_of_the_katana_thesis() -> None:
    cube = Cube((0.0, -0.3, 0.1392893), 0.25)
    circle = cube.plane("C3-C4-C5-C6").circle(0.1)
    points = np.array([[-100, -300, 139.2893], [0, -370.7107, 210], [100, -300, 139.2893], [0, -229.2893, 68.5786]])
    went = circle.at(np.arange(4) * circle.length / 4)[0]
    assert min(np.abs(went - order).max() for order in (points * 1e-3, points[[0, 3, 2, 1]] * 1e-3)) < 1e-6
    line = cube.plane("C3-C4-C5-C6").line(0.2)
    assert line.at(np.array([0.0, 0.2]))[0] == pytest.approx(points[[3, 1]] * 1e-3, abs=1e-6)


def test_the_largest_cube_in_a_ball() -> None:
    whole = largest_cube(ball(0.6), target="tip", floor=-1.0)
    assert whole.side == pytest.approx(0.6 * np.sqrt(2 / 3), rel=0.01)  # x to s, y and z to s/2
    assert whole.centre == pytest.approx([whole.side / 2, 0, 0], abs=0.01)


def test_the_largest_cube_in_front_and_above() -> None:
    upper = largest_cube(ball(0.6), target="tip", ahead="-y", nearest=0.1, floor=0.0)
    s = (-0.2 + np.sqrt(0.04 + 9 * 0.35)) * 2 / 9  # (0.1 + s)^2 + s^2/4 + s^2 = 0.6^2
    assert upper.side == pytest.approx(s, rel=0.01)
    assert upper.side < s * (1 + 1e-5)
    assert upper.centre == pytest.approx([0, -0.1 - s / 2, s / 2], abs=0.01)


def test_inverse_kinematics_reaches_the_largest_cube_and_not_one_around_it() -> None:
    robot = load_robot("irb120")
    cube = largest_cube(robot, nearest=0.15)
    corners = cube.corners
    assert corners[:, 0].min() >= 0.15 - 1e-9
    assert corners[:, 2].min() >= -1e-9
    assert inverse(robot, corners, orientation="free").complete
    larger = Cube(cube.centre, 1.05 * cube.side)
    assert not inverse(robot, larger.corners, orientation="free").complete


def test_refusals() -> None:
    wrong: list[tuple[str, Callable[[], object]]] = [
        ("the side of a cube must be positive; got -5 mm", lambda: Cube((0, 0, 0), -0.005)),
        ("three finite coordinates", lambda: Cube((0, 0, np.inf), 1)),
        ("no such diagonal plane", lambda: CUBE.plane("C1-C3-C5-C7")),
        ("radius of the circle: it does not lie within", lambda: CUBE.planes[0].circle(0.11)),
        ("length of the line: it does not lie within", lambda: CUBE.planes[0].line(0.29)),
        ("no such direction", lambda: largest_cube(ball(1), ahead="up")),  # type: ignore[arg-type]
        ("floor: a bound of the cube", lambda: largest_cube(ball(1), floor=np.nan)),
        ("no target of this name", lambda: largest_cube(ball(1), target="gripper")),
        ("reaches no cube in this", lambda: largest_cube(ball(0.5), floor=2.0)),
    ]
    for words, make in wrong:
        with refusing(words, of=words):
            make()


# -- poses on the planes, reached, and in an order in which all joints move

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
    for count in (1, 2, 5):
        plan = plan_poses(robot, ARMS["irb120"], count=count)
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


def test_poses_that_cannot_be_are_refused() -> None:
    robot, cube = load_robot("irb120"), ARMS["irb120"]
    for words, options in (
        ("at least one pose", {"count": 0}),
        ("at least one pose", {"count": True}),
        ("a move must not be negative", {"least_move": -0.1}),
        ("a move must not be negative", {"least_move": np.nan}),
        ("no target of this name", {"target": "gripper"}),
    ):
        with refusing(words, of=options):
            plan_poses(robot, cube, **options)
    with refusing("does not reach all points", "of 16 points out of reach, such as ["):
        plan_poses(robot, Cube((0.6, 0.0, 0.4), 0.3), count=16)
    with refusing("no order of the poses was found", "too small for 60 deg"):
        plan_poses(load_robot("li3"), ARMS["li3"], count=30, least_move=np.radians(60))
