from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commanding import Truearm

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
