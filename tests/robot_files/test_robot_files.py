"""Robots written in other conventions and formats, and files to begin with, from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm import InputError
from truearm.engine.robot.robot_file.writing import robot_text


def test_a_converted_robot_has_the_same_poses(tmp_path: Path) -> None:
    robot = truearm.load_robot("irb120")
    made = truearm.convert(robot, "mcpc")
    assert made.file is None
    assert made.robot.convention_name == "mcpc"
    assert repr(made).startswith("irb120, converted from modified-hayati to mcpc")
    joints = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]])
    np.testing.assert_allclose(
        made.robot.forward_kinematics(joints).position, robot.forward_kinematics(joints).position
    )
    file = tmp_path / "new" / "mcpc.yaml"
    assert repr(truearm.convert(robot, "mcpc", out=file)).startswith(f"{file}: irb120, converted")
    assert file.read_text() == robot_text(made.robot)


def test_an_exported_robot_holds_its_text(tmp_path: Path) -> None:
    made = truearm.export("irb120", "urdf")
    assert made.text.startswith("<?xml")
    assert made.summary()["file"] is None
    assert repr(made).startswith("irb120 as urdf. Poses are those of the flange")
    assert made.left_out
    assert all(sentence in repr(made) for sentence in made.left_out)
    file = tmp_path / "irb120.urdf"
    assert truearm.export("irb120", "urdf", out=file).file == file
    assert file.read_text() == made.text


def test_axes_that_a_table_cannot_hold_are_refused() -> None:
    robot = truearm.load_robot("irb120").with_values({"alpha_3": 1e-3, "beta_3": 1e-3})
    with pytest.raises(InputError, match=r"nearly parallel.*take the convention hayati") as refusal:
        truearm.export(robot, "dh")
    assert refusal.value.parameter == "robot"


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine")
    with pytest.raises(InputError, match="exists already and is not overwritten") as refusal:
        truearm.convert("irb120", "mcpc", out=file)
    assert refusal.value.parameter == "out"
    with pytest.raises(InputError, match="exists already and is not overwritten") as refusal:
        truearm.export("irb120", "json", out=file)
    assert refusal.value.parameter == "out"
    with pytest.raises(InputError, match="exists already and is not overwritten") as refusal:
        truearm.new_robot(file)
    assert refusal.value.parameter == "file"
    (tmp_path / "check.csv").write_text("mine")
    with pytest.raises(InputError, match="exists already and is not overwritten") as refusal:
        truearm.example(tmp_path)
    assert refusal.value.parameter == "folder"
    (tmp_path / "measurements.csv").write_text("mine")
    with pytest.raises(InputError, match=r"another file of that name.*Choose another `out`") as refusal:
        truearm.demo(tmp_path)
    assert refusal.value.parameter == "out"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["check.csv", "measurements.csv", "mine.yaml"]
    assert {path.read_text() for path in tmp_path.iterdir()} == {"mine"}


def test_a_session_can_be_followed(tmp_path: Path) -> None:
    session = truearm.example(tmp_path / "session")
    assert [path.name for path in session.files] == ["my_robot.yaml", "measurements.csv", "check.csv", "session.sh"]
    assert repr(session).splitlines()[1:] == [str(path) for path in session.files]
    robot, data, check, _ = session.files
    calibration = truearm.calibrate(robot, data)
    assert calibration.validation is not None
    again = truearm.validate(calibration.robot, check)
    assert again.position is not None
    assert again.position.mean < 0.2e-3


def test_a_template_is_a_robot(tmp_path: Path) -> None:
    made = truearm.new_robot(tmp_path / "mine.yaml")
    assert repr(made) == f"{made.file}: fill it in, then look at it with 'truearm show {made.file}'."
    assert len(truearm.load_robot(made.file).joints) == 6
