"""Kinematics files of Universal Robots: what is read, how it is placed, and what is written."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from ruamel.yaml import YAML
from tests import ur_controller as ur
from tests.expecting import refusing

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.ur_kinematics import (
    controller_robot,
    mean_angle,
    mean_distance,
    read_kinematics,
    refuse_far,
    with_kinematics,
)
from truearm.robot_files.formats import exported

JOINTS = np.random.default_rng(3).uniform(-np.pi, np.pi, (50, 6))
#: An arm with the lengths of a UR5 as the ROS driver wrote it (a public repository; its hash is calib_1520...).
ROS = """\
kinematics:
  shoulder: {x: 0, y: 0, z: 0.089201138580847966, roll: -0, pitch: 0, yaw: 1.5413963267648517e-05}
  upper_arm: {x: 8.28481932000539e-05, y: 0, z: 0, roll: 1.5702793305568989, pitch: 0, yaw: 9.4248239648454113e-05}
  forearm: {x: -0.42514603197027351, y: 0, z: 0, roll: 0.00027727163297603633, pitch: 0.00074181659174685764,
    yaw: 8.2061777589927939e-05}
  wrist_1: {x: -0.39231335412023205, y: 0.00070367842866065884, z: 0.11004902881674888, roll: 3.1351985141209435,
    pitch: -3.1400954402443415, yaw: 3.1415185610293745}
  wrist_2: {x: 3.6501405590628345e-05, y: -0.094721186124807052, z: 0.0001791428279527357, roll: 1.5689050644312028,
    pitch: 0, yaw: -1.320607040336194e-05}
  wrist_3: {x: 0.00015399008043081661, y: 0.082421327089370319, z: 0.00012632686207930083, roll: 1.5723290218826846,
    pitch: 3.1415926535897931, yaw: -3.14158677108863}
  hash: calib_15200003067234149431
"""


def written(folder: Path, text: str, name: str = "calibration.conf") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def arm_of(folder: Path, text: str, robot: str) -> Robot:
    return with_kinematics(load_robot(robot), read_kinematics(written(folder, text)))


def ur10e_conf() -> str:
    plain = ur.table("ur10e")
    return ur.conf_of(*(np.array(row) - own for row, own in zip(ur.UR10E_TABLE, plain, strict=True)))


PUBLISHED = ((ur.UR10_CONF, "ur10"), (ur.UR3E_CONF, "ur3e"), (ur10e_conf(), "ur10e"))


def test_poses_are_those_of_the_controllers_table_and_frames_lie_beside_the_nominal_ones(tmp_path: Path) -> None:
    # Three arms as they were published, with d up to 446 m.
    for conf, robot in PUBLISHED:
        arm, type_ = arm_of(tmp_path, conf, robot), load_robot(robot)
        expected = ur.forward(ur.table(robot, conf), JOINTS)
        for model in (arm, controller_robot(arm)):
            positions, rotations = model.world_poses(JOINTS)
            assert_allclose(positions, expected[:, :3, 3], rtol=0, atol=1e-9, err_msg=robot)
            assert_allclose(rotations, expected[:, :3, :3], rtol=0, atol=1e-9, err_msg=robot)
        for unit, most in (("m", 2e-3), ("rad", 0.01)):
            assert max(abs(p.value - p.nominal) for p in arm.parameters.values() if p.unit == unit) < most, robot
        assert arm.masses == type_.masses
        assert 0.5e-3 < mean_distance(arm, type_) < 3e-3


def test_a_file_of_another_type_or_kind_is_refused(tmp_path: Path) -> None:
    for conf, robot in ((ur.UR10_CONF, "ur5e"), (ur.UR3E_CONF, "ur5"), (ur10e_conf(), "ur3e")):
        with refusing("another type of robot; got 'a flange ", " mm from that of ur", "allowed: 20 mm", of=robot):
            refuse_far(arm_of(tmp_path, conf, robot), load_robot(robot), "calibration.conf")
    for robot in ("irb120", "li3", "kr5"):
        with pytest.raises(InputError, match=r"another kind is given|must have the table and the frames"):
            arm_of(tmp_path, ur.UR10_CONF, robot)
    for robot in ("irb120", "li3", "katana450"):
        with refusing("no arm of the kind that the format describes", of=robot):
            exported(load_robot(robot), "ur-kinematics")


def test_angles_of_the_ros_driver_are_read_in_the_order_in_which_it_writes_them(tmp_path: Path) -> None:
    # A DH link leads along the next axis: so it does with Rx Ry Rz, and with the order of URDF it misses that.
    kinematics = read_kinematics(written(tmp_path, ROS, "ros.yaml"))
    assert kinematics.frames is not None
    for frame in (kinematics.frames[4], kinematics.frames[5]):
        along = frame[:3, 3] - [frame[0, 3], 0, 0]
        assert np.linalg.norm(np.cross(along / np.linalg.norm(along), frame[:3, 2])) < 1e-12
    assert kinematics.identity == {"hash": "calib_15200003067234149431"}
    assert 0.5e-3 < mean_distance(with_kinematics(load_robot("ur5"), kinematics), load_robot("ur5")) < 3e-3


def test_what_is_exported_is_read_again(tmp_path: Path) -> None:
    arm = arm_of(tmp_path, ur.UR10_CONF, "ur10")
    export = exported(arm, "ur-kinematics")
    again = with_kinematics(load_robot("ur10"), read_kinematics(written(tmp_path, export.text, "ros.yaml")))
    for first, other in zip(again.world_poses(JOINTS), arm.world_poses(JOINTS), strict=True):
        assert_allclose(first, other, rtol=0, atol=1e-12)
    assert "hash: truearm_" in export.text
    assert "0x6e0f7bf" not in export.text
    assert any("cannot hold masses" in line for line in export.left_out)
    assert any("hash of this one" in line for line in export.left_out)


def test_frames_in_an_exported_file_are_those_of_urdf() -> None:
    # The chain of xacro: origins with roll, pitch and yaw about fixed axes, joints about z.
    arm = load_robot("ur5e").with_values({"alpha_2": 0.002, "beta_3": -0.001, "theta_offset_4": 0.01, "a_1": 1e-4})
    text = exported(arm, "ur-kinematics").text
    values = [float(v) for v in re.findall(r"^    \w+: (\S+)$", text, re.M)]
    assert len(values) == 36
    pose = np.tile(np.eye(4), (len(JOINTS), 1, 1))
    for link, q in zip(np.reshape(values, (6, 6)), JOINTS.T, strict=True):
        origin = np.eye(4)
        roll, pitch, yaw = (ur.rotation(np.eye(3)[axis] * angle) for axis, angle in enumerate(link[3:]))
        origin[:3, :3], origin[:3, 3] = yaw @ pitch @ roll, link[:3]
        turned = np.array([np.block([[ur.rotation(np.array([0, 0, a])), np.zeros((3, 1))], [0, 0, 0, 1]]) for a in q])
        pose = pose @ origin @ turned
    positions, rotations = arm.world_poses(JOINTS)
    assert_allclose(pose[:, :3, 3], positions, rtol=0, atol=1e-12)
    assert_allclose(pose[:, :3, :3], rotations, rtol=0, atol=1e-12)


def test_a_tilted_flange_is_said_to_be_left_out() -> None:
    arm = load_robot("ur5e").with_values({"alpha_6": 0.002, "a_6": 1e-3, "base_x": 1.0})
    message = " ".join(exported(arm, "ur-kinematics").left_out)
    assert "cannot hold a flange beside the last axis; left out: 1 mm and 0.1146 deg" in message
    assert "base_x" in message


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r"delta_d = .*\n", "", "a list is missing, so the file is not whole"),
        (r"delta_alpha(.|\n)*", "", "a list is missing"),
        (r", 0.999.*|, 9.74999561134540574e-07\]", "]", "six numbers in brackets belong here"),
        (r", 9.74999561134540574e-07\]", "", "six numbers in brackets belong here"),
        ("-0.103609197138685979", "nan", "six numbers in brackets belong here"),
        ("-0.103609197138685979", "1e400", "calibration.conf"),
        ("calibration_status = 2", "calibration_status = 1", "does not compute with these kinematics"),
        (r"delta_a = ", "delta_d = ", "an entry is given twice"),
        ("0x6e0f7bf", "0x6\x07", "joint_checksum: this is no checksum"),
        ("0x6e0f7bf", "0x6e0f7bf" * 10_000, "joint_checksum: this is no checksum"),
    ],
)
def test_a_damaged_file_is_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    text = re.sub(old, new, ur.UR10_CONF, count=1)
    assert text != ur.UR10_CONF
    with refusing(said):
        read_kinematics(written(tmp_path, text))


def test_a_damaged_file_of_the_ros_driver_is_refused(tmp_path: Path) -> None:
    for old, new in (("wrist_3", "wrist_4"), ("hash", "hush"), ("yaw: 1.5413963267648517e-05", "yaw: east")):
        with refusing("ros.yaml, kinematics", of=new):
            read_kinematics(written(tmp_path, ROS.replace(old, new), "ros.yaml"))
    # As a copy that broke off in its last number leaves it.
    rows = re.findall(r"  (\w+): \{([^}]*)\}", ROS)
    lines = [f"  {link}:\n" + re.sub(r"(\w+: [^,}\s]+)[,\s]*", r"    \1\n", row) for link, row in rows]
    broken = re.sub(r"yaw: -3\.1\d+\n$", "yaw: -3.1", "kinematics:\n" + "".join(lines))
    assert broken.endswith("yaw: -3.1")
    for text in (ROS.partition("  hash")[0], ROS.partition("  hash")[0] + "  hash: ''\n", broken):
        with refusing("ros.yaml, kinematics: the hash is missing, so the file is not whole", of=text[-30:]):
            read_kinematics(written(tmp_path, text, "ros.yaml"))


def test_what_is_no_kinematics_file_is_refused_and_a_file_of_blanks_at_once(tmp_path: Path) -> None:
    # Of so many blank lines each was once read again from every one before it, which would take ten minutes.
    blanks = ("\n" * 300_000 + "x: 1\n", "delta_" + "a" * 300_000, "delta_a" + " " * 300_000 + "b")
    for text in ("a,b,c\n1,2,3\n", "truearm: truearm-robot/1\nname: x\n", *blanks):
        with refusing("some.yaml", of=text[:20]):
            read_kinematics(written(tmp_path, text, "some.yaml"))


def test_blanks_before_a_list_are_read(tmp_path: Path) -> None:
    text = ur.UR10_CONF.replace("[mounting]\n", "\n\n").replace("delta_", "\t  delta_")
    kinematics = read_kinematics(written(tmp_path, text))
    assert kinematics.deltas == read_kinematics(written(tmp_path, ur.UR10_CONF)).deltas


def test_a_flange_that_is_turned_far_is_refused(tmp_path: Path) -> None:
    type_ = load_robot("ur10")
    theta, a, d, alpha = ur.deltas(ur.UR10_CONF)
    zeros = (theta + np.array([0, 0, 0, 0, 0, angle]) for angle in (0.0, 0.09))  # of joint 6, which moves no flange
    plain, turned = (arm_of(tmp_path, ur.conf_of(zero, a, d, alpha), "ur10") for zero in zeros)
    assert mean_distance(turned, type_) == pytest.approx(mean_distance(plain, type_))
    assert np.degrees(mean_angle(plain, type_)) == pytest.approx(0.362, abs=1e-3)
    assert np.degrees(mean_angle(turned, type_)) == pytest.approx(np.degrees(0.09), abs=0.1)
    refuse_far(plain, type_, "calibration.conf")
    with refusing("a flange turned by 5.18 deg from that of ur10 on average", "allowed: 1 deg"):
        refuse_far(turned, type_, "calibration.conf")


def test_joint_zeros_that_cancel_at_the_flange_are_refused_at_the_link() -> None:
    # Axes 2 and 3 are parallel: the flange is not turned, and that of a short arm moves less than 20 mm.
    type_ = load_robot("ur3e")
    arm = type_.with_values({"theta_offset_2": 0.045, "theta_offset_3": -0.045})
    assert mean_angle(arm, type_) < 1e-6
    assert mean_distance(arm, type_) < 0.02
    with refusing("does not come to lie beside the nominal one", "2.58 deg", "allowed: 50 mm, 2 deg", "link 2"):
        refuse_far(arm, type_, "calibration.conf")


def test_a_base_aside_of_the_first_axis_is_refused(tmp_path: Path) -> None:
    text = ROS.replace("roll: -0,", "roll: 0.01,")
    with pytest.raises(InputError, match="the first axis is not the z axis of the base frame"):
        with_kinematics(load_robot("ur5"), read_kinematics(written(tmp_path, text, "ros.yaml")))


def test_differences_are_not_added_to_a_table_that_is_measured_already(tmp_path: Path) -> None:
    kinematics = read_kinematics(written(tmp_path, ur.UR10_CONF))
    text = robot_text(load_robot("ur10"))
    tilted = read_robot(written(tmp_path, text.replace("beta: 0.0", "beta: 0.1"), "tilted.yaml"))
    assert tilted.joints != load_robot("ur10").joints
    with pytest.raises(InputError, match="differences to the table of a type"):
        with_kinematics(tilted, kinematics)


def test_a_frame_far_from_the_types_is_refused(tmp_path: Path) -> None:
    # The same poses from a table with x turned by half a turn: masses would go to the other side.
    text = re.sub(
        r"a: -612\.0, ([^}]*)\}(\n.*?)theta_offset: 0\.0",
        r"a: 612.0, \1}\2theta_offset: 180.0",
        robot_text(load_robot("ur10")).replace(
            "name: shoulder, type: revolute, theta_offset: 0.0", "name: shoulder, type: revolute, theta_offset: 180.0"
        ),
        count=1,
    )
    odd = read_robot(written(tmp_path, text, "odd.yaml"))
    assert_allclose(odd.world_poses(JOINTS)[0], load_robot("ur10").world_poses(JOINTS)[0], atol=1e-9)
    text = exported(arm_of(tmp_path, ur.UR10_CONF, "ur10"), "ur-kinematics").text
    arm = with_kinematics(odd, read_kinematics(written(tmp_path, text, "ros.yaml")))
    with pytest.raises(InputError, match="does not come to lie beside the nominal one"):
        refuse_far(arm, odd, "ros.yaml")


def test_a_robot_file_holds_what_the_controller_computes_with(tmp_path: Path) -> None:
    arm = arm_of(tmp_path, ur.UR10_CONF, "ur10")
    again = read_robot(written(tmp_path, robot_text(arm), "arm.yaml"))
    assert robot_text(again) == robot_text(arm)
    assert again.controller.kinematics.kind == "own"
    assert again.controller.kinematics.identity["joint_checksum"].startswith("0x6e0f7bf, ")
    for first, other in zip(controller_robot(again).world_poses(JOINTS), arm.world_poses(JOINTS), strict=True):
        assert_allclose(first, other, rtol=0, atol=1e-12)


def test_a_robot_file_says_it_in_a_word_and_where_that_is_known_from(tmp_path: Path) -> None:
    plain = robot_text(load_robot("ur10"))
    for kind in ("nominal", "proprietary", "unknown"):
        for entry, source in ((kind, ""), (f"{{kind: {kind}, source: the order}}", "the order")):
            text = plain.replace("controller:\n", f"controller:\n  kinematics: {entry}\n")
            arm = read_robot(written(tmp_path, text, "arm.yaml"))
            assert (arm.controller.kinematics.kind, arm.controller.kinematics.source) == (kind, source)
            assert read_robot(written(tmp_path, robot_text(arm), "again.yaml")) == arm, entry


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("calibration.conf", r"arm\.yaml, controller\.kinematics: .*nobody can read these kinematics"),
        ("nominl", "Did you mean nominal"),
        ("other.conf", "another type of robot"),
        ("12", "text|known|kinematics"),
        ("{kind: own}", "one row belongs here for each joint"),
        ("{kind: nominal, joints: [{theta_offset: 0, d: 0, a: 0, alpha: 0}]}", "nominal kinematics have no rows"),
        ("{kind: secret}", r"kinematics\.kind: this value is not known"),
        ("{kind: proprietary, joints: [{theta_offset: 0, d: 0, a: 0, alpha: 0}]}", "proprietary kinematics have no"),
        ("{kind: own, identity: {hash: " + "a" * 201 + "}}", r"kinematics\.identity\.hash: this is no checksum"),
        ("{kind: own, joints: [{theta_offset: 0, d: .nan, a: 0, alpha: 0}]}", r"joints\[1\]\.d: .*not a num"),
        ("{kind: own, joints: [{theta_offset: 0, a: 0, alpha: 0}]}", r"joints\[1\]\.d: this entry is mis"),
        ("{kind: own, rows: []}", r"kinematics\.rows: this entry is not known here"),
        ("", r"kinematics: this does not say .* got nothing; allowed: nominal, prop"),
        ("''", r"kinematics: this does not say .* got ''"),
        ("3", r"kinematics: this does not say .* got 3"),
        ("[nominal]", r"kinematics: this does not say .* got \[nominal\]"),
        ("{kind: own, joints: [" + "{theta_offset: 0, d: 0, a: 0, alpha: 0}, " * 6 + "]}", "another type of robot"),
    ],
)
def test_kinematics_that_nobody_can_read_are_refused(entry: str, said: str, tmp_path: Path) -> None:
    written(tmp_path, ur.UR3E_CONF, "other.conf")
    text = robot_text(load_robot("ur10")).replace("controller:\n", f"controller:\n  kinematics: {entry}\n")
    with pytest.raises(InputError, match=said):
        read_robot(written(tmp_path, text, "arm.yaml"))


def test_rows_of_another_arm_in_a_robot_file_are_refused(tmp_path: Path) -> None:
    yaml = YAML(typ="safe")
    text = robot_text(arm_of(tmp_path, ur.UR10_CONF, "ur10"))
    for row, column, wrong, words in (
        (1, "a", 60.0, "another type of robot"),
        (5, "theta_offset", 5.0, "no arm of this type"),
        (1, "beta", 30.0, "another type of robot"),
    ):
        content = yaml.load(text)
        rows = content["controller"]["kinematics"]["joints"]
        rows[row][column] = rows[row].get(column, 0.0) + wrong
        with (tmp_path / "arm.yaml").open("w") as stream:
            yaml.dump(content, stream)
        with refusing("arm.yaml, controller.kinematics: ", words, of=column):
            read_robot(tmp_path / "arm.yaml")


def test_rows_of_a_robot_of_another_kind_are_refused(tmp_path: Path) -> None:
    arm = load_robot("katana450")
    rows = ", ".join(["{theta_offset: 0, d: 0, a: 0, alpha: 0}"] * len(arm.joints))
    text = f"{robot_text(arm)}controller:\n  kinematics: {{kind: own, joints: [{rows}]}}\n"
    assert text.count("controller:") == 1
    with pytest.raises(InputError, match=r"another kind is given|must have the table and the frames"):
        read_robot(written(tmp_path, text, "arm.yaml"))
