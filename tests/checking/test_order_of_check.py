"""Which of robot and data comes first."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.commanding import Truearm

import truearm as package
from truearm.engine.base.errors import InputError


def test_the_old_order_is_refused_with_the_new_line(truearm: Truearm, small: Path) -> None:
    done = truearm("check", small / "data.csv", "irb120")
    assert done.code == 2
    assert f"Write 'truearm check irb120 {small / 'data.csv'}'." in done.err
    assert truearm("check", "irb120", small / "data.csv").code == 0


def test_a_robot_is_no_measurements(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"this is a robot.*Exchange robot and measurements"):
        package.calibrate("irb120", "irb120")
    robot = tmp_path / "arm.yaml"
    robot.write_text("# an arm\ntruearm: truearm-robot/1\n")
    with pytest.raises(InputError, match="this is a robot"):
        package.check(robot)
