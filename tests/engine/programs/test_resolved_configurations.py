"""Which posture a program means, by its configuration and by where the robot comes from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.engine.programs.reading import branches

from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.program import ANY_POSTURE, Configuration
from truearm.engine.programs.resolved_configurations import ON_EDGE, agrees, resolved_configurations
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot

IRB120 = load_robot("irb120")
UNKNOWN = np.full(6, np.nan)


def quadrants(robot: Robot, joints: np.ndarray) -> Configuration:
    """Return the quadrants of axes 1, 4 and 6, as ABB counts them, and the elbow."""
    elbow = branches(robot, joints[None])[0].split("-")[1]
    bounds = tuple(
        (axis, math.pi / 2 * q, math.pi / 2 * (q + 1))
        for axis, q in ((axis, math.floor(joints[axis - 1] / (math.pi / 2))) for axis in (1, 4, 6))
    )
    return Configuration(elbow=elbow, ranges=bounds)  # type: ignore[arg-type]


def test_a_configuration_tells_the_posture_and_the_turn() -> None:
    for name in ("irb120", "irb1600", "kr5", "lrmate200ic"):
        robot = load_robot(name)
        plain = replace(robot, controller=load_robot("irb120").controller)
        joints = plain.random_configurations(400, np.random.default_rng(1))
        meant = resolved_configurations(
            plain, matrices(plain, joints), [quadrants(plain, q) for q in joints], np.full(joints.shape, np.nan), []
        )
        away = meant.joints - joints
        away[:, 2] -= 2 * math.pi * np.round(away[:, 2] / (2 * math.pi))  # the LR Mate's axis 3 has room for two turns
        same = np.abs(away).max(axis=1) < 1e-6
        # Next to an edge of a quadrant another posture may be as good.
        near_edge = (np.abs((joints[:, [0, 3, 5]] + math.pi / 4) % (math.pi / 2) - math.pi / 4) < 1.01 * ON_EDGE).any(
            axis=1
        )
        assert (same | near_edge).all(), name
        assert meant.reachable.all(), name
        assert meant.guessed is None, name


def test_joints_are_those_that_the_controller_shows() -> None:
    """A FANUC counts its third axis with the second, and its wrist the other way."""
    robot = load_robot("lrmate200ic")
    joints = np.radians([[20.0, 30, -10, 40, -50, 60]])
    shown = robot.controller.from_model(joints)
    assert np.degrees(shown[0, 3]) == pytest.approx(-40)
    wanted = matrices(robot, joints)
    for reading, low, high, found in ((4, -math.pi / 2, 0, True), (4, 0, math.pi / 2, False)):
        configuration = Configuration("front", "up", None, ((reading, low, high),))
        meant = resolved_configurations(robot, wanted, [configuration], UNKNOWN[None], [])
        assert (np.abs(meant.joints - joints).max() < 1e-6) == found


def test_without_a_configuration_it_is_the_one_nearest_to_where_the_robot_comes_from() -> None:
    robot = load_robot("ur5")
    start = np.radians([10.0, -80, 70, -90, -80, 30])
    path = start + np.linspace(0, 1, 30)[:, None] * np.radians([200.0, 20, -30, 40, 30, -250])
    poses = matrices(robot, path)
    known = np.full(path.shape, np.nan)
    known[0] = start
    meant = resolved_configurations(robot, poses, [ANY_POSTURE] * 30, known, range(30))
    np.testing.assert_allclose(meant.joints, path, atol=1e-8)
    assert meant.guessed is None
    # Said at the pose itself, it counts more than where the robot comes from.
    near = Configuration(near=tuple(path[20]))
    alone = resolved_configurations(robot, poses[20:21], [near], known[1:2], [0])
    np.testing.assert_allclose(alone.joints[0], path[20], atol=1e-8)


def test_on_a_straight_way_the_branch_stays_however_far_the_wrist_turns() -> None:
    """A line that turns the tool by 150 deg: another branch is nearer in its joints, and no line leads there."""
    robot = load_robot("kr5")
    ends = np.radians([[10.0, -80, 90, 20, 40, 0], [10.0, -80, 90, 165, 40, -100]])
    poses, configurations = matrices(robot, ends), [ANY_POSTURE] * 2
    known = np.stack([ends[0], UNKNOWN])
    by_joints = resolved_configurations(robot, poses, configurations, known, [0, 1])
    straight = resolved_configurations(robot, poses, configurations, known, [0, 1], straight=[1])
    names = [branches(robot, found.joints)[1] for found in (by_joints, straight)]
    assert names[0] != names[1] == branches(robot, ends[:1])[0]
    np.testing.assert_allclose(straight.joints[1], ends[1], atol=1e-8)
    # From a stretched wrist both ways of bending are open.
    known[0, 4] = 0.001
    poses[0] = matrices(robot, known[:1])[0]
    stretched = resolved_configurations(robot, poses, configurations, known, [0, 1], straight=[1])
    assert branches(robot, stretched.joints)[1] == names[0]


def test_with_nothing_to_go_by_the_first_branch_is_taken_and_said() -> None:
    robot = load_robot("ur5")
    joints = np.radians([[10.0, -80, 70, -90, -80, 30]])
    meant = resolved_configurations(robot, matrices(robot, joints), [ANY_POSTURE], UNKNOWN[None], [0])
    assert meant.guessed == 0
    assert branches(robot, meant.joints)[0].startswith("front-up")


def test_out_of_reach_and_out_of_configuration_are_told_apart() -> None:
    joints = np.radians([[10.0, 20, -10, 15, 40, 30]])
    poses = np.concatenate([matrices(IRB120, joints)] * 2)
    poses[1, 0, 3] += 2.0
    never = Configuration(ranges=((1, math.radians(100), math.radians(120)),))
    meant = resolved_configurations(IRB120, poses, [never, ANY_POSTURE], np.stack([UNKNOWN, UNKNOWN]), [])
    assert meant.reachable.tolist() == [True, False]
    assert np.isnan(meant.joints).all()


def test_a_joint_on_the_edge_of_its_quadrant_may_be_a_little_beyond() -> None:
    joints = np.radians([[10.0, 20, -10, -0.5, 40, 30]])
    inside = Configuration(ranges=((4, 0.0, math.pi / 2),))
    assert agrees(IRB120, joints, inside).all()
    assert not agrees(IRB120, joints, inside, slack=0.0).any()
    meant = resolved_configurations(IRB120, matrices(IRB120, joints), [inside], UNKNOWN[None], [])
    np.testing.assert_allclose(meant.joints, joints, atol=1e-8)


def test_a_side_without_an_end_is_the_turn_next_to_zero() -> None:
    """A KUKA says of every axis only whether it reads less than zero."""
    robot = load_robot("kr5")
    joints = np.radians([[-20.0, -80, 90, -170, 40, -300], [-20.0, -80, 90, 170, 40, 300]])
    words = [
        Configuration(ranges=tuple((i, *((-math.inf, 0.0) if v < 0 else (0.0, math.inf))) for i, v in signs))
        for signs in (list(enumerate(q, 1)) for q in joints)
    ]
    meant = resolved_configurations(robot, matrices(robot, joints), words, np.stack([UNKNOWN, UNKNOWN]), [])
    np.testing.assert_allclose(meant.joints, joints, atol=1e-8)


def test_an_offset_is_in_the_posture_of_what_it_is_an_offset_from() -> None:
    """However the robot comes there: Offs and RelTool keep the configuration of the robtarget."""
    robot = load_robot("irb1600")
    parent = np.radians([-120.0, -5, 20, 12, -50, -185])
    offset = parent + np.radians([0.5, 3, -4, 2, 1, 6])  # into another quadrant of axis 6
    before = np.radians([80.0, 30, -20, -170, 50, 100])
    poses = matrices(robot, np.stack([before, parent, offset]))
    known = np.stack([before, UNKNOWN, UNKNOWN])
    said = [ANY_POSTURE, quadrants(robot, parent), ANY_POSTURE]
    meant = resolved_configurations(robot, poses, said, known, [0, 2, 1], [None, None, 1])
    np.testing.assert_allclose(meant.joints, np.stack([before, parent, offset]), atol=1e-8)
    # An offset of an offset is in that posture too; without the link it is the one nearest to where the robot was.
    twice = resolved_configurations(
        robot, poses[[0, 1, 2, 2]], [*said, ANY_POSTURE], known[[0, 1, 2, 2]], [0, 3], [None, None, 1, 2]
    )
    np.testing.assert_allclose(twice.joints[3], offset, atol=1e-8)
    alone = resolved_configurations(robot, poses, said, known, [0, 2, 1])
    assert np.abs(alone.joints[2] - offset).max() > 1.0
