from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions.convention import parallel_joints_without_beta
from truearm.engine.robot.library import library, load_robot, urdf_source
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.urdf_writing import urdf_text


def position(robot: Robot, degrees: list[float]) -> Array:
    """Flange position [mm]."""
    positions, _ = robot.world_poses(np.radians([degrees]))
    return np.array(positions[0] * 1e3)


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("irb120", None),
        ("my.yaml", None),
        ("my#1.yaml", None),
        ("arm.urdf", (Path("arm.urdf"), None)),
        ("arm.URDF", (Path("arm.URDF"), None)),
        ("arm.xml", (Path("arm.xml"), None)),
        ("arm.urdf.xacro#tip", (Path("arm.urdf.xacro"), "tip")),
        ("arm.urdf#", (Path("arm.urdf"), None)),
        ("cell#3/arm#2.urdf", (Path("cell#3/arm#2.urdf"), None)),
        ("cell#3/arm#2.urdf#tip", (Path("cell#3/arm#2.urdf"), "tip")),
        ("arm.urdf#tip#2", (Path("arm.urdf"), "tip#2")),
        ("arm.urdf#old.urdf#tip", (Path("arm.urdf#old.urdf"), "tip")),
        ("there.urdf#old.urdf", (Path("there.urdf#old.urdf"), None)),
        ("there.urdf#note.yaml", None),
    ],
)
def test_what_is_a_urdf(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, source: tuple[Path, str | None] | None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("there.urdf#old.urdf").touch()
    Path("there.urdf#note.yaml").touch()
    assert urdf_source(text) == source
    assert urdf_source(Path(text)) == source


def test_a_path_with_a_hash_is_a_path(tmp_path: Path) -> None:
    folder = tmp_path / "cell #3"
    folder.mkdir()
    path = folder / "arm #2.urdf"
    path.write_text(urdf_text(load_robot("li3"))[0])
    for text in (path, f"{path}#tool0"):
        assert len(load_robot(text).joints) == 3
    with pytest.raises(InputError, match=r"there is no link of this name; got 'tool'"):
        load_robot(f"{path}#tool")


@pytest.mark.parametrize("text", ["", " "])
def test_no_robot_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"robot: no robot is given; .* a robot file or a URDF"):
        load_robot(text)


@pytest.mark.parametrize("robot_id", library())
def test_robot_round_trips(robot_id: str, tmp_path: Path) -> None:
    robot = load_robot(robot_id)
    path = tmp_path / "robot.yaml"
    path.write_text(robot_text(robot), encoding="utf-8")
    again = read_robot(path)
    assert robot_text(again) == path.read_text(encoding="utf-8")
    assert again == robot
    q = robot.random_configurations(5, np.random.default_rng(0))
    for actual, expected in zip(again.world_poses(q), robot.world_poses(q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=0)


@pytest.mark.parametrize("robot_id", library())
def test_robot_says_what_it_is(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.name == robot_id
    assert len(robot.source) > 20
    assert robot.title != robot.name
    assert all(joint.limits is not None for joint in robot.joints)
    assert all(truth.source for truth in robot.truths.values())


@pytest.mark.parametrize("robot_id", library())
def test_parallel_joints_have_beta(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert parallel_joints_without_beta(robot.convention, [joint.row for joint in robot.joints]) == []


@pytest.mark.parametrize("robot_id", library())
def test_truth_is_near_the_nominal_robot(robot_id: str) -> None:
    # Nothing published is off by more than 5 mm or 0.5 deg; the IRB 120's d_1 stands in base_z.
    robot = load_robot(robot_id)
    for truth in robot.truths.values():
        for name, value in truth.values.items():
            nominal = robot.parameters[name]
            if nominal.group == "base" or name == "d_1":
                continue
            assert abs(value - nominal.value) < {"m": 5e-3, "rad": np.radians(0.5)}[nominal.unit], name


def test_invented_numbers_say_so() -> None:
    assert "invented" in load_robot("li3").source.lower()
    assert "invented" in load_robot("li3").title.lower()
    assert "invented" in load_robot("lrmate200ic").truths["invented"].source


@pytest.mark.parametrize(
    ("robot_id", "degrees", "millimetres"),
    [
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
    ],
)
def test_known_position(robot_id: str, degrees: list[float], millimetres: list[float]) -> None:
    assert_allclose(position(load_robot(robot_id), degrees), millimetres, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("degrees", "printed"),
    [
        ([0, 0, 0, 0, 0, 0], [[1, 0, 0, 0.4521], [0, 1, 0, -0.1500], [0, 0, 1, 0.4318]]),
        ([0, 45, 180, 0, 45, 0], [[0, 0, 1, 0.5963], [0, 1, 0, -0.1501], [-1, 0, 0, -0.0144]]),
    ],
)
def test_puma_agrees_with_corke(degrees: list[float], printed: list[list[float]]) -> None:
    # P. Corke, Robotics, Vision and Control, section 7.2: forward kinematics of qz and qn, to four digits.
    place, rotation = load_robot("puma560").world_poses(np.radians([degrees]))
    expected = np.array(printed)
    assert_allclose(place[0], expected[:, 3], rtol=0, atol=6e-5)
    assert_allclose(rotation[0], expected[:, :3], rtol=0, atol=1e-12)


def test_katana_reaches_as_far_as_its_links() -> None:
    # Joint 4 at -90 deg puts links 2 to 4 in one line; the tool link stands square on it. The second pose is
    # the first one standing up, with the tool turned to the front.
    robot = load_robot("katana450")
    assert_allclose(position(robot, [0, 0, 0, -90, 0]), [190 + 139 + 147.3, -200, 0], rtol=0, atol=1e-9)
    assert_allclose(position(robot, [0, 90, 0, -90, 90]), [200, 0, 190 + 139 + 147.3], rtol=0, atol=1e-9)


def test_katana_tool_link_is_row_6_of_its_table() -> None:
    # Rx(90) Tz(200) behind frame 5.
    flange = load_robot("katana450").flange
    assert_allclose(flange.rotation, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], rtol=0, atol=1e-15)
    assert_allclose(flange.translation, flange.rotation @ [0, 0, 0.2], rtol=0, atol=1e-15)


def test_li3_reaches_about_450_mm() -> None:
    assert_allclose(position(load_robot("li3"), [0, 0, 0]), [450, -50, 200], rtol=0, atol=1e-9)


# KR5 paper, Table 3: ebeta, egamma [deg], ex, ey, ez [mm].
KR5_ERRORS = (
    (-0.0331, 0.0218, -0.3702, -0.7174, -0.0005),
    (0.1813, 0.0068, -0.4168, 0.3069, 0.0014),
    (-0.0069, 0.0034, 0.9521, 0.5143, 0.0001),
    (-0.0295, 0.0031, 0.3414, -0.2313, 0.0002),
    (-0.0198, 0.0361, 0.4848, 0.3526, 0.0004),
    (-0.0129, 0.0772, -0.4767, -0.4767, 0.0007),
)
# Table 1: translation [mm], axis and angle [deg] of P_1 to P_7.
KR5_LINKS = (
    ((0, 0, 225), "x", 180),
    ((180, 120, -175), "x", 90),
    ((600, 0, -15), "z", -90),
    ((120, 413.5, 135), "x", 90),
    ((0, 0, -206.5), "x", -90),
    ((0, 108.8, 0), "x", 90),
    ((0, 0, -6.2), "y", 180),
)


def turn(axis: str, degrees: float) -> Array:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(4)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def shift(x: float, y: float, z: float) -> Array:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.mark.parametrize("with_errors", [False, True])
def test_kr5_is_the_product_of_the_paper(with_errors: bool) -> None:
    # Equation 3, A1 ... A7, and equation 7, A1 E1 ... A6 E6 A7, as matrices.
    nominal = load_robot("kr5")
    robot = nominal.with_values(nominal.truths["axis-tests"].values) if with_errors else nominal
    for degrees in np.degrees(nominal.random_configurations(20, np.random.default_rng(0))):
        expected = np.eye(4)
        for i, (translation, axis, angle) in enumerate(KR5_LINKS):
            if i > 0:
                expected = expected @ turn("z", degrees[i - 1])
            expected = expected @ shift(*translation) @ turn(axis, angle)
            if with_errors and i < len(KR5_ERRORS):
                ebeta, egamma, ex, ey, ez = KR5_ERRORS[i]
                expected = expected @ shift(ex, ey, ez) @ turn("x", egamma) @ turn("y", ebeta)
        place, rotation = robot.world_poses(np.radians([degrees]))
        assert_allclose(place[0] * 1e3, expected[:3, 3], rtol=0, atol=1e-9)
        assert_allclose(rotation[0], expected[:3, :3], rtol=0, atol=1e-12)
