from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from ruamel.yaml import YAML
from tests.arms import ARMS
from tests.engine.robot.test_chain import random_robot
from tests.expecting import refusing

from truearm.engine.robot.chain import Array, Chain
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention, JointKind
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint, LinkMass
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot, robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.urdf import calibrated_urdf, read_urdf
from truearm.engine.robot.urdf_tree import roll_pitch_yaw
from truearm.engine.robot.urdf_writing import urdf_text

# A UR5 as ROS writes it: rounded right angles, a world link, a fixed tool0, and a sensor beside the chain.
UR_LIKE = b"""<?xml version="1.0" ?>
<!-- made by hand; <origin xyz="9 9 9" rpy="9 9 9"/> in a comment is no origin -->
<robot name="ur5_like" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="world"/>
  <joint name="world_joint" type="fixed">
    <parent link="world"/><child link="base_link"/>
    <origin xyz="0.1 0 0.5" rpy="0 0 0"/>
  </joint>
  <link name="base_link"><inertial><mass value="4.0"/><origin xyz="0 0 0.1"/></inertial></link>
  <joint name="shoulder_pan_joint" type="revolute">
    <parent link="base_link"/><child link="shoulder_link"/><origin rpy="0.0 0.0 0.0" xyz="0.0 0.0 0.089159"/>
    <axis xyz="0 0 1"/><limit effort="150.0" lower="-6.2832" upper="6.2832" velocity="3.15"/>
  </joint>
  <link name="shoulder_link">
    <visual><origin rpy="0 0 1" xyz="1 2 3"/><geometry><sphere radius="0.1"/></geometry></visual>
    <inertial>
      <mass value="3.7"/><origin rpy="0.0 0.0 0.0" xyz="0.0 0.01 0.0"/>
      <inertia ixx="0.01" ixy="0.0" ixz="0.0" iyy="0.01" iyz="0.0" izz="0.01"/>
    </inertial>
  </link>
  <joint name="shoulder_lift_joint" type="revolute">
    <parent link="shoulder_link"/><child link="upper_arm_link"/><origin rpy="0.0 1.5708 0.0" xyz="0.0 0.13585 0.0"/>
    <axis xyz="0 1 0"/><limit effort="150.0" lower="-6.2832" upper="6.2832" velocity="3.15"/>
  </joint>
  <link name="upper_arm_link"/>
  <joint name="elbow_joint" type="revolute">
    <parent link="upper_arm_link"/><child link="forearm_link"/><origin rpy="0.0 0.0 0.0" xyz="0.0 -0.1197 0.42500"/>
    <axis xyz="0 1 0"/><limit effort="150.0" lower="-3.1416" upper="3.1416" velocity="3.15"/>
  </joint>
  <link name="forearm_link"/>
  <joint name="wrist_1_joint" type="continuous">
    <parent link="forearm_link"/><child link="wrist_1_link"/>
    <origin rpy="0.0 1.5707963267948966 0.0" xyz="0.0 0.0 0.39225"/><axis xyz="0 1 0"/>
  </joint>
  <link name="wrist_1_link"/>
  <joint name="flange_joint" type="fixed">
    <parent link="wrist_1_link"/><child link="flange"/><origin xyz="0 0.1 0" rpy="0 0 1.5708"/>
  </joint>
  <link name="flange">
    <inertial>
      <mass value="0.3"/><inertia ixx="0.01" ixy="0.0" ixz="0.0" iyy="0.01" iyz="0.0" izz="0.01"/>
    </inertial>
  </link>
  <joint name="sensor_joint" type="fixed">
    <parent link="wrist_1_link"/><child link="sensor"/><origin xyz="0 0 0.3" rpy="1 0 0"/>
  </joint>
  <link name="sensor">
    <inertial>
      <origin xyz="0 0.02 0.01"/><mass value="0.7"/>
      <inertia ixx="0.01" ixy="0.0" ixz="0.0" iyy="0.01" iyz="0.0" izz="0.01"/>
    </inertial>
  </link>
  <joint name="tool0_joint" type="fixed">
    <parent link="flange"/><child link="tool0"/><origin xyz="0 0 0" rpy="-1.5708 0 0"/>
  </joint>
  <link name="tool0"/>
  <transmission name="t1">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="shoulder_pan_joint"><hardwareInterface>PositionJointInterface</hardwareInterface></joint>
  </transmission>
</robot>
"""

# What a file may look like and still be one: another encoding, CRLF, single quotes, odd spacing, origins given in
# part, in comments or not at all, fixed joints with turns in between, any axis, a slide.
ODD = """<?xml version='1.0' encoding='ISO-8859-1'?>\r
<robot name='odd'>\r
  <!-- Gr\xf6\xdfe: <joint name="a" type="fixed"><origin xyz="1 1 1"/></joint> -->\r
  <link name="l0"/>\r
  <joint name="j1" type="prismatic" >\r
    <!--<origin xyz="1 1 1"/>-->\r
    <parent link="l0"/><child link="l1"/>\r
    <axis xyz="0.6 0 -0.8"/>\r
    <limit lower='-1' upper='1.5' effort='1' velocity='1'/>\r
  </joint>\r
  <link name="l1"/>\r
  <joint type="fixed" name="f1"><parent link="l1"/><child link="l1b"/>\r
    <origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/></joint>\r
  <link name="l1b"/>\r
  <joint name="f2" type="fixed"><origin rpy="0 0 2"/><parent link="l1b"/><child link="l1c"/></joint>\r
  <link name="l1c"/>\r
  <joint name="j2" type="revolute"\r
      ><origin\r
         xyz = '  -.5   1e-1\t+2.'   rpy\r
         ='0.1  0.2    0.3'   />\r
    <parent link="l1c"/><child link="l2"/>\r
    <axis xyz="-0.57735 0.57735 -0.57735"/>\r
    <limit lower='-1' upper='1.5' effort='1' velocity='1'/>\r
  </joint>\r
  <link name="l2"/>\r
  <joint name="j3" type="continuous"><parent link="l2"/><child link="l3"/>\r
    <origin note="a > b" xyz='0 0 1'></origin></joint>\r
  <link name="l3"/>\r
  <joint name="j4" type="continuous"><parent link="l3"/><child link="l4"/>\r
    <origin rpy="0 -1.5707963267948966 0.4"/><axis xyz="0 -1 0"/></joint>\r
  <link name="l4"/>\r
  <joint name="j5" type="prismatic"><parent link="l4"/><child link="l5"/>\r
    <origin/><axis xyz="0 0 -1"/><limit upper="0.3" effort="1" velocity="1"/></joint>\r
  <link name="l5"/>\r
</robot>\r
""".encode("latin-1")

FILES = {"ur_like": UR_LIKE, "odd": ODD}


def written(content: bytes, folder: Path, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def read(content: bytes, folder: Path, tip: str | None = None) -> Robot:
    return read_urdf(written(content, folder), tip)


class Pinocchio:
    """The robot that Pinocchio reads from the same file."""

    def __init__(self, content: bytes | str) -> None:
        self._pin: Any = pytest.importorskip("pinocchio")
        text = content if isinstance(content, str) else content.decode("latin-1" if b"8859" in content else "utf-8")
        # It takes text, so without what says how the bytes were coded, and knows no blanks but the space.
        self.model = self._pin.buildModelFromXML(re.sub(r"^\ufeff?<\?xml.*?\?>|\s", " ", text))
        self.data = self.model.createData()

    def poses(self, names: list[str], q: Array, link: str) -> tuple[Array, Array]:
        """Positions and rotations of a link at readings ``(n, joints)`` of the joints `names`."""
        pin, model = self._pin, self.model
        frame = model.getFrameId(link)
        assert frame < model.nframes
        positions, rotations = [], []
        for readings in q:
            configuration = pin.neutral(model)
            for name, reading in zip(names, readings, strict=True):
                joint = model.joints[model.getJointId(name)]
                turned = [reading] if joint.nq == 1 else [math.cos(reading), math.sin(reading)]
                configuration[joint.idx_q : joint.idx_q + joint.nq] = turned
            pin.framesForwardKinematics(model, self.data, configuration)
            positions.append(np.array(self.data.oMf[frame].translation))
            rotations.append(np.array(self.data.oMf[frame].rotation))
        return np.array(positions), np.array(rotations)

    def mass(self, joint: str) -> tuple[float, Array]:
        """Mass and centre of gravity of all that is fixed behind a joint, in its frame."""
        inertia = self.model.inertias[self.model.getJointId(joint)]
        return float(inertia.mass), np.array(inertia.lever)


def check_poses(robot: Robot, content: bytes | str, link: str, atol: float, seed: int = 0) -> None:
    """Check that Pinocchio finds the poses of `robot` in the file; its base stands at the identity."""
    q = robot.random_configurations(10, np.random.default_rng(seed))
    result = Pinocchio(content).poses([joint.name for joint in robot.joints], q, link)
    for actual, expected in zip(result, robot.world_poses(q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=atol)


def shifted(robot: Robot, rng: np.random.Generator, scale: float) -> Robot:
    """The robot with other values of all geometric parameters and joint zeros."""
    own = [p for p in robot.parameters.values() if p.group in ("geometry", "joint zero")]
    return robot.with_values({p.name: p.value + scale * rng.normal() for p in own})


def without_origins(content: bytes) -> bytes:
    return re.sub(rb"""<origin(?:\s+\w+\s*=\s*(?:"[^"]*"|'[^']*'))*\s*/?>""", b"", content)


# -- reading ---------------------------------------------------------------------------------------------------


def test_poses_are_pinocchios(tmp_path: Path) -> None:
    check_poses(read(ODD, tmp_path), ODD, "l5", atol=1e-12)
    check_poses(read(UR_LIKE, tmp_path), UR_LIKE, "tool0", atol=1e-12)
    for tip in ("sensor", "flange", "wrist_1_link", "forearm_link", "shoulder_link"):
        robot = read(UR_LIKE, tmp_path, tip)
        assert len(robot.joints) == {"forearm_link": 3, "shoulder_link": 1}.get(tip, 4)
        check_poses(robot, UR_LIKE, tip, atol=1e-12)


def test_what_the_file_says_of_the_joints(tmp_path: Path) -> None:
    robot = read(UR_LIKE, tmp_path)
    assert (robot.name, robot.title, robot.convention_name) == ("ur5_like", "ur5_like", "urdf")
    assert "robot.urdf" in robot.source
    names = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint"]
    assert [joint.name for joint in robot.joints] == names
    assert [joint.limits for joint in robot.joints[1:]] == [(-6.2832, 6.2832), (-3.1416, 3.1416), None]
    assert robot.joints[1].row == {
        **{"x": 0.0, "y": 0.13585, "z": 0.0, "roll": 0.0, "pitch": 1.5708, "yaw": 0.0},
        **{"axis_x": 0.0, "axis_y": 1.0, "axis_z": 0.0},
    }
    odd = read(ODD, tmp_path)
    assert [joint.kind for joint in odd.joints] == ["prismatic", "revolute", "revolute", "revolute", "prismatic"]
    assert [joint.limits for joint in odd.joints] == [(-1.0, 1.5), (-1.0, 1.5), None, None, (0.0, 0.3)]
    assert_allclose([odd.joints[1].row[f"axis_{a}"] for a in "xyz"], np.array([-1, 1, -1]) / math.sqrt(3), rtol=1e-15)
    assert [odd.joints[2].row[f"axis_{a}"] for a in "xyz"] == [1.0, 0.0, 0.0]  # the format's own default


def test_masses_take_in_what_is_fixed_to_a_link(tmp_path: Path) -> None:
    robot, other = read(UR_LIKE, tmp_path), Pinocchio(UR_LIKE)
    assert [mass.joint for mass in robot.masses] == [1, 4]
    for mass in robot.masses:
        expected, lever = other.mass(robot.joints[mass.joint - 1].name)
        assert_allclose(mass.mass, expected, rtol=1e-15)
        assert_allclose(mass.cog, lever, rtol=0, atol=1e-15)


def simple(*joints: str, links: tuple[str, ...] = ("a", "b", "c", "d"), name: str = "simple") -> bytes:
    tags = "\n".join([*(f'<link name="{link}"/>' for link in links), *joints])
    return f'<robot name="{name}">\n{tags}\n</robot>'.encode()


def joint(name: str, parent: str, child: str, type_: str = "continuous", inside: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{type_}">{ends}{inside}</joint>'


ARM = joint("j1", "a", "b")


def test_end_is_tool0_or_flange_or_the_last_moving_link_or_is_named(tmp_path: Path) -> None:
    for links, tip in (
        (("tool0", "flange"), "tool0"),
        (("flange", "tool0"), "tool0"),
        (("flange", "x"), "flange"),
        (("x", "y"), "b"),
    ):
        places = [f'<origin xyz="{i} 2 3" rpy="0 0 {i}"/>' for i in (1, 2)]
        fixed = [joint(f"f{link}", "b", link, "fixed", at) for link, at in zip(links, places, strict=True)]
        content = simple(ARM, *fixed, links=("a", "b", *links))
        check_poses(read(content, tmp_path), content, tip, atol=1e-12)
    fingers = (joint("left", "b", "c"), joint("right", "b", "d", inside='<mimic joint="left"/>'))
    assert [j.name for j in read(simple(ARM, *fingers), tmp_path, "b").joints] == ["j1"]


def test_robot_is_named_by_the_robot_or_the_file(tmp_path: Path) -> None:
    for name, file, expected in (
        ("my.robot-1", "x.urdf", "my.robot-1"),
        ("my robot", "cell_3.urdf", "cell_3"),
        ("", "cell_3.urdf", "cell_3"),
    ):
        assert read_urdf(written(simple(ARM, links=("a", "b"), name=name), tmp_path, file)).name == expected


def test_encodings_and_line_ends_are_read(tmp_path: Path) -> None:
    for content in (b"\xef\xbb\xbf" + UR_LIKE, UR_LIKE.replace(b"\n", b"\r"), ODD):
        robot = read(content, tmp_path)
        assert len(robot.joints) >= 4
        assert calibrated_urdf(content, robot)[0] == content


# -- refusals --------------------------------------------------------------------------------------------------

TURN = joint("turn", "a", "b", "revolute", '<limit lower="-1" upper="1" effort="1" velocity="1"/>')
GRIPPER = joint("l", "tool0", "c") + joint("r", "tool0", "d")
AB = ("a", "b")


def only(inside: str = "", type_: str = "continuous") -> bytes:
    """A file with one joint, whose tag has this inside."""
    return simple(joint("j", "a", "b", type_, inside), links=AB)


def with_mass(inside: str) -> bytes:
    """A file whose second link has this inertial entry."""
    return simple(ARM, links=AB).replace(b'"b"/>\n', f'"b"><inertial>{inside}</inertial></link>\n'.encode(), 1)


def limited(old: str, new: str) -> bytes:
    """A file whose joint has other limits."""
    return simple(TURN.replace(old, new), links=AB)


FIXED = joint("f", "b", "tool0", "fixed")
REFUSED: list[tuple[bytes, tuple[str, ...]]] = [
    (b" \n", ("robot.urdf", "empty")),
    (b"truearm: truearm-robot/1\n", ("robot.urdf, line 1", "not valid XML")),
    (UR_LIKE.replace(b"</robot>", b"</robt>"), ("line 61", "not valid XML", "mismatched tag")),
    (b"<sdf version='1.6'/>", ("not a URDF", "'<sdf>'")),
    (UR_LIKE.decode().encode("utf-16"), ("UTF-8", "Save it")),
    (b"<?xml version='1.0' encoding='klingon'?><robot/>", ("encoding", "klingon", "UTF-8")),
    (b"<?xml version='1.0' encoding='shift-jis'?><robot/>", ("encoding", "UTF-8")),
    (b'<!DOCTYPE robot [<!ENTITY a "b">]><robot name="r"/>', ("DOCTYPE", "Delete")),
    (b'<robot name="r">\n<xacro:macro name="m"/></robot>', ("line 2", "xacro FILE.xacro >")),
    (simple(ARM, links=("a", "${prefix}b")), ("line 3", "xacro")),
    (b'<robot name="r"/>', ("no <link>",)),
    (simple(links=("a",)), ("no moving joint", "revolute, continuous, prismatic")),
    (only(type_="fixed"), ("no moving joint",)),
    (b'<robot name="r"><link/></robot>', ("line 1", "<link> has no name")),
    (simple('<joint type="fixed"/>'), ("line 6", "<joint> has no name")),
    (simple(ARM, links=("a", "b", "b")), ("line 4", "two links", "'b'")),
    (simple(ARM, joint("j1", "b", "c")), ("line 7", "two joints", "'j1'")),
    (only(type_="hinge"), ("joint j", "type", "'hinge'")),
    (simple('<joint name="j"/>', links=AB), ("joint j", "type", "revolute, continuous, prismatic, fixed")),
    (simple('<joint name="j" type="fixed"><child link="b"/></joint>'), ("joint j", "no <parent")),
    (simple('<joint name="j" type="fixed"><parent link="a"/></joint>'), ("joint j", "no <child")),
    (simple(joint("j", "a", "b", inside='<parent link="b"/>')), ("joint j", "more than one <parent>")),
    (simple(joint("j", "base", "b"), links=("base_x", "b")), ("joint j, <parent>", "base_x")),
    (simple(joint("j", "a", "q"), links=AB), ("joint j, <child>", "no link", "'q'")),
    (simple(ARM, joint("j2", "a", "c"), joint("j3", "b", "d"), joint("j4", "c", "d")), ("loop", "link d", "j3 and j4")),
    (simple(ARM, joint("j2", "b", "a"), links=AB), ("loop", "no root")),
    (simple(ARM, joint("j2", "c", "d"), joint("j3", "d", "c")), ("loop", "'c, d'")),
    (simple(joint("j", "b", "b"), links=AB), ("loop", "'b'")),
    (simple(ARM, joint("j2", "c", "d")), ("one root", "'a, c'")),
    (simple(ARM, FIXED, GRIPPER, links=("a", "b", "c", "d", "tool0")), ("outermost joints: l, r", "robot.urdf#tool0")),
    (simple(ARM, joint("j2", "a", "c"), links=("a", "b", "c")), ("branch", "such as b, c", "robot.urdf#b")),
    (only(type_="floating"), ("joint j", "type", "'floating'")),
    (only(type_="planar"), ("joint j", "'planar'")),
    (only('<mimic joint="x"/>'), ("joint j", "mimics", "#LINK")),
    (simple(joint("left joint", "a", "b"), links=AB), ("joint left joint", "letters", "Rename")),
    (only('<origin xyz="0 1"/>'), ("joint j", "<origin xyz>", "'0 1'", "3 numbers")),
    (only('<origin rpy="0 pi 0"/>'), ("joint j", "<origin rpy>", "'0 pi 0'")),
    (only('<origin rpy="0 nan 1_0"/>'), ("<origin rpy>", "nan")),
    (only('<origin xyz="0 0 1e999"/>'), ("<origin xyz>", "1e999")),
    (only('<origin xyz="0 0 1e9"/>'), ("joint j", "<origin xyz>", "too large")),
    (only('<origin xyz="0,0,1"/>'), ("<origin xyz>", "spaces between")),
    (simple(ARM, FIXED.replace("</j", '<origin xyz=""/></j'), links=("a", "b", "tool0")), ("joint f", "<origin xyz>")),
    (only("<origin/><origin/>"), ("joint j", "more than one <origin>")),
    (only('<axis xyz="0 1"/>'), ("joint j", "<axis xyz>")),
    (only('<axis xyz="0 0 0"/>'), ("joint j", "unit vector")),
    (only('<axis xyz="0 3 -4"/>'), ("joint j", "unit vector", "0 0.6 -0.8")),
    (only(type_="revolute"), ("joint j", "revolute", "<limit>", "continuous")),
    (only(type_="prismatic"), ("joint j", "prismatic", "Give the joint's limits.")),
    (limited('"-1"', "'low'"), ("joint turn", "<limit lower>", "'low'")),
    (limited('"-1"', '"-1e16"'), ("joint turn", "<limit lower>", "too large")),
    (limited('"-1"', '"0"').replace(b'upper="1"', b""), ("lower limit must be below", "lower 0.0, upper 0.0")),
    (limited('velocity="1"', 'velocity="-1"'), ("joint turn", "velocity of a <limit> cannot be negative")),
    (limited('velocity="1"', 'velocity="fast"'), ("joint turn", "<limit velocity>", "'fast'")),
    (with_mass(""), ("line 3, link b", "<mass")),
    (with_mass('<mass value="-1"/>'), ("link b", "negative", "-1")),
    (with_mass('<mass value="1 kg"/>'), ("link b", "<mass value>", "'1 kg'", "one number")),
]


def test_file_is_refused(tmp_path: Path) -> None:
    for content, parts in REFUSED:
        with refusing(str(tmp_path), *parts, of=parts):
            read(content, tmp_path)
    for tip, parts in (("tool", ("no link of this name", "'tool'")), ("world", ("no joint moves", "root world"))):
        with refusing("robot.urdf", *parts, of=tip):
            read(UR_LIKE, tmp_path, tip)
    with refusing("'my robot' and 'cell 3'", "Rename the file"):
        read_urdf(written(simple(ARM, links=AB, name="my robot"), tmp_path, "cell 3.urdf"))
    with refusing("no such file"):
        read_urdf(tmp_path / "none.urdf")


# -- the user's file, calibrated -------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "tip"), [("ur_like", "tool0"), ("odd", "l5")])
def test_calibrated_file_has_the_poses_of_the_robot(name: str, tip: str, tmp_path: Path) -> None:
    for seed, scale in enumerate((1e-9, 1e-9, 1e-3, 1e-3, 0.3, 0.3)):
        robot = shifted(read(FILES[name], tmp_path), np.random.default_rng(seed), scale)
        content, left_out = calibrated_urdf(FILES[name], robot)
        check_poses(robot, content, tip, atol=1e-12, seed=seed)
        assert left_out == []
        assert content != FILES[name]
        assert without_origins(content) == without_origins(FILES[name])
        q = robot.random_configurations(10, np.random.default_rng(seed))
        for actual, expected in zip(read(content, tmp_path).world_poses(q), robot.world_poses(q), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-12)


def test_each_parameter_changes_only_its_own_joint(tmp_path: Path) -> None:
    for name, tip in (("ur_like", "tool0"), ("odd", "l5")):
        nominal = read(FILES[name], tmp_path)
        for number, own in enumerate(nominal.joints, 1):
            for parameter in [p for p in nominal.parameters if p.endswith(f"_{number}")]:
                robot = nominal.with_values({parameter: nominal.values[parameter] + 1e-3})
                changed, _ = calibrated_urdf(FILES[name], robot)
                others = [j for j in nominal.joints if j.name != own.name]
                assert [j for j in read(changed, tmp_path).joints if j.name != own.name] == others, parameter
                check_poses(robot, changed, tip, atol=1e-12)


def test_unchanged_robot_leaves_the_file_alone(tmp_path: Path) -> None:
    for content in FILES.values():
        robot = read(content, tmp_path)
        assert calibrated_urdf(content, robot) == (content, [])
        path = tmp_path / "robot.yaml"
        path.write_text(robot_text(robot))
        assert calibrated_urdf(content, read_robot(path)) == (content, [])


def edited(inside: str, values: dict[str, float], folder: Path, type_: str = "continuous") -> str:
    """What becomes of a joint's inside."""
    content = only(inside, type_)
    robot = read(content, folder)
    changed, _ = calibrated_urdf(content, robot.with_values(values))
    return changed.decode().split('<child link="b"/>')[1].split("</joint>")[0]


def test_origin_is_edited_in_place(tmp_path: Path) -> None:
    axis = '<axis xyz="0 0 1"/>'
    for before, values, after in (
        ('<origin xyz="1 2.0 3e0" rpy="0 0 0"/>', {"y_1": 2.5}, '<origin xyz="1 2.5 3e0" rpy="0 0 0"/>'),
        ("<origin rpy='0  1\t0' xyz='1 2 3' />", {"x_1": 0.0}, "<origin rpy='0  1\t0' xyz='0.0 2 3' />"),
        ('<origin xyz="0 0 1"></origin>', {"theta_offset_1": 0.5}, '<origin xyz="0 0 1" rpy="0.0 0.0 0.5"></origin>'),
        ('<origin rpy="0 0 1" />', {"z_1": -0.25}, '<origin rpy="0 0 1" xyz="0.0 0.0 -0.25" />'),
        ("<origin/>", {"z_1": 1e-5, "theta_offset_1": 1.0}, '<origin xyz="0.0 0.0 1e-05" rpy="0.0 0.0 1.0"/>'),
        ("<origin\n/>", {"z_1": 1.0}, '<origin xyz="0.0 0.0 1.0"\n/>'),
        ('<origin xyz="0 0&#32;0"/>', {"z_1": 1.0}, '<origin xyz="0.0 0.0 1.0"/>'),
        ('<origin frame="xyz=\'9\'" xyz="0 0 0"/>', {"x_1": 1.0}, '<origin frame="xyz=\'9\'" xyz="1.0 0 0"/>'),
        ('<!--<origin/>--><origin xyz="0 0 0"/>', {"x_1": 1.0}, '<!--<origin/>--><origin xyz="1.0 0 0"/>'),
        ('<origin rpy="0 1.5708 0" xyz="0 0 0"/>', {"x_1": 1.0}, '<origin rpy="0 1.5708 0" xyz="1.0 0 0"/>'),
    ):
        assert edited(before + axis, values, tmp_path) == after + axis
    of_two_lines = "<joint name='j' note='>' type='continuous'\n><parent link='a'/><child link='b'/></joint>"
    content = simple(of_two_lines, links=AB)
    changed, _ = calibrated_urdf(content, read(content, tmp_path).with_values({"x_1": 0.5}))
    assert changed == content.replace(b"'\n>", b'\'\n><origin xyz="0.5 0.0 0.0"/>')  # behind the start tag


def test_right_angle_stays_a_right_angle(tmp_path: Path) -> None:
    for pitch in (math.pi / 2, -math.pi / 2):
        inside = f'<origin xyz="0 0 0" rpy="0.25 {pitch!r} 0.5"/><axis xyz="1 0 0"/>'
        after = edited(inside, {"theta_offset_1": 0.125}, tmp_path)
        match = re.findall(r'rpy="(\S+) (\S+) (\S+)"', after)[0]
        assert_allclose([float(v) for v in match], [0.375, pitch, 0.5], rtol=0, atol=1e-15)


def test_byte_places_hold_in_long_files_and_behind_a_mark(tmp_path: Path) -> None:
    filler = b"<!--" + " ä".encode() * 100_000 + b"-->"
    content = b"\xef\xbb\xbf" + UR_LIKE.replace(b'<link name="world"/>', filler + b'<link name="world"/>')
    robot = shifted(read(content, tmp_path), np.random.default_rng(5), 1e-3)
    changed, _ = calibrated_urdf(content, robot)
    assert without_origins(changed) == without_origins(content)
    check_poses(robot, changed, "tool0", atol=1e-12)


def test_what_a_urdf_cannot_hold_is_said(tmp_path: Path) -> None:
    plain = read(UR_LIKE, tmp_path)
    robot = plain.with_effects(["gain"]).with_values({"gain_2": 1.001, "gain_4": 0.999})
    robot = robot.with_frames(Transform((1.0, 0.0, 0.0), (0.6, 0.8, 0.0, 0.0)), {"ball": (0.0, 0.0, 0.1)})
    content, left_out = calibrated_urdf(UR_LIKE, robot)
    assert content == UR_LIKE
    gains, base, targets = left_out
    assert re.search(r"joint effect gain.*gain_2, gain_4\.$", gains)
    assert re.search(r"base stands in the instrument's frame.*base_quaternion, base_x\.$", base)
    assert re.search(r"targets.*ball\.$", targets)
    assert urdf_text(robot)[1][:3] == left_out
    assert calibrated_urdf(UR_LIKE, plain.with_effects(["gain"]))[1] == []


def test_another_robots_file_is_not_calibrated(tmp_path: Path) -> None:
    robot = read(UR_LIKE, tmp_path)
    slides = UR_LIKE.replace(b'"elbow_joint" type="revolute"', b'"elbow_joint" type="prismatic"')
    for content, words in (
        (simple(ARM, links=AB), "no joint wrist_1_joint"),
        (UR_LIKE.replace(b'"elbow_joint"', b'"elbow"'), "other joints move"),
        (UR_LIKE.replace(b"0.39225", b"0.39226"), "z of joint wrist_1_joint differs"),
        (UR_LIKE.replace(b'"0.1 0 0.5"', b'"0.1 0 0.6"'), "z of joint shoulder_pan_joint differs"),
        (UR_LIKE.replace(b'"0 0 1"/>', b'"0 0 -1"/>', 1), "axis_z of joint shoulder_pan_joint differs"),
        (slides, "joint elbow_joint is prismatic"),
    ):
        with refusing("not the one this robot was read from", words, of=words):
            calibrated_urdf(content, robot)
    with refusing("irb120 is of convention modified-hayati", "a new URDF can be written"):
        calibrated_urdf(UR_LIKE, load_robot("irb120"))


# -- any file --------------------------------------------------------------------------------------------------


@st.composite
def urdfs(draw: st.DrawFn) -> bytes:
    """A chain of joints of all kinds in all spellings."""
    number = st.sampled_from([0.0, 1.0, -0.5, math.pi / 2, -math.pi / 2, 1.5708, math.pi]) | st.floats(-3.2, 3.2)
    blank = st.sampled_from([" ", "  ", "\n   ", "\t", "\r\n"])

    def triple() -> str:
        return draw(blank).join(draw(st.sampled_from([repr, "{:.17g}".format]))(draw(number)) for _ in range(3))

    types = draw(st.lists(st.sampled_from(["fixed", "revolute", "continuous", "prismatic"]), min_size=1, max_size=6))
    types.insert(draw(st.integers(0, len(types))), "revolute")
    tags = ["<link name='l0'/>"]
    for i, type_ in enumerate(types):
        quote = draw(st.sampled_from("'\""))
        given_ = draw(st.sampled_from([None, [], ["xyz"], ["rpy"], ["xyz", "rpy"], ["rpy", "xyz"]]))
        parts = [f"<parent link='l{i}'/>", f'<child link="l{i + 1}"/>', "<!-- <origin xyz='1 2 3'/> -->"]
        if given_ is not None:
            attributes = "".join(f"{draw(blank)}{a}={quote}{triple()}{quote}" for a in given_)
            parts.append(f"<origin{attributes}{draw(st.sampled_from(['/>', ' />', '></origin>']))}")
        if type_ != "fixed":
            axis = draw(
                st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (0.6, -0.8, 0), (0.36, 0.48, 0.8)])
            )
            parts.append(f"<axis xyz='{axis[0]} {axis[1]} {axis[2]}'/>")
            parts.append("<limit lower='-1' upper='1' effort='1' velocity='1'/>")
        inside = draw(st.sampled_from(["", "\n", "\r\n  "])).join(draw(st.permutations(parts)))
        tags += [f"<joint name='j{i}' type='{type_}'>{inside}</joint>", f"<link name='l{i + 1}'/>"]
    text = draw(st.sampled_from(["\n", "\r\n", ""])).join(draw(st.permutations(tags)))
    return f"<robot name='any'>{text}</robot>".encode()


@settings(deadline=None)
@given(content=urdfs(), seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([1e-6, 1e-3, 1.0]))
def test_any_file_is_read_and_calibrated(
    content: bytes, seed: int, scale: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    tip = f"l{content.count(b'<joint')}"
    path = written(content, tmp_path_factory.getbasetemp())
    nominal = read_urdf(path, tip)
    check_poses(nominal, content, tip, atol=1e-11, seed=seed)
    assert calibrated_urdf(content, nominal)[0] == content
    robot = shifted(nominal, np.random.default_rng(seed), scale)
    changed, left_out = calibrated_urdf(content, robot)
    check_poses(robot, changed, tip, atol=1e-11, seed=seed)
    assert without_origins(changed) == without_origins(content)
    assert left_out == []


ANGLE = st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, 1.5708]) | st.floats(-7, 7)


def turned(rpy: tuple[float, float, float]) -> Array:
    roll, pitch, yaw = rpy
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(Rz @ Ry @ Rx)


@given(rpy=st.tuples(ANGLE, ANGLE, ANGLE), near=st.tuples(ANGLE, ANGLE, ANGLE))
def test_angles_turn_as_the_rotation_does(rpy: tuple[float, float, float], near: tuple[float, float, float]) -> None:
    R = turned(rpy)
    assert_allclose(turned(roll_pitch_yaw(R, near)), R, rtol=0, atol=1e-14)
    assert_allclose(turned(roll_pitch_yaw(R)), R, rtol=0, atol=1e-14)


@given(roll=ANGLE, yaw=ANGLE, pitch=st.sampled_from([math.pi / 2, -math.pi / 2, 1.2, 2.0, -1.5708, 0.0]))
def test_angles_are_those_nearest(roll: float, pitch: float, yaw: float) -> None:
    assert_allclose(roll_pitch_yaw(turned((roll, pitch, yaw)), (roll, pitch, yaw)), (roll, pitch, yaw), atol=1e-9)


# -- a new file ------------------------------------------------------------------------------------------------


def check_new_file(robot: Robot, folder: Path) -> None:
    """Check poses, masses and limits of the URDF that is written for a robot."""
    text, _ = urdf_text(robot)
    at_identity = robot.with_frames(Transform(), {})
    check_poses(at_identity, text, "tool0", atol=1e-12)
    again = read(text.encode(), folder)
    assert [(j.name, j.kind, j.limits, j.max_speed) for j in again.joints] == [
        (j.name, j.kind, j.limits, j.max_speed) for j in robot.joints
    ]
    assert [(m.joint, m.mass) for m in again.masses] == [(m.joint, m.mass) for m in robot.masses]
    q = np.zeros((1, len(robot.joints)))
    for old, new in zip(at_identity.masses, again.masses, strict=True):
        centres = []
        for r, mass in ((at_identity, old), (again, new)):
            links = Chain(tuple(e for link in r.link_elements[: mass.joint] for e in link))
            kinematics = links.forward_kinematics(r.variables(q, r.values), r.values)
            centres.append(kinematics.matrix()[0] @ mass.cog + kinematics.position[:, 0])
        assert_allclose(centres[1], centres[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("robot_id", ARMS)
def test_new_file_of_library_robot(robot_id: str, tmp_path: Path) -> None:
    for robot in (load_robot(robot_id), shifted(load_robot(robot_id), np.random.default_rng(1), 1e-3)):
        check_new_file(robot, tmp_path)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_new_file_of_robot_of_any_convention(convention: Convention, tmp_path: Path) -> None:
    kinds: tuple[JointKind, ...] = ("revolute", "prismatic", "revolute", "revolute", "prismatic")
    limits = ((-0.5, 0.25), (-0.5, 0.25), (-0.5, 0.25), None, (-0.5, 0.25))
    masses = (LinkMass(2, 1.5, (0.1, 0.2, -0.3)), LinkMass(5, 0.5, (0.0, 0.0, 0.1)))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        robot = random_robot(convention, (), rng, kinds)
        joints = tuple(replace(j, limits=own) for j, own in zip(robot.joints, limits, strict=True))
        check_new_file(shifted(replace(robot, joints=joints, masses=masses), rng, 0.1), tmp_path)


def test_velocities_of_limits_are_the_speeds_of_the_joints_and_what_is_not_known_is_said(tmp_path: Path) -> None:
    robot = load_robot("irb120")
    free = replace(robot, joints=(replace(robot.joints[0], limits=None), *robot.joints[1:]))
    path = tmp_path / "arm.urdf"
    for result, words in (
        (with_speeds(robot), "Effort and velocity limits are not known and stand as 0."),
        (free, "Effort limits are not known and stand as 0."),
        (
            with_speeds(free, 1.5, None, 2.5, 3.5, 4.5),
            "Effort limits, and velocity limits of axis_2, axis_6, are not known and stand as 0.",
        ),
    ):
        text, left_out = urdf_text(result)
        assert left_out == [words, "Inertia tensors are not written and stand as 0."]
        path.write_text(text)
        again = read_urdf(path)
        assert [(joint.limits, joint.max_speed) for joint in again.joints] == [
            (joint.limits, joint.max_speed) for joint in result.joints
        ]
        saved = robot_from_file(RobotFile(**YAML(typ="safe").load(robot_text(again))), "again")
        assert [joint.max_speed for joint in saved.joints] == pytest.approx(
            [joint.max_speed for joint in result.joints]
        )


def with_speeds(robot: Robot, *speeds: float | None) -> Robot:
    """Return a robot whose joints have these speeds at 100 %, and none beyond."""
    pairs = zip_longest(robot.joints, speeds)
    return replace(robot, joints=tuple(replace(joint, max_speed=speed) for joint, speed in pairs))


def test_a_velocity_that_no_joint_has_is_unknown(tmp_path: Path) -> None:
    for velocity, speed in (("3.15", 3.15), ("0", None), ("0.1", None), ("1e6", None)):
        path = written(limited('velocity="1"', f'velocity="{velocity}"'), tmp_path)
        assert read_urdf(path).joints[0].max_speed == speed, velocity
    assert read(limited('velocity="1"', ""), tmp_path).joints[0].max_speed is None


def test_two_masses_of_one_link_become_one(tmp_path: Path) -> None:
    masses = (LinkMass(1, 1.0, (0.1, 0.0, 0.0)), LinkMass(1, 3.0, (0.0, 0.2, 0.0)), LinkMass(1, 0.0, (9.0, 9.0, 9.0)))
    robot = Robot("arm", "", "", "modified-dh", (Joint("J1", "revolute", {"d": 0.2}),), masses=masses)
    (mass,) = read(urdf_text(robot)[0].encode(), tmp_path).masses
    # d lies behind the joint: seen from the joint's own frame the link's frame is 0.2 m out.
    assert_allclose((mass.mass, *mass.cog), (4.0, 0.025, 0.15, 0.2), rtol=0, atol=1e-15)


def test_new_file_is_refused() -> None:
    for joints, parts in (
        ((Joint("Z", "prismatic", {}),), ("arm, joint Z", "limits of a prismatic joint")),
        ((Joint("A", "revolute", {}), Joint("A", "revolute", {})), ("two joints of one name", "'A'")),
        ((Joint("tool0_joint", "revolute", {}),), ("two joints of one name", "'tool0_joint'")),
    ):
        with refusing(*parts, of=parts):
            urdf_text(Robot("arm", "", "", "standard-dh", joints))
