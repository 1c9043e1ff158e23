from __future__ import annotations

import json
from pathlib import Path

from tests.cli.conftest import Truearm

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
    assert "  reading of second = -(second - 0.5 first) + 90 deg, 1234.56789 pulses per degree\n" in shown
    assert "reading of slide = slide - 12.3 mm, -17.3 pulses per mm\n" in shown
    assert "  flange frame at x 0  y 0  z 0 mm of the model's, quaternion 0.707107 0 0.707107 0\n" in shown
    entry = json.loads(truearm("show", "lrmate200ic", "--json").out)["controller"]
    assert entry["joints"][0] == {"joint": "axis_3", "sign": -1, "coupling": {"axis_2": 1.0}}
    assert entry["base"]["translation"] == [0, 0, 330]
