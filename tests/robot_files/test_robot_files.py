"""Robots written in other conventions and formats, and files to begin with, from Python."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.ur_controller import UR10_CONF

import truearm
from truearm import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.robot_files.formats import FORMATS


def test_a_converted_robot_has_the_same_poses(tmp_path: Path) -> None:
    robot = truearm.load_robot("irb120")
    conversion = truearm.convert(robot, "mcpc")
    assert conversion.file is None
    assert conversion.robot.convention_name == "mcpc"
    assert repr(conversion).startswith("irb120, converted from modified-hayati to mcpc")
    joints = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]])
    np.testing.assert_allclose(
        conversion.robot.forward_kinematics(joints).position, robot.forward_kinematics(joints).position
    )
    file = tmp_path / "new" / "mcpc.yaml"
    assert repr(truearm.convert(robot, "mcpc", out=file)).startswith(f"{file}: irb120, converted")
    assert file.read_text() == robot_text(conversion.robot)


def test_an_exported_robot_holds_its_text(tmp_path: Path) -> None:
    export = truearm.export("irb120", "urdf")
    assert export.text.startswith("<?xml")
    assert export.summary()["file"] is None
    assert repr(export).startswith("irb120 as urdf. Poses are those of the flange")
    assert export.left_out
    assert all(sentence in repr(export) for sentence in export.left_out)
    file = tmp_path / "irb120.urdf"
    assert truearm.export("irb120", "urdf", out=file).file == file
    assert file.read_text() == export.text


def test_axes_that_a_table_cannot_hold_are_refused() -> None:
    robot = truearm.load_robot("irb120").with_values({"alpha_3": 1e-3, "beta_3": 1e-3})
    with pytest.raises(InputError, match=r"nearly parallel.*take the convention hayati") as refusal:
        truearm.export(robot, "dh")
    assert refusal.value.parameter == "robot"


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    for name in ("mine.yaml", "check.csv", "measurements.csv"):
        (tmp_path / name).write_text("mine")
    jobs: list[tuple[Callable[[], object], str, str]] = [
        (lambda: truearm.convert("irb120", "mcpc", out=file), "out", "exists already and is not overwritten"),
        (lambda: truearm.export("irb120", "json", out=file), "out", "exists already and is not overwritten"),
        (lambda: truearm.new_robot(file), "file", "exists already and is not overwritten"),
        (lambda: truearm.example(tmp_path), "folder", "exists already and is not overwritten"),
        (lambda: truearm.demo(tmp_path), "out", r"another file of that name.*Choose another `out`"),
    ]
    for job, parameter, words in jobs:
        with pytest.raises(InputError, match=words) as refusal:
            job()
        assert refusal.value.parameter == parameter
    assert sorted(path.name for path in tmp_path.iterdir()) == ["check.csv", "measurements.csv", "mine.yaml"]
    assert {path.read_text() for path in tmp_path.iterdir()} == {"mine"}


def test_a_session_can_be_followed(tmp_path: Path) -> None:
    session = truearm.example(tmp_path / "session")
    assert [path.name for path in session.files] == ["my_robot.yaml", "measurements.csv", "check.csv", "session.sh"]
    assert repr(session).splitlines()[1:] == [str(path) for path in session.files]
    robot, data, check, _ = session.files
    calibration = truearm.calibrate(robot, data, model="geometric")
    assert calibration.validation is not None
    again = truearm.validate(calibration.robot, check)
    assert again.position is not None
    assert again.position.mean < 0.2e-3


def test_a_template_is_a_robot(tmp_path: Path) -> None:
    template = truearm.new_robot(tmp_path / "mine.yaml")
    assert repr(template) == f"{template.file}: fill it in, then look at it with 'truearm show {template.file}'."
    assert len(truearm.load_robot(template.file).joints) == 6


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from truearm.engine.robot.robot_file.writing import robot_text

    robot = load_robot("irb120").with_effects(["gain", "approach"])
    away = {n: p.value + 1e-3 for n, p in robot.parameters.items() if p.group in ("geometry", "gain", "approach")}
    path = tmp_path_factory.mktemp("robot") / "calibrated.yaml"
    path.write_text(robot_text(robot.with_values({**away, "base_x": 1.5})))
    return path


#: Formats that hold any arm.
GENERAL = [format_ for format_ in FORMATS if format_ != "ur-kinematics"]


@pytest.mark.parametrize(("robot", "format_"), [*product(["irb120", "li3"], GENERAL), ("ur5e", "ur-kinematics")])
def test_nominal_robots_go_into_every_format(truearm: Truearm, robot: str, format_: str, tmp_path: Path) -> None:
    out = tmp_path / "new" / f"{robot}.{format_}"
    run = truearm("export", robot, "--format", format_, "--out", out)
    assert run.code == 0, run.err
    assert run.out.startswith(f"{out}: {robot} as {format_}. Poses are those of the flange in the base frame")
    assert out.stat().st_size > 300


def test_json_prints_one_object(truearm: Truearm, calibrated: Path, tmp_path: Path) -> None:
    out = tmp_path / "irb120.py"
    run = truearm("export", calibrated, "--format", "python", "--out", out, "--json")
    assert run.code == 0
    assert run.err == ""
    printed = json.loads(run.out)
    assert list(printed) == ["file", "format", "frames", "warnings"]
    assert (printed["file"], printed["format"]) == (str(out), "python")
    assert [warning["code"] for warning in printed["warnings"]] == ["left-out", "left-out"]
    assert "joint effect approach" in printed["warnings"][0]["message"]
    assert "gain" not in " ".join(warning["message"] for warning in printed["warnings"])


ROBOT = """\
truearm: truearm-robot/1
name: sliding
units: {length: mm, angle: deg}
convention: urdf
joints:
  - {name: first, axis: [0, 0, 1]}
  - {name: second, axis: [0, 1, 0]}
  - {name: slide, type: prismatic, axis: [1, 0, 0], limits: [-100, 100]}
controller:
  joints:
    - {joint: second, sign: -1, zero: 90, coupling: {first: -0.5}, pulses_per_degree: 1234.56789}
    - {joint: slide, zero: -12.3, pulses_per_mm: -17.3}
  flange: {quaternion: [0.7071067811865476, 0, 0.7071067811865476, 0]}
"""


def test_show_says_what_the_controller_does_its_own_way(truearm: Truearm, tmp_path: Path) -> None:
    shown = truearm("show", "lrmate200ic").out
    assert "Controller: ros-industrial/fanuc" in shown
    assert "  axis_3 = -(joint_3 + joint_2)\n  axis_4 = -joint_4\n" in shown
    assert "  base frame at x 0  y 0  z 330 mm of the model's, quaternion 1 0 0 0\n" in shown
    assert "  joints and frames are the model's\n" in truearm("show", "irb120").out
    assert "Controller" not in truearm("show", "puma560").out
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT)
    shown = truearm("show", path).out
    assert "Controller: as its file says\n" in shown
    assert "  axis_2 = -(joint_2 - 0.5 joint_1) + 90 deg, 1234.56789 pulses per degree\n" in shown
    assert "  axis_3 = joint_3 - 12.3 mm, -17.3 pulses per mm\n" in shown
    assert "  flange frame at x 0  y 0  z 0 mm of the model's, quaternion 0.707107 0 0.707107 0\n" in shown
    entry = json.loads(truearm("show", "lrmate200ic", "--json").out)["controller"]
    assert entry["joints"][0] == {"joint": "axis_3", "sign": -1, "coupling": {"axis_2": 1.0}}
    assert entry["base"]["translation"] == [0, 0, 330]


def test_show_says_where_a_robot_stands(truearm: Truearm) -> None:
    shown = truearm("show", "lrmate200ic", "--joint-positions", "0,0,0,0,0,0").out
    assert "\n  x 475.000  y 0.000  z 375.000 mm\n" in shown
    assert "\n  W P R  180.0000  -90.0000  0.0000 deg  (FANUC, as Rx Ry Rz Yaskawa)\n" in shown
    down = truearm("show", "lrmate200ic", "--joint-positions", "0,0,0,0,-90,0").out
    assert "\n  q1 q2 q3 q4  0.000000  1.000000  0.000000  0.000000  (ABB)\n" in down
    assert "\n  rx ry rz  3.1416  0.0000  0.0000 rad  (Universal Robots)\n" in down
    at = json.loads(truearm("show", "lrmate200ic", "--joint-positions", "0,10,0,0,0,0", "--json").out)["at"]
    assert at["joints"]["model"] == pytest.approx([0, 10, -10, 0, 0, 0])
    words = ("show", "lrmate200ic", "--joints-are", "model", "--joint-positions", "0,10,-10,0,0,0", "--json")
    assert json.loads(truearm(*words).out)["at"]["joints"]["controller"] == pytest.approx([0, 10, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        ("1,2", "--joint-positions: there are not as many numbers as joints; got '2 numbers'; allowed: 6, one for"),
        ("1,2,3,4,5,x", "--joint-positions: numbers separated by commas belong here"),
        ("1,2,3,4,5,nan", "--joint-positions: "),
    ],
)
def test_show_refuses_joints_that_are_none(truearm: Truearm, joints: str, words: str) -> None:
    run = truearm("show", "irb120", "--joint-positions", joints)
    assert run.code == 2
    assert words in run.err


def test_a_description_says_what_a_robot_is_and_carries() -> None:
    bare = truearm.show("irb120")
    assert bare.summary()["flange_at_zero_mm"] == [374.0, 0.0, 630.0]  # 302 + 72 ahead, 290 + 270 + 70 up
    for line in (
        "  axis_5 (revolute)  alpha_5 90  a_5 0  theta_offset_5 0  d_5 0  limits -120 to 120  up to 320 deg/s",
        "Flange at zero joint positions, from the base: x 374.000  y 0.000  z 630.000 mm",
        "Link masses: link 2 4.2 kg, link 4 5 kg",
        "Rated load: 3 kg",
    ):
        assert line in bare.lines()
    assert not any(line.startswith(("Payload:", "Free fall:")) for line in bare.lines())
    loaded = bare.robot.with_payload(Payload(1.5, (0.01, 0.02, 0.03)), (0.0, -9.81, 0.0))
    shown = truearm.show(loaded)
    assert "Payload: 1.5 kg at x 10  y 20  z 30 mm of the flange" in shown.lines()
    assert "Free fall: 0, -9.81, 0 m/s^2 in the base frame" in shown.lines()
    summary = shown.summary()
    assert summary["payload"] == {"mass_kg": 1.5, "cog_mm": [10.0, 20.0, 30.0]}
    assert (summary["masses_kg"], summary["rated_load_kg"]) == ({"link 2": 4.2, "link 4": 5.0}, 3.0)
    assert summary["joints"][2]["limits"] == pytest.approx([-110.0, 70.0])


def test_robots_are_found_by_maker_joints_and_words() -> None:
    def listed_robots(**filters: Any) -> list[dict[str, Any]]:
        listed: list[dict[str, Any]] = truearm.robots(**filters).summary()["robots"]
        return listed

    everything = listed_robots()
    for maker, whole in (("abb", "ABB"), ("ur", "Universal Robots"), ("Robots", "Universal Robots")):
        assert whole in {robot["maker"] for robot in listed_robots(maker=maker)}
        assert len(listed_robots(maker=maker)) < len(everything)
    assert {robot["maker"] for robot in listed_robots(maker="ur")} == {"Universal Robots"}
    assert None not in {robot["maker"] for robot in listed_robots(maker="abb")}
    assert {robot["joints"] for robot in listed_robots(axes=7)} == {7}
    assert [robot["id"] for robot in listed_robots(text="gofa crb")] == ["crb15000_5_0.95"]
    for filters, words in (
        ({"maker": "abbb"}, "no robot of this maker; got 'abbb'"),
        ({"axes": 2}, "none of these robots has so many joints"),
        ({"text": "irb12O"}, "none of these robots is called so.*Did you mean irb120"),
    ):
        with pytest.raises(InputError, match=words):
            listed_robots(**filters)


def test_kinematics_of_a_controller_are_read_and_those_of_another_type_refused(tmp_path: Path) -> None:
    file, out = tmp_path / "calibration.conf", tmp_path / "arm.yaml"
    file.write_text(UR10_CONF)
    arm = truearm.import_ur_kinematics(file, "ur10", out=out)
    words = f"ur10 with the kinematics of its controller, flange {1e3 * arm.distance:.2f} mm from the type's on average"
    assert arm.lines()[0] == f"{out}: {words}"
    assert arm.summary()["mean_distance_from_type_mm"] == pytest.approx(1e3 * arm.distance)
    again = truearm.import_ur_kinematics(file, "ur10")
    assert again.lines()[0] == words
    assert truearm.load_robot(out).values == pytest.approx(again.robot.values)
    (doubt,) = replace(again, fitting={"ur10e": 1e-9}).warnings
    assert f"{np.degrees(8.20642406610186392e-05):.2g} deg for ur10. Read the type" in doubt.message
    with pytest.raises(
        InputError, match=r"kinematics of another type of robot.*Of the library, .*ur10.* fit"
    ) as refusal:
        truearm.import_ur_kinematics(file, "ur5")
    assert refusal.value.parameter == "robot"
