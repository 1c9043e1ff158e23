"""Tables of RoboDK's calibration, read and written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion

HEADINGS = "J1,J2,J3,J4,J5,J6,X,Y,Z,TX,TY,TZ\n"
POINTS = HEADINGS + (
    "10,-20,30,0,45,-90,1500.5,20.25,-3,100,0,100\n"
    "10,-20,30,0,45,-90,1501.5,21.25,-4,-100,0,100\n"
    "10,-20,30,0,45,-90,1501.6,21.35,-4.1,-100,0,100\n"
    "15,-20,30,0,45,-90,0,0,0,100,0,100\n"
)


def written(folder: Path, text: str) -> Path:
    file = folder / "table.csv"
    file.write_text(text)
    return file


def test_points_configurations_and_tool_points(tmp_path: Path) -> None:
    out = tmp_path / "data.csv"
    read = truearm.import_robodk(written(tmp_path, POINTS), out=out)
    data = read.data
    assert np.degrees(data.joints[0]) == pytest.approx([10, -20, 30, 0, 45, -90])
    assert data.configuration.tolist() == [0, 0, 1, 2]  # the second tool point was measured again: the robot came anew
    assert data.target.tolist() == [0, 1, 1, 0]
    assert 1e3 * read.tool_points == pytest.approx(np.array([[100, 0, 100], [-100, 0, 100]]))
    assert data.position[0] == pytest.approx([1.5005, 0.02025, -0.003])
    assert read.missing == 1
    assert np.isnan(data.position[3]).all()
    again = truearm.load_data(out)
    assert again.position[:3] == pytest.approx(data.position[:3])
    assert read.lines() == [
        f"3 configurations: {out}",
        "  target 1: tool point (100, 0, 100) mm",
        "  target 2: tool point (-100, 0, 100) mm",
        "  1 missing reading",
    ]
    assert read.summary()["tool_points_mm"]["2"] == pytest.approx([-100.0, 0.0, 100.0])


def test_poses_turn_about_moving_axes(tmp_path: Path) -> None:
    """Rx(90 deg) Ry(0) Rz(90 deg), worked by hand: x goes to z, y to -x, z to -y."""
    table = "h,,,,,,,,,,,,,,,,,\n0,0,0,0,0,0,500,0,800,90,0,90,0,0,50,0,0,0\n"
    read = truearm.import_robodk(written(tmp_path, table), angle_unit="deg")
    assert read.data.quaternion is not None
    R = rotation_from_quaternion(read.data.quaternion)[0]
    assert pytest.approx(np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]), abs=1e-12) == R
    in_radians = table.replace(",90,0,90,", f",{np.pi / 2},0,{np.pi / 2},")
    again = truearm.import_robodk(written(tmp_path, in_radians), angle_unit="rad")
    assert again.data.quaternion == pytest.approx(read.data.quaternion)
    assert again.data.position == pytest.approx(read.data.position)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b,c,d\n1,2,3,4\n", "this is no table of RoboDK's calibration; got '4 columns'"),
        (
            POINTS.replace("J1,J2,J3,J4,J5,J6", "J6,J5,J4,J3,J2,J1"),
            "the joints do not follow each other, and columns go by their place; got 'J5 behind J6'",
        ),
        (POINTS.replace("J1,", "configuration,"), "not that of a joint, and joints come first; got 'configuration'"),
        (POINTS.removeprefix(HEADINGS), "holds numbers where headings belong"),
        (POINTS.replace(",", ";"), "not separated by commas"),
        (POINTS.replace("1500.5", "here"), "line 2, column X.*a number belongs here; got 'here'"),
        (POINTS.replace("1500.5", ""), "line 2, column X.*the cell is empty"),
        ("h,,,,,,,,,,,,,,,,,\n0,0,0,0,0,0,500,0,800,90,0,90,0,0,50,0,0,0\n", "does not say in what unit"),
        (HEADINGS, "a header and no rows"),
        ("", "empty"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, text: str, words: str) -> None:
    out = tmp_path / "data.csv"
    with pytest.raises(InputError, match=f"(?s){words}"):
        truearm.import_robodk(written(tmp_path, text), out=out)
    assert not out.exists()


def test_semicolons_and_decimal_commas(tmp_path: Path) -> None:
    plain = truearm.import_robodk(written(tmp_path, POINTS)).data
    other = written(tmp_path, POINTS.replace(",", ";").replace(".", ","))
    data = truearm.import_robodk(other, delimiter="semicolon", decimal="comma").data
    assert np.array_equal(data.position, plain.position, equal_nan=True)
    assert np.array_equal(data.joints, plain.joints)
    tabs = truearm.import_robodk(written(tmp_path, POINTS.replace(",", "\t")), delimiter="tab").data
    assert np.array_equal(tabs.joints, plain.joints)
    with pytest.raises(InputError, match="commas cannot stand between columns and in numbers"):
        truearm.import_robodk(other, decimal="comma")
    with pytest.raises(InputError, match="or name what the file has by `delimiter` and `decimal`"):
        truearm.import_robodk(other)
    with pytest.raises(InputError, match=r"line 2, column X.*has a decimal comma.*`decimal=comma`") as refusal:
        truearm.import_robodk(written(tmp_path, POINTS.replace(",", ";").replace(".", ",")), delimiter="semicolon")
    assert refusal.value.parameter == "decimal"
    with pytest.raises(InputError, match=r"line 2, column X: the number has a point.*name the other decimal sign"):
        truearm.import_robodk(written(tmp_path, POINTS.replace(",", ";")), delimiter="semicolon", decimal="comma")


def calibrated() -> tuple[truearm.Robot, Dataset]:
    _, data = campaign("irb120", 12, 0.0, 1)
    return truearm.calibrate("irb120", data, train="all", model="geometric").fit.robot, data


def test_out_and_in_again(tmp_path: Path) -> None:
    robot, data = calibrated()
    table = tmp_path / "robodk.csv"
    exported = truearm.export_robodk(robot, data, out=table)
    assert (exported.configurations, exported.readings) == (12, 36)
    assert table.read_text() == exported.text
    back = truearm.import_robodk(table)
    assert back.data.joints == pytest.approx(data.joints, abs=1e-9)
    assert back.data.position == pytest.approx(data.position, abs=1e-9)
    # What RoboDK computes, flange pose times tool point, is where the robot has the target.
    for index, name in enumerate(data.targets):
        at, turned = robot.world_poses(data.joints)
        assert at + turned @ back.tool_points[index] == pytest.approx(robot.world_poses(data.joints, name)[0], abs=1e-9)
    with pytest.raises(InputError, match="exists already"):
        truearm.export_robodk(robot, data, out=table)


def test_poses_out_and_in_again(tmp_path: Path) -> None:
    twin, data = campaign("irb120", 8, 0.0, 1)
    at, turned = twin.robot.world_poses(data.joints)
    poses = Dataset.of(data.joints, at, quaternions=quaternion_from_rotation(turned), targets=["tip"])
    robot = truearm.calibrate("irb120", poses, train="all", model="joints").fit.robot
    table = tmp_path / "robodk.csv"
    truearm.export_robodk(robot, poses, out=table)
    back = truearm.import_robodk(table, angle_unit="rad").data
    assert back.position == pytest.approx(poses.position, abs=1e-9)
    assert back.quaternion is not None
    assert rotation_from_quaternion(back.quaternion) == pytest.approx(turned, abs=1e-8)


def test_joints_as_the_controller_shows_them(tmp_path: Path) -> None:
    _, data = campaign("lrmate200ic", 12, 0.0, 1)
    robot = truearm.calibrate("lrmate200ic", data, train="all", model="geometric").fit.robot
    shown = truearm.export_robodk(robot, data)
    model = truearm.export_robodk(robot, data, joints="model")
    assert (shown.joints_are, model.joints_are) == ("controller", "model")
    table = tmp_path / "table.csv"
    table.write_text(shown.text)
    back = truearm.import_robodk(table, joints_are="controller").data
    assert robot.controller.to_model(back.joints) == pytest.approx(data.joints, abs=1e-9)
    assert not np.allclose(back.joints, data.joints)


def test_what_robodk_has_no_place_for_is_refused(tmp_path: Path) -> None:
    robot, data = calibrated()
    other = replace(data, targets=("1", "2", "tip"))
    with pytest.raises(InputError, match=r"no target of this name.*got 'tip'; allowed: 1, 2, 3"):
        truearm.export_robodk(robot, other)
    with pytest.raises(InputError, match="six turning joints"):
        truearm.export_robodk("li3", data)
    balls = truearm.simulate("irb120", truth="nominal", poses=4, device="ballbar").data
    with pytest.raises(InputError, match="positions in the instrument's frame"):
        truearm.export_robodk(robot, balls)
