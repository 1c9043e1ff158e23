from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.library import outside

from truearm.errors import InputError
from truearm.library import library, load_robot
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.formats.urdf import read_urdf
from truearm.modeling.formats.urdf_writing import urdf_text
from truearm.modeling.parts import Reach
from truearm.modeling.robot import Robot

#: Arms whose geometry has no public URDF that it can be held against, and what it is held against instead.
NO_URDF = {
    "li3": "invented",
}
#: Arms whose makers' reach is of no axis and point, and how much further the flange comes from axis 1.
NO_POINT = {
    "ur3": (500.0, "recommended working radius"),
    "hc10": (1200.0, "to where axes R and B meet"),
    "tm5_900": (900.0, "less than to the wrist centre"),
    "xarm6": (700.0, "less than to the wrist centre"),
    "xarm7": (700.0, "less than to the wrist centre"),
}
#: Arms whose reach nobody publishes.
NO_REACH = {
    "katana450": "its flange is an attachment of the thesis",
    "li3": "invented",
    "puma560": "no maker's figure at hand",
}


@pytest.mark.parametrize("robot_id", library())
def test_an_arm_says_what_it_is(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.name == robot_id == robot_id.lower()
    assert robot.title not in ("", robot_id)
    assert len(robot.source) > 20
    assert robot.maker or robot_id == "li3"
    titles = [load_robot(other).title for other in library()]
    assert titles.count(robot.title) == 1


@pytest.mark.parametrize("robot_id", library())
def test_limits_are_those_of_an_arm(robot_id: str) -> None:
    for joint in load_robot(robot_id).joints:
        assert joint.kind == "revolute"
        assert joint.limits is not None
        low, high = np.degrees(joint.limits)
        assert low < high
        assert 90.0 <= high - low <= 1080.0
        assert max(abs(low), abs(high)) <= 540.0


@pytest.mark.parametrize("robot_id", library())
def test_forward_and_inverse_agree(robot_id: str) -> None:
    robot = load_robot(robot_id)
    q = robot.random_configurations(10, np.random.default_rng(1))
    found = robot.inverse(*robot.forward(q), seed=q)
    positions, rotations = robot.forward(found.joints)
    expected = robot.forward(q)
    assert_allclose(positions, expected[0], rtol=0, atol=1e-8)
    assert_allclose(rotations, expected[1], rtol=0, atol=1e-7)


@pytest.mark.parametrize("robot_id", library())
def test_a_urdf_of_it_is_the_same_arm(robot_id: str, tmp_path: Path) -> None:
    robot = load_robot(robot_id)
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text(robot)[0], encoding="utf-8")
    again = read_urdf(path)
    q = robot.random_configurations(10, np.random.default_rng(2))
    for one, other in zip(again.forward(q), robot.forward(q), strict=True):
        assert_allclose(one, other, rtol=0, atol=1e-9)
    for one_joint, joint in zip(again.joints, robot.joints, strict=True):
        assert_allclose(one_joint.range, joint.range, rtol=0, atol=1e-9)


@pytest.mark.parametrize("robot_id", library())
def test_its_file_is_the_same_arm(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.reach is None or f"distance: {robot.reach.distance * 1e3:.10g}" in robot_text(robot)


def test_every_arm_is_held_against_something_outside() -> None:
    assert {*outside.known()} | {*NO_URDF} == {*library()}
    assert not {*outside.known()} & {*NO_URDF}


@pytest.mark.parametrize("robot_id", outside.known())
def test_poses_are_those_of_a_public_urdf(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    assert stored.robot == robot_id
    assert set(stored.source) == {"repository", "path", "revision"}
    assert bool(stored.reason) == stored.differs
    assert len(stored.joints) >= 8
    assert {tuple(row) for row in np.isclose(stored.joints[:1], stored.joints[:1]).tolist()}
    positions, rotations = robot.forward(stored.joints)
    assert_allclose(positions, stored.poses[:, :3, 3], rtol=0, atol=1e-5)  # 0.01 mm
    assert_allclose(rotations, stored.poses[:, :3, :3], rtol=0, atol=1e-6)


@pytest.mark.parametrize("robot_id", outside.known())
def test_limits_are_those_of_the_urdf_or_their_difference_is_explained(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    limits = np.array([joint.range for joint in robot.joints])
    same = np.abs(limits - stored.limits).max() <= math.radians(0.1)
    assert same == (not stored.limits_differ)


@pytest.mark.parametrize("robot_id", sorted({*library()} - {*NO_POINT} - {*NO_REACH}))
def test_it_reaches_as_far_as_its_maker_says(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.reach is not None
    assert robot.reach.point is not None
    assert outside.largest_reach(robot) == pytest.approx(robot.reach.distance, rel=0.01)


@pytest.mark.parametrize("robot_id", NO_POINT)
def test_a_reach_of_no_point_is_less_than_the_flange_s(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.reach is not None
    assert robot.reach.point is None
    largest = outside.largest_reach(replace(robot, reach=Reach(robot.reach.distance, 1, "flange")))
    assert robot.reach.distance < largest < 1.25 * robot.reach.distance


@pytest.mark.parametrize("robot_id", NO_REACH)
def test_an_arm_without_a_published_reach_has_none(robot_id: str) -> None:
    assert load_robot(robot_id).reach is None
