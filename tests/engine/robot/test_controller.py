from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import AS_THE_MODEL, Controller
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.urdf import read_urdf
from truearm.engine.robot.urdf_writing import urdf_text

FANUC = Controller(signs=(1, 1, -1, -1, -1, -1), couplings={3: {2: 1.0}})
HALF = 0.7071067811865476

SLIDING = """\
truearm: truearm-robot/1
name: sliding
units: {length: LENGTH, angle: ANGLE}
convention: urdf
joints:
  - {name: first, axis: [0, 0, 1]}
  - {name: second, axis: [0, 1, 0]}
  - {name: slide, type: prismatic, axis: [1, 0, 0], limits: [-0.1, 0.1]}
controller:
"""


def matrix(R: Array, p: Sequence[float] | Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = R, p
    return made


def controller_poses(robot: Robot, readings: Array) -> Array:
    """Flange in the base, both the controller's, ``(n, 4, 4)`` [m]."""
    its, world = robot.controller, robot.base
    base = matrix(world.rotation, world.translation) @ matrix(its.base.rotation, its.base.translation)
    flange = matrix(its.flange.rotation, its.flange.translation)
    places, rotations = robot.world_poses(its.to_model(readings))
    return np.array(
        [np.linalg.inv(base) @ matrix(R, p) @ flange for p, R in zip(places, rotations, strict=True)], float
    )


def read(tmp_path: Path, entry: str, length: str = "m", angle: str = "rad") -> Robot:
    path = tmp_path / "robot.yaml"
    path.write_text(SLIDING.replace("LENGTH", length).replace("ANGLE", angle) + entry)
    return read_robot(path)


# -- readings and pulses -----------------------------------------------------------------------------------


def test_joint_3_of_a_fanuc_robot_is_the_forearm_to_the_horizontal() -> None:
    joints = np.radians([[10.0, 20.0, 30.0, 40.0, 50.0, 60.0], [0.0, 20.0, -20.0, 0.0, 0.0, 0.0]])
    readings = np.degrees(FANUC.from_model(joints))
    assert_allclose(readings, [[10, 20, -50, -40, -50, -60], [0, 20, 0, 0, 0, 0]], rtol=0, atol=1e-13)


def test_readings_by_the_formula() -> None:
    controller = Controller(
        signs=(-1, 1, 1), zeros=(0.5, 0.0, -0.25), couplings={1: {3: 0.5, 2: -1.0}, 3: {1: 0.25}}, pulses=()
    )
    a, b, c = 0.3, -0.7, 1.1
    expected = [0.5 - (a + 0.5 * c - b), b, -0.25 + c + 0.25 * a]
    assert_allclose(controller.from_model(np.array([[a, b, c]])), [expected], rtol=0, atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_joints_are_the_inverse_of_readings(seed: int) -> None:
    rng = np.random.default_rng(seed)
    others = {i: {j: rng.uniform(-0.3, 0.3) for j in range(1, 7) if j != i} for i in range(1, 7)}
    controller = Controller(tuple(rng.choice([-1, 1], 6).tolist()), tuple(rng.uniform(-4, 4, 6).tolist()), others)
    joints = rng.uniform(-3, 3, (20, 6))
    assert_allclose(controller.to_model(controller.from_model(joints)), joints, rtol=0, atol=1e-14)
    assert_allclose(controller.from_model(controller.to_model(joints)), joints, rtol=0, atol=1e-14)


def test_a_controller_as_the_model_changes_no_bit() -> None:
    joints = np.random.default_rng(0).uniform(-3, 3, (20, 6))
    assert_array_equal(AS_THE_MODEL.from_model(joints), joints)
    assert_array_equal(AS_THE_MODEL.to_model(joints), joints)


def test_pulses_are_of_readings(tmp_path: Path) -> None:
    robot = read(
        tmp_path,
        "  joints:\n"
        "    - {joint: first, sign: -1, pulses_per_degree: 1000.5}\n"
        "    - {joint: second, pulses_per_degree: -250}\n"
        "    - {joint: slide, zero: 0.002, pulses_per_mm: 40}\n",
    )
    readings = robot.controller.from_model(np.array([[np.radians(-2.0), np.radians(3.0), 0.005]]))
    pulses = robot.controller.to_pulses(readings)
    assert_allclose(pulses, [[2001.0, -750.0, 280.0]], rtol=1e-14, atol=0)
    assert_allclose(robot.controller.from_pulses(pulses), readings, rtol=1e-14, atol=0)


@pytest.mark.parametrize(
    ("pulses", "missing"), [((), "joint 1, 2, 3"), ((1.0, None, 2.0), "joint 2"), ((None, 1.0, None), "joint 1, 3")]
)
def test_unknown_pulses_are_refused(pulses: tuple[float | None, ...], missing: str) -> None:
    controller = Controller(pulses=pulses)
    for convert in (controller.to_pulses, controller.from_pulses):
        with pytest.raises(InputError, match=f"^{missing}: the number of motor pulses.*Give pulses_per_degree"):
            convert(np.zeros((2, 3)))


# -- the entry of robot files ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "parts"),
    [
        ("{joint: frist}", ["joints[1]", "no joint of this name", "got 'frist'", "Did you mean first"]),
        ("{joint: first, coupling: {secnd: 1}}", ["joints[1].coupling", "got 'secnd'", "Did you mean second"]),
        ("{joint: first, sign: 0}", ["controller.joints[1].sign", "got 0", "allowed: 1, -1"]),
        ("{joint: first, sign: -2}", ["got -2", "allowed: 1, -1"]),
        ("{joint: first, sign: true}", ["joints[1].sign", "a whole number belongs here"]),
        ("{joint: first, sign: -1.0}", ["joints[1].sign", "a whole number belongs here"]),
        ("{joint: first, zero: .nan}", ["joints[1].zero", "finite"]),
        ("{joint: first, zero: 1e9}", ["zero of first", "too large to be plausible"]),
        ("{joint: first, coupling: {first: 1}}", ["cannot be coupled with itself", "got 'first'"]),
        ("{joint: first, coupling: {slide: 1}}", ["both turn, or both slide", "revolute first, prismatic slide"]),
        (
            "{joint: first, pulses_per_degree: 0}",
            ["joints[1].pulses_per_degree", "the number of pulses is out of range", "got 0", "allowed: 0.000001"],
        ),
        ("{joint: first, pulses_per_degree: .inf}", ["joints[1].pulses_per_degree", "finite"]),
        ("{joint: first, pulses_per_mm: 5}", ["is revolute", "got 'pulses_per_mm'", "allowed: pulses_per_degree"]),
        ("{joint: slide, pulses_per_degree: 5}", ["is prismatic", "allowed: pulses_per_mm"]),
        ("{joint: first, sgn: -1}", ["joints[1].sgn", "not known here"]),
        ("{sign: -1}", ["joints[1].joint", "missing"]),
        ("{joint: first}, {joint: first, sign: -1}", ["joints[2]", "appears twice", "got 'first'"]),
        (
            "{joint: first, coupling: {second: 1}}, {joint: second, coupling: {first: 1}}",
            ["controller.joints", "cannot be inverted", "first counts second; second counts first"],
        ),
    ],
)
def test_refused(entry: str, parts: list[str], tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, f"  joints: [{entry}]\n")
    for part in ["robot.yaml", *parts]:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "parts"),
    [
        ("base: {quaternion: [1, 0, 0, 0.1]}", ["controller.base.quaternion", "must have length 1"]),
        ("flange: {translation: [0, 0, 1e9]}", ["controller.flange.translation", "too large to be plausible"]),
        ("flange: {rotation: [0, 0, 0]}", ["controller.flange.rotation", "not known here"]),
        ("tool: {translation: [0, 0, 0]}", ["controller.tool", "not known here"]),
    ],
)
def test_refused_frames(entry: str, parts: list[str], tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, f"  {entry}\n")
    for part in ["robot.yaml", *parts]:
        assert part in str(caught.value)


FULL = f"""\
  source: "a manual: page 7"
  joints:
    - {{joint: second, sign: -1, zero: 0.1, coupling: {{first: -0.333333333}}, pulses_per_degree: 1234.56789}}
    - {{joint: slide, zero: 0.0123, pulses_per_mm: -17.3}}
  base: {{translation: [0.1, -0.2, 0.33]}}
  flange: {{quaternion: [{HALF}, 0, {HALF}, 0]}}
"""


@pytest.mark.parametrize(("length", "metre", "angle", "radian"), [("m", 1, "rad", 1), ("in", 0.0254, "deg", 0.0174533)])
def test_entry_is_read_in_the_units_of_the_file(
    length: str, metre: float, angle: str, radian: float, tmp_path: Path
) -> None:
    its = read(tmp_path, FULL, length, angle).controller
    assert its.source == "a manual: page 7"
    assert its.signs == (1, -1, 1)
    assert_allclose(its.zeros, [0, 0.1 * radian, 0.0123 * metre], rtol=1e-5, atol=0)
    assert its.couplings == {2: {1: -0.333333333}}
    assert its.pulses[0] is None
    assert its.pulses[1] == pytest.approx(1234.56789 * 180 / np.pi)
    assert its.pulses[2] == pytest.approx(-17.3e3)
    assert_allclose(its.base.translation, np.array([0.1, -0.2, 0.33]) * metre, rtol=1e-15, atol=0)
    assert its.flange.quaternion == (HALF, 0, HALF, 0)


@pytest.mark.parametrize(("length", "angle"), [("m", "rad"), ("mm", "deg"), ("um", "deg"), ("in", "rad")])
def test_round_trip(length: str, angle: str, tmp_path: Path) -> None:
    robot = read(tmp_path, FULL, length, angle)
    text = robot_text(robot)
    (tmp_path / "again.yaml").write_text(text)
    again = read_robot(tmp_path / "again.yaml")
    assert robot_text(again) == text
    one, other = robot.controller, again.controller
    assert (one.source, one.signs, one.couplings) == (other.source, other.signs, other.couplings)
    assert_allclose(one.zeros, other.zeros, rtol=1e-15, atol=0)
    assert one.pulses[0] is other.pulses[0] is None
    assert_allclose(np.array(one.pulses[1:], float), np.array(other.pulses[1:], float), rtol=1e-15, atol=0)
    assert_allclose(one.base.translation, other.base.translation, rtol=1e-15, atol=0)
    assert (one.base.quaternion, one.flange) == (other.base.quaternion, other.flange)


def test_the_examples_of_template_and_guide_are_entries(tmp_path: Path) -> None:
    template = (files("truearm.starting.examples") / "new_robot.yaml").read_text("utf-8")
    before, entry, after = template.partition("# controller:\n")
    commented = re.match(r"(?:#   .*\n)+", after)
    assert commented is not None
    guide = Path(__file__).parents[3] / "docs" / "guide" / "robots.md"
    shown = guide.read_text("utf-8").partition("```yaml\n")[2].partition("```")[0]
    path = tmp_path / "robot.yaml"
    for text in (f"{before}{entry[2:]}{re.sub('(?m)^# ', '', commented[0])}", f"{template}\n{shown}"):
        path.write_text(text)
        its = read_robot(path).controller
        assert its.signs[2] == -1
        assert its.couplings == {3: {2: 1.0}}
        assert_allclose(its.zeros, [0, 0, 0, np.pi / 2, 0, 0], rtol=1e-15, atol=0)
        assert its.pulses[3] == pytest.approx(np.degrees(1234.5))


@pytest.mark.parametrize("entry", ["  {}\n", "  joints: [{joint: first, sign: 1, zero: 0, coupling: {second: 0}}]\n"])
def test_what_is_as_the_model_is_not_written(entry: str, tmp_path: Path) -> None:
    robot = read(tmp_path, entry)
    assert robot.controller == AS_THE_MODEL
    assert "controller" not in robot_text(robot)


def test_a_urdf_says_nothing_about_the_controller(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text(load_robot("lrmate200ic"))[0])
    assert read_urdf(path).controller == AS_THE_MODEL


# -- the controller through conversions --------------------------------------------------------------------


@pytest.mark.parametrize("name", CONVERSIONS)
@pytest.mark.parametrize("robot_id", ["irb120", "katana450", "kr5", "lrmate200ic"])
def test_conversion_leaves_the_controllers_poses(robot_id: str, name: str) -> None:
    rng = np.random.default_rng(3)
    robot = load_robot(robot_id)
    count = len(robot.joints)
    turned = Transform((0.1, -0.2, 0.3), (0.5, 0.5, -0.5, 0.5))
    controller = Controller(
        signs=(-1,) * count, zeros=(0.2,) * count, couplings={2: {1: 0.5}}, base=turned, flange=turned
    )
    robot = replace(robot, controller=controller).with_frames(Transform((1.0, 2.0, 0.5), (0.8, 0.0, 0.6, 0.0)), {})
    made = converted(robot, name)
    readings = rng.uniform(-1, 1, (5, count))
    assert_allclose(controller_poses(made, readings), controller_poses(robot, readings), rtol=0, atol=1e-12)
    assert replace(made.controller, base=turned) == controller


def test_a_conversion_that_moves_the_base_says_where_the_controllers_was() -> None:
    made = converted(load_robot("kr5"), "standard-dh")
    assert made.controller.base != Transform()
    poses = controller_poses(made, np.zeros((1, 6)))
    assert_allclose(poses[0, :3, 3], [1.515, 0.0, 0.520], rtol=0, atol=1e-12)


# -- the library -------------------------------------------------------------------------------------------

# Origin [mm], its roll, pitch and yaw [deg], and axis of each joint; then frame base in the base link, and frame tool0
# in the last link: those frames are the controller's.
Joints = Sequence[tuple[tuple[float, float, float], tuple[float, float, float], tuple[int, int, int]]]
Still = tuple[tuple[float, float, float], tuple[float, float, float]]
X, Y, Z, NO_X, NO_Y = (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0)
HERE, NONE = (0, 0, 0), (0, 0, 0)


def universal(d1: float, shoulder: float, a2: float, elbow: float, a3: float, d4: float, d5: float) -> Joints:
    # ros-industrial/universal_robot, ur5.urdf.xacro and ur10.urdf.xacro; shoulder and elbow offsets cancel in d4.
    return (
        ((0, 0, d1), NONE, Z),
        ((0, shoulder, 0), (0, 90, 0), Y),
        ((0, elbow, a2), NONE, Y),
        ((0, 0, a3), (0, 90, 0), Y),
        ((0, d4 - elbow - shoulder, 0), NONE, Z),
        ((0, 0, d5), NONE, Y),
    )


def described(d1: float, a2: float, a3: float, d4: float, d5: float, d6: float) -> tuple[Joints, Still, Still]:
    """Return the joints of UniversalRobots/Universal_Robots_ROS2_Description, ur_macro.xacro, default_kinematics."""
    joints: Joints = (
        ((0, 0, d1), (0, 0, 180), Z),
        (HERE, (90, 0, 0), Z),
        ((a2, 0, 0), NONE, Z),
        ((a3, 0, d4), NONE, Z),
        ((0, -d5, 0), (90, 0, 0), Z),
        ((0, d6, 0), (90, 180, 180), Z),
    )
    return joints, (HERE, (0, 0, 180)), (HERE, NONE)


MODELS: dict[str, tuple[Joints, Still, Still]] = {
    "ur3": described(151.9, -243.65, -213.25, 112.35, 85.35, 81.9),
    "ur3e": described(151.85, -243.55, -213.2, 131.05, 85.35, 92.1),
    "ur5e": described(162.5, -425, -392.2, 133.3, 99.7, 99.6),
    "ur10e": described(180.7, -612.7, -571.55, 174.15, 119.85, 116.55),
    # ros-industrial/abb, irb120_3_58_macro.xacro
    "irb120": (
        (
            (HERE, NONE, Z),
            ((0, 0, 290), NONE, Y),
            ((0, 0, 270), NONE, Y),
            ((0, 0, 70), NONE, X),
            ((302, 0, 0), NONE, Y),
            ((72, 0, 0), NONE, X),
        ),
        (HERE, NONE),
        (HERE, (0, 90, 0)),
    ),
    # ros-industrial/abb, irb1600_8_145_macro.xacro
    "irb1600": (
        (
            (HERE, NONE, Z),
            ((150, 0, 486.5), NONE, Y),
            ((0, 0, 700), NONE, Y),
            ((300, 0, 0), NONE, X),
            ((300, 0, 0), NONE, Y),
            ((65, 0, 0), NONE, X),
        ),
        (HERE, NONE),
        (HERE, (0, 90, 0)),
    ),
    # ros-industrial/fanuc, lrmate200ic_macro.xacro; its joint 3 is J3 + J2 (fanuc_driver, fanuc_utils.cpp).
    "lrmate200ic": (
        (
            ((0, 0, 330), NONE, Z),
            ((75, 0, 0), NONE, Y),
            ((0, 0, 300), NONE, NO_Y),
            ((0, 0, 75), NONE, NO_X),
            ((320, 0, 0), NONE, NO_Y),
            ((80, 0, 0), NONE, NO_X),
        ),
        ((0, 0, 330), NONE),
        (HERE, (180, -90, 0)),
    ),
    # ros-industrial/kuka_experimental, kr5_arc_macro.xacro, flange and tool0 in one
    "kr5": (
        (
            ((0, 0, 400), (180, 0, 0), Z),
            ((180, 0, 0), (90, 0, 0), Z),
            ((600, 0, 0), NONE, Z),
            ((0, -120, 0), (0, -90, 0), Z),
            ((0, 0, -620), (0, 90, 0), Z),
            (HERE, (0, -90, 0), Z),
        ),
        (HERE, NONE),
        ((0, 0, -115), (0, 180, -90)),
    ),
    "ur5": (
        universal(89.159, 135.85, 425, -119.7, 392.25, 109.15, 94.65),
        (HERE, (0, 0, -180)),
        ((0, 82.3, 0), (-90, 0, 0)),
    ),
    "ur10": (
        universal(127.3, 220.941, 612, -171.9, 572.3, 163.941, 115.7),
        (HERE, (0, 0, -180)),
        ((0, 92.2, 0), (-90, 0, 0)),
    ),
}


def turn(axis: Sequence[float], degrees: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    angle = np.radians(degrees)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def still(place: Still) -> Array:
    origin, (roll, pitch, yaw) = place
    return matrix(turn(Z, yaw) @ turn(Y, pitch) @ turn(X, roll), origin)


@pytest.mark.parametrize("robot_id", MODELS)
def test_poses_are_those_of_other_models_of_the_controller(robot_id: str) -> None:
    robot = load_robot(robot_id)
    joints, base, tool0 = MODELS[robot_id]
    degrees = np.random.default_rng(1).uniform(-170, 170, (20, 6))
    actual = controller_poses(robot, np.radians(degrees))
    for readings, pose in zip(degrees, actual, strict=True):
        turned = readings.copy()
        if robot_id == "lrmate200ic":
            turned[2] += turned[1]
        expected = np.linalg.inv(still(base))
        for (origin, angles, axis), angle in zip(joints, turned, strict=True):
            expected = expected @ still((origin, angles)) @ matrix(turn(axis, angle), HERE)
        expected = expected @ still(tool0)
        assert_allclose(pose[:3, 3] * 1e3, expected[:3, 3], rtol=0, atol=1e-9)
        assert_allclose(pose[:3, :3], expected[:3, :3], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("robot_id", "degrees", "millimetres", "columns"),
    [
        # ABB: q 0.7071 0 0.7071 0 at zero readings, the flange's x down and its z forward.
        ("irb120", [0, 0, 0, 0, 0, 0], [374, 0, 630], [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
        ("irb1600", [0, 0, 0, 0, 0, 0], [815, 0, 1186.5], [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
        # KUKA: {A 0, B 90, C 0}.
        ("kr5", [0, -90, 90, 0, 0, 0], [915, 0, 1120], [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
        # FANUC: W 180, P -90, R 0, and the height is counted from axis 2.
        ("lrmate200ic", [0, 0, 0, 0, 0, 0], [475, 0, 375], [[0, 0, 1], [0, -1, 0], [1, 0, 0]]),
        # J3 alone at 90 deg: the forearm points up, 75 mm behind the elbow.
        ("lrmate200ic", [0, 0, 90, 0, 0, 0], [0, 0, 700], [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        # J2 alone leans the upper arm and leaves the forearm level.
        ("lrmate200ic", [0, 90, 0, 0, 0, 0], [775, 0, 75], [[0, 0, 1], [0, -1, 0], [1, 0, 0]]),
    ],
)
def test_reference_pose(
    robot_id: str, degrees: list[float], millimetres: list[float], columns: list[list[float]]
) -> None:
    pose = controller_poses(load_robot(robot_id), np.radians([degrees]))[0]
    assert_allclose(pose[:3, 3] * 1e3, millimetres, rtol=0, atol=1e-9)
    assert_allclose(pose[:3, :3].T, columns, rtol=0, atol=1e-12)


def test_every_controller_has_a_source() -> None:
    known = {name: its for name in library() if (its := load_robot(name).controller) != AS_THE_MODEL}
    assert set(MODELS) <= set(known)
    assert all(its.source for its in known.values())
