from __future__ import annotations

import math
import re
from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from ruamel.yaml import YAML
from tests.engine.robot.library import outside, outside_poses
from tests.expecting import refusing

from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.conventions.convention import parallel_joints_without_beta
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.parts import Reach
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot, robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.robot_file.seal import is_intact, sealed
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import rotation_from_vector
from truearm.engine.robot.urdf import read_urdf
from truearm.engine.robot.urdf_writing import urdf_text

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
#: Arms of whose joints no public source says how fast they are at 100 %, and why.
NO_SPEEDS = {
    "irb1600": "the package has those of the arm with another payload",
    "katana450": "not in the thesis",
    "li3": "invented",
    "mz07f": "not in the source",
    "puma560": "not in the source",
    "tx2_60": "the package has those of the TX2-60L",
    "tx2_90l": "the package has the nominal ones, which joints may exceed",
    "vs060": "the package has shares of other figures",
}
#: Six joint positions [deg] and positions of the flange [mm] that a pendant showed: gstorm-b/RobotKinematics.
PENDANT_OF_THE_MZ07F = (
    (21.4862, 64.4801, -41.7744, -180.007, 22.7216, -158.513, 339.525, 133.617, 278.473),
    (18.6965, 68.6763, -39.6996, -158.418, 38.2621, -180.401, 339.486, 133.658, 311.388),
    (4.98917, 73.5581, -44.4732, -189.95, 35.3251, -153.57, 339.5, 21.8373, 319.019),
    (-20.077, 72.1081, -41.8598, -0.0550513, -30.2747, -20.0276, 339.503, -124.14, 319.977),
    (-17.8857, 69.2501, -38.4703, -14.4347, -45.5303, -25.5808, 339.474, -124.15, 319.966),
    (-25.4971, 70.7751, -42.0408, 44.0796, -38.9396, -79.9948, 339.49, -124.109, 319.939),
)
#: Arms without a maker's reach, and why.
NO_REACH = {
    "katana450": "its flange is an attachment of the thesis",
    "li3": "invented",
    "puma560": "no maker's figure at hand",
}


@pytest.mark.parametrize("robot_id", library())
def test_an_arm_is_what_its_file_says(robot_id: str, tmp_path: Path) -> None:
    robot = load_robot(robot_id)
    it_says_what_it_is(robot_id, robot)
    limits_and_speeds_are_those_of_an_arm(robot)
    forward_and_inverse_agree(robot)
    a_urdf_of_it_is_the_same_arm(robot, tmp_path / "arm.urdf")
    its_file_is_the_same_arm(robot, tmp_path / "arm.yaml")
    its_truths_are_near(robot)
    assert parallel_joints_without_beta(robot.convention, [joint.row for joint in robot.joints]) == []


def it_says_what_it_is(robot_id: str, robot: Robot) -> None:
    assert robot.name == robot_id == robot_id.lower()
    assert robot.title not in ("", robot_id)
    assert len(robot.source) > 20
    assert robot.maker or robot_id == "li3"


def limits_and_speeds_are_those_of_an_arm(robot: Robot) -> None:
    speeds = [joint.max_speed for joint in robot.joints]
    assert (None in speeds) == (robot.name in NO_SPEEDS)
    for joint, speed in zip(robot.joints, speeds, strict=True):
        assert joint.kind == "revolute"
        assert joint.limits is not None
        low, high = np.degrees(joint.limits)
        assert low < high
        assert 90.0 <= high - low <= 1080.0
        assert max(abs(low), abs(high)) <= 540.0
        assert speed is None or 70.0 - 1e-9 <= np.degrees(speed) <= 1500.0


def forward_and_inverse_agree(robot: Robot) -> None:
    q = robot.random_configurations(10, np.random.default_rng(1))
    solution = robot.inverse(*robot.forward(q))
    positions, rotations = robot.forward(solution.joints)
    expected = robot.forward(q)
    assert_allclose(positions, expected[0], rtol=0, atol=1e-8)
    assert_allclose(rotations, expected[1], rtol=0, atol=1e-7)


def a_urdf_of_it_is_the_same_arm(robot: Robot, path: Path) -> None:
    path.write_text(urdf_text(robot)[0], encoding="utf-8")
    again = read_urdf(path)
    q = robot.random_configurations(10, np.random.default_rng(2))
    for first, other in zip(again.forward(q), robot.forward(q), strict=True):
        assert_allclose(first, other, rtol=0, atol=1e-9)
    for one_joint, joint in zip(again.joints, robot.joints, strict=True):
        assert_allclose(one_joint.range, joint.range, rtol=0, atol=1e-9)
        assert one_joint.max_speed == joint.max_speed


def its_file_is_the_same_arm(robot: Robot, path: Path) -> None:
    text = robot_text(robot)
    assert robot.reach is None or f"distance: {robot.reach.distance * 1e3:.10g}" in text
    assert text.count("max_speed: ") == sum(joint.max_speed is not None for joint in robot.joints)
    path.write_text(text, encoding="utf-8")
    assert read_robot(path) == robot
    assert robot_text(read_robot(path)) == text


def its_truths_are_near(robot: Robot) -> None:
    """Nothing published is off by more than 5 mm or 0.5 deg; the IRB 120's d_1 stands in base_z."""
    for truth in robot.truths.values():
        assert truth.source
        for name, value in truth.values.items():
            nominal = robot.parameters[name]
            if nominal.group != "base" and name != "d_1":
                assert abs(value - nominal.value) < {"m": 5e-3, "rad": np.radians(0.5)}[nominal.unit], name


def test_titles_are_unlike_and_invented_numbers_say_so() -> None:
    robots = [load_robot(robot_id) for robot_id in library()]
    assert len({robot.title for robot in robots}) == len(robots)
    texts = (load_robot("li3").source, load_robot("li3").title, load_robot("lrmate200ic").truths["invented"].source)
    assert all("invented" in text.lower() for text in texts)


def test_every_arm_is_held_against_something_outside() -> None:
    assert {*outside.known()} | {*NO_URDF} == {*library()}
    assert not {*outside.known()} & {*NO_URDF}


@pytest.mark.parametrize("robot_id", outside.known())
def test_poses_limits_and_frames_are_those_of_a_public_urdf(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    assert stored.robot == robot_id
    assert set(stored.source) == {"repository", "path", "revision"}
    assert bool(stored.reason) == stored.differs
    assert len(stored.joints) >= 8
    positions, rotations = robot.forward(stored.joints)
    assert_allclose(positions, stored.poses[:, :3, 3], rtol=0, atol=1e-5)  # 0.01 mm
    assert_allclose(rotations, stored.poses[:, :3, :3], rtol=0, atol=1e-6)
    limits_are_those_of_the_urdf_or_their_difference_is_explained(robot, stored)
    if has_controller_s_frames(robot, stored):
        the_controller_s_frames_are_base_and_tool0_of_the_urdf(robot, stored)


def limits_are_those_of_the_urdf_or_their_difference_is_explained(robot: Robot, stored: outside.Outside) -> None:
    limits = np.array([joint.range for joint in robot.joints])
    same = np.abs(limits - stored.limits).max() <= math.radians(0.1)
    assert same == (not stored.limits_differ)


def has_controller_s_frames(robot: Robot, stored: outside.Outside) -> bool:
    """Return whether base and tool0 of a URDF are the frames of a controller that the library knows."""
    named = (stored.base, stored.tip) == ("base", "tool0") or stored.robot in OTHER_NAMES
    return robot.controller != AS_THE_MODEL and named


def the_controller_s_frames_are_base_and_tool0_of_the_urdf(robot: Robot, stored: outside.Outside) -> None:
    assert (robot.controller.signs or (1,) * len(robot.joints)) == stored.signs
    positions, rotations = robot.forward(stored.joints, frame="controller")
    assert_allclose(positions, stored.urdf_poses[:, :3, 3], rtol=0, atol=1e-5)
    assert_allclose(rotations, stored.urdf_poses[:, :3, :3], rtol=0, atol=1e-6)


@pytest.mark.parametrize("robot_id", sorted({*library()} - {*NO_REACH}))
def test_it_reaches_as_far_as_its_maker_says(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.reach is not None
    if robot_id not in NO_POINT:
        assert robot.reach.point is not None
        assert outside.largest_reach(robot) == pytest.approx(robot.reach.distance, rel=0.01)
        return
    assert robot.reach.point is None  # of no point: less than the flange's
    largest = outside.largest_reach(replace(robot, reach=Reach(robot.reach.distance, 1, "flange")))
    assert robot.reach.distance < largest < 1.25 * robot.reach.distance


def test_arms_without_a_published_reach_have_none() -> None:
    assert [robot_id for robot_id in library() if load_robot(robot_id).reach is None] == sorted(NO_REACH)


def test_the_crx_counts_as_the_examples_of_abbes_and_poisson_do() -> None:
    robot = load_robot("crx10ia")
    for joints, position, angles in (  # deg; mm; W, P and R in deg
        ((78, -41, 17, -42, -60, 10), (80.321, 287.676, 394.356), (-131.819, -45.268, 61.453)),
        ((0, -45, 44, -37, -53, 0), (209.470, -42.894, 685.496), (-95.378, -64.226, -56.402)),
        ((14.478, 11.999, -29.780, 0, -60.220, 55.522), (600, 0, 100), (-180, 0, 70)),
    ):
        q = robot.controller.to_model(np.radians([joints]))
        result, R = robot.forward(q, frame="controller")
        assert_allclose(result[0] * 1e3, position, atol=0.01)  # the joints of the last have three digits
        w, p, r = np.radians(angles)
        about_x, about_y, about_z = (rotation_from_vector(v) for v in np.diag([w, p, r]))
        assert_allclose(R[0], about_z @ about_y @ about_x, atol=3e-5)


def test_the_mz07f_stands_where_a_pendant_showed_it() -> None:
    shown = np.array(PENDANT_OF_THE_MZ07F)
    positions, _ = load_robot("mz07f").forward(np.radians(shown[:, :6]))
    assert np.linalg.norm(positions * 1e3 - shown[:, 6:], axis=1).max() < 0.07


def test_the_range_of_a_pendant_s_joint_3_is_that_of_the_joint_with_what_joint_2_adds() -> None:
    second, third = (np.degrees(load_robot("m20id_25").joints[k].range) for k in (1, 2))
    assert -third[1] + second[0] == pytest.approx(-190.0)  # FANUC's operator's manual


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
    path = tmp_path / "arm.yaml"
    path.write_text(re.sub("(?m)^reach: .*$", f"reach: {entry}", robot_text(load_robot("irb120"))), "utf-8")
    with refusing(said):
        read_robot(path)


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
    fast = replace(calibrated, joints=(replace(calibrated.joints[0], max_speed=4.0),))
    assert is_intact(replace(fast, reach=None))


def test_poses_from_outside_are_written_from_a_urdf(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio")
    robot = load_robot("irb120")
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text(robot)[0])
    given = Namespace(urdf=path, robot="irb120", repository="one/two", path="arm.urdf", revision="abc")
    given.base, given.tip, given.joints = "base_link", "tool0", None
    text = outside_poses.text(given, "reason: by hand\nposes: none\n")
    content = YAML(typ="safe").load(text)
    assert (content["robot"], content["reason"], content["tip"]) == ("irb120", "by hand", "tool0")
    positions, _ = robot.forward(np.radians([pose["joints"] for pose in content["poses"]]))
    assert_allclose(positions * 1e3, [pose["position"] for pose in content["poses"]], atol=1e-5)
    assert_allclose(np.radians(content["limits"]), [joint.range for joint in robot.joints], atol=1e-4)
    assert outside_poses.same_poses(text, text)
    other = text.replace(f"position: [{content['poses'][0]['position'][0]}", "position: [400.001")
    assert not outside_poses.same_poses(text, other)


def test_known_positions() -> None:
    for robot_id, degrees, millimetres in (
        # ABB product specifications, robot in its zero pose.
        ("irb120", [0, 0, 0, 0, 0, 0], [302 + 72, 0, 290 + 270 + 70]),
        ("irb1600", [0, 0, 0, 0, 0, 0], [150 + 600 + 65, 0, 486.5 + 700]),
        # Reach of the IRB 1600-6/1.45: wrist centre 1450 mm from axis 1, arm stretched out level.
        ("irb1600", [0, 90, -90, 0, 0, 0], [1450 + 65, 0, 486.5]),
        # Franka: stretched upright, 333 + 316 + 384 high, the flange 88 out and 107 below the wrist.
        ("fr3", [0, 0, 0, 0, 0, 0, 0], [88, 0, 333 + 316 + 384 - 107]),
        # FANUC dimension drawing: 330 + 300 + 75 high, 75 + 320 + 80 out.
        ("lrmate200ic", [0, 0, 0, 0, 0, 0], [475, 0, 705]),
        # KR5 paper, section 3, and KUKA's drawing for the arm stretched out.
        ("kr5", [0, -90, 90, 0, 0, 0], [915, 0, 1120]),
        ("kr5", [0, 0, 0, 0, 0, 0], [180 + 600 + 620 + 115, 0, 400 + 120]),
        # KUKA turns axis 1 clockwise, seen from above.
        ("kr5", [90, -90, 90, 0, 0, 0], [0, -915, 1120]),
        # Published for the UR5 by its controller at (0, 0, 0, 0, 0, 0).
        ("ur5", [0, 0, 0, 0, 0, 0], [-817.25, -191.45, -5.491]),
        ("ur10", [0, 0, 0, 0, 0, 0], [-1184.3, -256.141, 11.6]),
        ("ur5e", [0, 0, 0, 0, 0, 0], [-425 - 392.2, -133.3 - 99.6, 162.5 - 99.7]),
        ("ur10e", [0, -90, 0, -90, 0, 0], [0, -174.15 - 116.55, 180.7 + 612.7 + 571.55 + 119.85]),
        ("ur10e", [0, 0, 0, 0, 0, 0], [-1184.25, -290.7, 60.85]),
        # UR robots point straight up here ("home"): d1 - a2 - a3 + d5.
        ("ur5", [0, -90, 0, -90, 0, 0], [0, -191.45, 89.159 + 425 + 392.25 + 94.65]),
        # Joint 4 at -90 deg puts links 2 to 4 in one line; the tool link stands square on it, in the second pose up.
        ("katana450", [0, 0, 0, -90, 0], [190 + 139 + 147.3, -200, 0]),
        ("katana450", [0, 90, 0, -90, 90], [200, 0, 190 + 139 + 147.3]),
        ("li3", [0, 0, 0], [450, -50, 200]),
    ):
        position = load_robot(robot_id).world_poses(np.radians([degrees]))[0][0]
        assert_allclose(position * 1e3, millimetres, rtol=0, atol=1e-9, err_msg=f"{robot_id} at {degrees}")


def test_puma_agrees_with_corke() -> None:
    # P. Corke, Robotics, Vision and Control, section 7.2: forward kinematics of qz and qn, to four digits.
    for degrees, printed in (
        ([0, 0, 0, 0, 0, 0], [[1, 0, 0, 0.4521], [0, 1, 0, -0.1500], [0, 0, 1, 0.4318]]),
        ([0, 45, 180, 0, 45, 0], [[0, 0, 1, 0.5963], [0, 1, 0, -0.1501], [-1, 0, 0, -0.0144]]),
    ):
        place, rotation = load_robot("puma560").world_poses(np.radians([degrees]))
        assert_allclose(place[0], np.array(printed)[:, 3], rtol=0, atol=6e-5)
        assert_allclose(rotation[0], np.array(printed)[:, :3], rtol=0, atol=1e-12)
