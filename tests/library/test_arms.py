from __future__ import annotations

import math
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from ruamel.yaml import YAML
from tests.library import outside

from truearm.errors import InputError
from truearm.library import library, load_robot
from truearm.modeling.controller import AS_THE_MODEL
from truearm.modeling.formats.robot_file import (
    RobotFile,
    is_intact,
    read_robot,
    robot_from_file,
    robot_text,
    sealed,
)
from truearm.modeling.formats.urdf import read_urdf
from truearm.modeling.formats.urdf_writing import urdf_text
from truearm.modeling.parts import Reach
from truearm.modeling.proof import Proof

#: Arms whose geometry has no public URDF that it can be held against, and what it is held against instead.
NO_URDF = {
    "li3": "invented",
}
#: Arms whose makers' reach is of no point that the test knows, and of which it is.
NO_POINT = {
    "crb15000_5_0.95": "to where axis 6 passes axis 5, with the wrist straight",
    "hc10": "to where axes R and B meet",
    "tm5_900": "less than to the wrist centre",
    "ur16e": "recommended, not the largest",
    "ur3": "recommended, not the largest",
    "ur3e": "recommended, not the largest",
    "ur5": "recommended, not the largest",
    "ur5e": "recommended, not the largest",
    "xarm6": "less than to the wrist centre",
    "xarm7": "less than to the wrist centre",
}
#: Arms whose makers' own URDF has the controller's base and flange under other names than base and tool0.
OTHER_NAMES = (
    *("aubo_i5", "fr3", "gen3", "m1013", "m20id_25", "mz07f"),
    *("panda", "rv13frl", "rv4frl", "rv7frl", "xarm6", "xarm7"),
)
#: Arms without a maker's reach, and why.
NO_REACH = {
    "katana450": "its flange is an attachment of the thesis",
    "li3": "invented",
    "puma560": "no maker's figure at hand",
}


def has_controller_s_frames(robot_id: str) -> bool:
    """Return whether base and tool0 of a URDF are the frames of a controller that the library knows."""
    stored = outside.read(robot_id)
    known = load_robot(robot_id).controller != AS_THE_MODEL
    named = (stored.base, stored.tip) == ("base", "tool0") or robot_id in OTHER_NAMES
    return known and named


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
    found = robot.inverse(*robot.forward(q))
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
    positions, rotations = robot.forward(stored.joints)
    assert_allclose(positions, stored.poses[:, :3, 3], rtol=0, atol=1e-5)  # 0.01 mm
    assert_allclose(rotations, stored.poses[:, :3, :3], rtol=0, atol=1e-6)


@pytest.mark.parametrize("robot_id", outside.known())
def test_limits_are_those_of_the_urdf_or_their_difference_is_explained(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    limits = np.array([joint.range for joint in robot.joints])
    same = np.abs(limits - stored.limits).max() <= math.radians(0.1)
    assert same == (not stored.limits_differ)


@pytest.mark.parametrize("robot_id", [name for name in outside.known() if has_controller_s_frames(name)])
def test_the_controller_s_frames_are_base_and_tool0_of_the_urdf(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    its = robot.controller
    assert (its.signs or (1,) * len(robot.joints)) == stored.signs
    positions, rotations = robot.forward(stored.joints, frame="controller")
    assert_allclose(positions, stored.urdf_poses[:, :3, 3], rtol=0, atol=1e-5)
    assert_allclose(rotations, stored.urdf_poses[:, :3, :3], rtol=0, atol=1e-6)


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


def test_gofa_reaches_as_far_as_its_name_says() -> None:
    values = load_robot("crb15000_5_0.95").values
    elbow_to_wrist = math.hypot(values["d_4"], values["a_4"] + values["a_6"])
    assert values["a_3"] + elbow_to_wrist == pytest.approx(0.95, rel=0.01)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("{distance: 0}", "reach.distance"),
        ("{distance: -5}", "reach.distance"),
        ("{distance: 900, from: axis-1}", "a reach is from an axis to a point; got 'no `to`'"),
        ("{distance: 900, to: flange}", "a reach is from an axis to a point; got 'no `from`'"),
        ("{distance: 900, from: axis-7, to: flange}", "the robot has no such axis; got 'axis-7'; allowed: axis-1, "),
        ("{distance: 900, from: shoulder, to: flange}", "reach.from"),
        ("{distance: 900, from: axis-1, to: elbow}", "reach.to"),
        ("{distance: 900, upto: flange}", "reach.upto"),
        ("900", "reach"),
    ],
)
def test_a_reach_that_is_none_is_refused(entry: str, said: str, tmp_path: Path) -> None:
    text = (Path(str(files("truearm.library"))) / "irb120.yaml").read_text("utf-8")
    path = tmp_path / "arm.yaml"
    path.write_text(re.sub("(?m)^reach: .*$", f"reach: {entry}", text), "utf-8")
    with pytest.raises(InputError) as refusal:
        read_robot(path)
    assert said in str(refusal.value)


@pytest.mark.parametrize("entry", ["{distance: 0.58, from: axis-1, to: wrist-centre}", "{distance: 0.58}"])
def test_a_reach_is_in_the_units_of_its_file_and_says_nothing_of_the_calibration(entry: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(
        "truearm: truearm-robot/1\nname: arm\nunits: {length: m, angle: rad}\nconvention: modified-dh\n"
        f"reach: {entry}\njoints:\n  - {{alpha: 0, a: 0, theta_offset: 0, d: 0.1}}\n"
    )
    robot = read_robot(path)
    assert robot.reach is not None
    assert robot.reach.distance == pytest.approx(0.58)
    assert robot_from_file(RobotFile(**YAML(typ="safe").load(robot_text(robot))), "again").reach == robot.reach
    calibrated = sealed(robot, Proof("converged", (), (), (), (), (), ()))
    assert is_intact(replace(calibrated, reach=None))
