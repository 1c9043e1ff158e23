"""Sets of poses by name: where they lie, and what is reached."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import DOWN, Cube
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_vector
from truearm.planning.pose_sets import POSE_SETS, pose_set

ROBOT = load_robot("irb120")
CUBE = Cube((0.35, 0.0, 0.35), 0.2)


@pytest.mark.parametrize("name", [name for name in POSE_SETS if name != "118"])
def test_the_joints_reach_every_pose_of_a_set(name: str) -> None:
    poses = pose_set(ROBOT, name, CUBE)
    assert poses.missed == ()
    position, rotation = ROBOT.forward(poses.joints)
    assert position == pytest.approx(poses.position, abs=1e-8)
    assert rotation == pytest.approx(poses.rotation, abs=1e-8)
    assert len({*poses.labels}) == len(poses.labels) == len(poses.joints)


def test_where_the_poses_of_each_set_lie() -> None:
    points = pose_set(ROBOT, "p1-p5", CUBE).position
    assert points[0] == pytest.approx(CUBE.centre, abs=1e-8)
    assert np.linalg.norm(points[1:] - CUBE.centre, axis=1) == pytest.approx(0.8 * 0.2 * 3**0.5 / 2, abs=1e-8)
    corners = pose_set(ROBOT, "iso-cube", CUBE)
    assert corners.labels == ("P1", *(f"C{i}" for i in range(1, 9)))
    assert np.abs(corners.position[1:] - CUBE.centre) == pytest.approx(0.1, abs=1e-8)
    plane = CUBE.plane("C3-C4-C5-C6")
    flat = pose_set(ROBOT, "diagonal", CUBE, plane=plane.name, count=7)
    assert (flat.position - CUBE.centre) @ plane.normal == pytest.approx(0.0, abs=1e-8)
    assert len(flat.labels) == 7
    ball = pose_set(ROBOT, "sphere", Cube((0.35, 0.0, 0.2), 0.4), count=20)
    assert np.linalg.norm(ball.position - [0.35, 0.0, 0.2], axis=1) == pytest.approx(0.2, abs=1e-8)
    assert (ball.position[:, 2] > 0.2).all()


def test_every_joint_moves_between_two_poses_of_the_large_set() -> None:
    poses = pose_set(ROBOT, "118", CUBE, count=30)
    assert poses.smallest_move >= np.radians(2.0)
    assert sorted(int(label) for label in poses.labels) == [*range(1, 31)]
    position, _ = ROBOT.forward(poses.joints)
    assert position == pytest.approx(poses.position, abs=1e-8)
    middle = np.array(
        [CUBE.plane(name).normal @ (at - CUBE.centre) for name, at in zip(poses.planes, position, strict=True)]
    )
    assert middle == pytest.approx(0.0, abs=1e-8)
    again = pose_set(ROBOT, "118", CUBE, count=30)
    assert again.joints == pytest.approx(poses.joints, abs=0.0)


def test_an_orientation_is_kept_and_what_it_costs_is_named() -> None:
    poses = pose_set(ROBOT, "iso-cube", Cube((0.35, 0.0, 0.35), 0.3), rotation=DOWN)
    assert poses.missed == ("C1", "C4")
    assert np.abs(rotation_vector(poses.rotation @ DOWN.T)).max() < 1e-8
    assert "C1" not in poses.labels


def test_a_large_set_leaves_out_what_is_not_reached() -> None:
    poses = pose_set(ROBOT, "118", Cube((0.35, 0.0, 0.4), 0.6), count=24)
    assert poses.missed
    assert len(poses.labels) + len(poses.missed) == 24
    assert poses.smallest_move >= np.radians(2.0)


def test_what_no_set_can_be_is_refused() -> None:
    with pytest.raises(InputError, match="no such set of poses; got 'P1'"):
        pose_set(ROBOT, "P1", CUBE)
    with pytest.raises(InputError, match="has a number of poses of its own"):
        pose_set(ROBOT, "p1-p5", CUBE, count=4)
    with pytest.raises(InputError, match="no such diagonal plane"):
        pose_set(ROBOT, "p1-p5", CUBE, plane="C1-C3-C5-C7")
    with pytest.raises(InputError, match="can go to none of these poses"):
        pose_set(ROBOT, "p1-p5", Cube((3.0, 0.0, 0.35), 0.2))
    with pytest.raises(InputError, match="Leave the orientation free"):
        pose_set(ROBOT, "118", CUBE, count=12, rotation=DOWN, least_move=3.0)
