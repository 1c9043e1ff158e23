from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.expecting import refusing

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
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = R, p
    return result


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


def test_joints_are_the_inverse_of_readings() -> None:
    for seed in range(5):
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


def test_unknown_pulses_are_refused() -> None:
    for pulses, missing in (((), "joint 1, 2, 3"), ((1.0, None, 2.0), "joint 2"), ((None, 1.0, None), "joint 1, 3")):
        controller = Controller(pulses=pulses)
        for convert in (controller.to_pulses, controller.from_pulses):
            with refusing(f"{missing}: the number of motor pulses", of=pulses):
                convert(np.zeros((2, 3)))


# -- the entry of robot files ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "parts"),
    [
        ("{joint: frist}", ["joints[1]", "no joint of this name", "Did you mean first"]),
        ("{joint: first, coupling: {secnd: 1}}", ["joints[1].coupling", "Did you mean second"]),
        ("{joint: first, sign: 0}", ["controller.joints[1].sign", "allowed: 1, -1"]),
        ("{joint: first, sign: -2}", ["joints[1].sign", "allowed: 1, -1"]),
        ("{joint: first, sign: true}", ["joints[1].sign", "a whole number belongs here"]),
        ("{joint: first, sign: -1.0}", ["joints[1].sign", "a whole number belongs here"]),
        ("{joint: first, zero: .nan}", ["joints[1].zero", "finite"]),
        ("{joint: first, zero: 1e9}", ["zero of first", "too large to be plausible"]),
        ("{joint: first, coupling: {first: 1}}", ["cannot be coupled with itself"]),
        ("{joint: first, coupling: {slide: 1}}", ["both turn, or both slide", "revolute first, prismatic slide"]),
        ("{joint: first, pulses_per_degree: 0}", ["joints[1].pulses_per_degree", "out of range"]),
        ("{joint: first, pulses_per_degree: .inf}", ["joints[1].pulses_per_degree", "finite"]),
        ("{joint: first, pulses_per_mm: 5}", ["is revolute", "allowed: pulses_per_degree"]),
        ("{joint: slide, pulses_per_degree: 5}", ["is prismatic", "allowed: pulses_per_mm"]),
        ("{joint: first, sgn: -1}", ["joints[1].sgn", "not known here"]),
        ("{sign: -1}", ["joints[1].joint", "missing"]),
        ("{joint: first}, {joint: first, sign: -1}", ["joints[2]", "appears twice"]),
        (
            "{joint: first, coupling: {second: 1}}, {joint: second, coupling: {first: 1}}",
            ["controller.joints", "cannot be inverted", "first counts second; second counts first"],
        ),
        ("base: {quaternion: [1, 0, 0, 0.1]}", ["controller.base.quaternion", "must have length 1"]),
        ("flange: {translation: [0, 0, 1e9]}", ["controller.flange.translation", "too large"]),
        ("flange: {rotation: [0, 0, 0]}", ["controller.flange.rotation", "not known here"]),
        ("tool: {translation: [0, 0, 0]}", ["controller.tool", "not known here"]),
    ],
)
def test_refused(entry: str, parts: list[str], tmp_path: Path) -> None:
    with refusing("robot.yaml", *parts):
        read(tmp_path, f"  {entry}\n" if entry.startswith(("base", "flange", "tool")) else f"  joints: [{entry}]\n")


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


def test_round_trip(tmp_path: Path) -> None:
    for length, angle in (("m", "rad"), ("mm", "deg"), ("um", "deg"), ("in", "rad")):
        robot = read(tmp_path, FULL, length, angle)
        text = robot_text(robot)
        (tmp_path / "again.yaml").write_text(text)
        again = read_robot(tmp_path / "again.yaml")
        assert robot_text(again) == text
        first, other = robot.controller, again.controller
        assert (first.source, first.signs, first.couplings) == (other.source, other.signs, other.couplings)
        assert (first.base.quaternion, first.flange, first.pulses[0]) == (other.base.quaternion, other.flange, None)
        ours, theirs = ([*c.zeros, *c.base.translation, *(p or 0.0 for p in c.pulses)] for c in (first, other))
        assert_allclose(ours, theirs, rtol=1e-15, atol=0, err_msg=f"{length}, {angle}")


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


def test_conversion_leaves_the_controllers_poses() -> None:
    turned = Transform((0.1, -0.2, 0.3), (0.5, 0.5, -0.5, 0.5))
    for robot_id in ("irb120", "katana450", "kr5", "lrmate200ic"):
        robot = load_robot(robot_id)
        count = len(robot.joints)
        controller = Controller((-1,) * count, (0.2,) * count, couplings={2: {1: 0.5}}, base=turned, flange=turned)
        robot = replace(robot, controller=controller).with_frames(Transform((1.0, 2.0, 0.5), (0.8, 0.0, 0.6, 0.0)), {})
        readings = np.random.default_rng(3).uniform(-1, 1, (5, count))
        poses = controller_poses(robot, readings)
        for name in CONVERSIONS:
            converted_robot = converted(robot, name)
            assert_allclose(
                controller_poses(converted_robot, readings), poses, rtol=0, atol=1e-12, err_msg=f"{robot_id}, {name}"
            )
            assert replace(converted_robot.controller, base=turned) == controller


# -- the library -------------------------------------------------------------------------------------------


def test_reference_poses() -> None:
    for robot_id, degrees, millimetres, columns in (
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
    ):
        pose = controller_poses(load_robot(robot_id), np.radians([degrees]))[0]
        assert_allclose(pose[:3, 3] * 1e3, millimetres, rtol=0, atol=1e-9, err_msg=f"{robot_id}, {degrees}")
        assert_allclose(pose[:3, :3].T, columns, rtol=0, atol=1e-12, err_msg=f"{robot_id}, {degrees}")


def test_every_controller_has_a_source() -> None:
    known = {name: its for name in library() if (its := load_robot(name).controller) != AS_THE_MODEL}
    assert {"irb120", "irb1600", "kr5", "lrmate200ic", "ur3", "ur3e", "ur5", "ur5e", "ur10", "ur10e"} <= set(known)
    assert all(its.source for its in known.values())
