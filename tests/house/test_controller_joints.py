"""Joint positions of the controller go in and out of every job, and are refused where nobody knows what they mean."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.simulated import campaign

import truearm
from truearm.engine.data.controller_joints import in_controller_joints, in_model_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import Controller, JointsOf
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.hexapod.sheet_reading import read_touches

FANUC = "lrmate200ic"
#: Its file says nothing of a controller.
UNKNOWN = "katana450"
HALF = 0.7071067811865476

SLIDING = """\
truearm: truearm-robot/1
name: sliding
units: {length: mm, angle: deg}
convention: urdf
joints:
  - {name: first, axis: [0, 0, 1]}
  - {name: second, axis: [0, 1, 0], x: 300}
  - {name: slide, type: prismatic, axis: [1, 0, 0], x: 200, limits: [-100, 100]}
controller:
  joints: [{joint: second, sign: -1, zero: 90, coupling: {first: 0.5}}, {joint: slide, zero: 250}]
"""


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as stream:
        return list(csv.DictReader(stream))


def shown(joints: Array) -> Array:
    """Return FANUC's readings at plain angles between links, written out."""
    j2, j3 = joints[:, 1], joints[:, 2]
    return np.column_stack([joints[:, :2], -(j3 + j2), -joints[:, 3:]])


@pytest.fixture
def data() -> Dataset:
    return campaign(FANUC, 12, 2e-5, 3)[1]


@pytest.fixture
def pendant(tmp_path: Path, data: Dataset) -> Path:
    """Return the file of a campaign as the pendant shows it."""
    file = tmp_path / "pendant.csv"
    file.write_text(csv_text(replace(data, joints=shown(data.joints), joints_are="controller")))
    return file


# -- in ------------------------------------------------------------------------------------------------------


def test_a_file_is_read_and_written_as_it_is(pendant: Path, data: Dataset) -> None:
    read = truearm.load_data(pendant)
    assert read.joints_are == "controller"
    assert "of 6 joints as the controller shows them" in repr(read)
    assert csv_text(read) == pendant.read_text()
    assert pendant.read_text().startswith("configuration,axis_1 [deg],")
    with_robot = truearm.load_data(pendant, FANUC)
    assert with_robot.joints_are == "converted"
    assert with_robot.joints == pytest.approx(data.joints, abs=1e-12)
    _, plain = campaign("irb120", 8, 1e-5, 0)  # its controller counts as its model: it takes either name
    pendant.write_text(csv_text(replace(plain, joints_are="controller")))
    assert truearm.load_data(pendant, "irb120").joints == pytest.approx(plain.joints, abs=1e-12)
    assert csv_text(with_robot).startswith("configuration,joint_1 [deg],")


def test_where_joints_came_from_is_that_of_the_models_joints() -> None:
    rows = [[0.0, 10, 20, 0, 0, 0], [0, 20, 20, 5, 0, 0], [0, 30, 20, 0, 0, 0], [0, 30, 25, 0, 0, 0]]
    joints, order = np.radians(np.array(rows)), [0, 1, 2, 3]
    there = Dataset.of(joints, np.ones((4, 3)), order=order)
    noted = Dataset.of(shown(joints), np.ones((4, 3)), order=order, joints_are="controller")
    came = in_model_joints(load_robot(FANUC), noted)
    assert came.approach == pytest.approx(known(there.approach))
    assert came.number == pytest.approx(there.number)


def test_converting_there_and_back_changes_nothing(data: Dataset) -> None:
    robot = load_robot(FANUC)
    beside = replace(data, references=replace(data, references=None))
    there = in_controller_joints(robot, beside)
    assert there.joints == pytest.approx(shown(data.joints))
    assert in_controller_joints(robot, there) is there
    back = in_model_joints(robot, there)
    for part in (back, known(back.references)):
        assert part.joints == pytest.approx(data.joints, abs=1e-12)
        assert part.joints_are == "converted"
    assert in_model_joints(robot, back) is back
    joints = np.random.default_rng(0).uniform(-2, 2, size=(101, 6))
    twice = np.concatenate([joints, joints[::-1]])
    read = in_model_joints(robot, Dataset.of(twice, np.ones((202, 3)), joints_are="controller"))
    assert (read.joints[:101] == read.joints[:100:-1]).all()  # what repeats stays equal to the last digit
    refused(None, "joints of the reference points are of another kind", replace, data, references=there)


def test_slides_and_zeros(tmp_path: Path) -> None:
    file = tmp_path / "sliding.yaml"
    file.write_text(SLIDING)
    robot = read_robot(file)
    lines = ["configuration,axis_1 [deg],axis_2 [deg],axis_3 [mm],target,x [mm],y [mm],z [mm]"]
    lines += ["a,10,60,260,t,1,2,3", "b,-20,90,200,t,3,2,1"]
    (tmp_path / "data.csv").write_text("\n".join(lines) + "\n")
    read = truearm.load_data(tmp_path / "data.csv", robot)
    # 60 = 90 - (second + 0.5 * 10), 90 = 90 - (second - 0.5 * 20)
    assert np.degrees(read.joints[:, :2]) == pytest.approx(np.array([[10.0, 25.0], [-20.0, 10.0]]))
    assert read.joints[:, 2] == pytest.approx([0.01, -0.05])


def test_other_tables_say_whose_joints_they_hold(tmp_path: Path) -> None:
    (tmp_path / "joints.txt").write_text("0 10 20\n5 15 30\n")
    (tmp_path / "points.txt").write_text("1 2 3\n4 5 6\n")
    files = (tmp_path / "joints.txt", {"t": tmp_path / "points.txt"})
    for whose, column in zip(get_args(JointsOf), ("axis_1", "joint_1"), strict=True):
        out = tmp_path / f"{whose}.csv"
        made = truearm.import_matrices(*files, angle_unit="deg", length_unit="mm", joints_are=whose, out=out)
        assert (made.data.joints_are, column in out.read_text()) == (whose, True)
    mapping = """\
truearm: truearm-mapping/1
length_unit: mm
configuration: {each: row}
joints: {columns: [q1, q2], unit: degARE}
readings: [{target: tip, x: x, y: y, z: z}]
"""
    table, file = tmp_path / "table.csv", tmp_path / "map.yaml"
    table.write_text("q1,q2,x,y,z\n10,20,100,200,300\n")
    asked: JointsOf | None
    for are in ("", ", are: controller"):
        file.write_text(mapping.replace("ARE", are))
        for asked in (None, "controller"):
            expected = "controller" if are or asked else "model"
            assert truearm.import_table(table, file, joints_are=asked).data.joints_are == expected
    words = r"joints\.are: the mapping says whose joint positions they are.*Leave one"
    refused(None, words, truearm.import_table, table, file, joints_are="model")


def test_touched_cups_are_read_from_the_pendant(tmp_path: Path) -> None:
    robot = load_robot(FANUC)
    q = np.radians(np.array([[0.0, 10, 20, 30, 40, 50], [5] * 6, [9, 8, 7, 6, 5, 4]]))
    lines = [",".join(["cup", *(f"axis_{i} [deg]" for i in range(1, 7))])]
    lines += [",".join([f"B{i}", *map(repr, row)]) for i, row in enumerate(np.degrees(shown(q)).tolist(), 1)]
    file = tmp_path / "touches.csv"
    file.write_text("\n".join(lines) + "\n")
    assert read_touches(file, robot) == pytest.approx(q, abs=1e-12)
    unknown = replace(robot, controller=Controller())
    refused(None, r"touches\.csv, column axis_1: it is not known how", read_touches, file, unknown)


def test_other_entry_errors_are_looked_for_in_what_was_noted(data: Dataset) -> None:
    robot = load_robot(FANUC)
    robot = replace(robot, controller=replace(robot.controller, zeros=(0.0, 0.0, 1.5, 0.0, 0.0, 0.0)))
    noted = in_controller_joints(robot, data)
    for joints, code, words in (
        (np.radians(noted.joints), "unit-angle", "The joints: radians are called deg"),
        (noted.joints * [1, -1, 1, 1, 1, 1], "joint-sign", "sign of joint 2 is"),
        (noted.joints[:, [0, 2, 1, 3, 4, 5]], "joint-sign", "Joints 2 and 3 are in the wrong order"),
    ):
        said = truearm.check(robot, replace(noted, joints=joints)).warnings[0]
        assert (said.code, words in said.message) == (code, True), said.message


# -- out -----------------------------------------------------------------------------------------------------


def test_simulated_data_are_written_as_asked_and_say_the_same(tmp_path: Path) -> None:
    made = {}
    for whose in ("model", "controller"):
        file = tmp_path / f"{whose}.csv"
        truearm.simulate(FANUC, truth="random", poses=15, noise=2e-5, joints=whose, out=file)
        made[whose] = truearm.load_data(file)
        assert not truearm.check(FANUC, file).warnings
    assert made["controller"].joints == pytest.approx(shown(made["model"].joints), abs=1e-12)
    assert (made["controller"].position == made["model"].position).all()


def test_a_plan_is_chosen_among_configurations_of_the_pendant(pendant: Path, data: Dataset, tmp_path: Path) -> None:
    plan = truearm.plan(FANUC, poses=8, model="offsets", candidates_from=pendant, out=tmp_path / "plan.csv")
    place = {label: row for row, label in enumerate(data.labels)}
    for label, q in zip(plan.labels, plan.joints, strict=True):
        assert q == pytest.approx(data.joints[place[label]], abs=1e-12)
    assert plan.joints_are == "controller"
    assert plan.lines()[-1] == "Joint positions in the file are those that the robot's controller shows (axis_i)."


def test_what_is_to_be_commanded_is_written_as_asked(tmp_path: Path) -> None:
    q = np.radians([[10.0, 20.0, -40.0, 30.0, 50.0, 60.0]])
    p, R = load_robot(FANUC).forward(q)
    whose: JointsOf | None
    for whose in ("model", "controller", None):
        column = "joint" if whose == "model" else "axis"
        found = truearm.inverse(FANUC, p, R, seed_joints=q[0], joints=whose, out=tmp_path / "ik.csv")
        assert found.joints == pytest.approx(q, abs=1e-7)
        line = truearm.lines(FANUC, (0.45, 0.0, 0.3), size=(0.1, 0.1, 0.1), joints=whose, out=tmp_path / "lines.csv")
        for file, joints in (("ik.csv", found.joints), ("lines.csv", line.joints)):
            written = [[float(row[f"{column}_{i} [deg]"]) for i in range(1, 7)] for row in rows(tmp_path / file)]
            expected = joints if column == "joint" else shown(joints)
            assert np.radians(written) == pytest.approx(expected, abs=1e-12), (whose, file)
    truearm.lines("irb120", (0.35, 0.0, 0.4), size=(0.05, 0.05, 0.05), out=tmp_path / "plain.csv")
    assert list(rows(tmp_path / "plain.csv")[0])[1] == "joint_1 [deg]"


def test_the_hexapods_sheet_and_steps_are_the_controllers(tmp_path: Path) -> None:
    sheet, steps = tmp_path / "sheet.csv", tmp_path / "steps.txt"
    place = (0.3, 0.0, 0.1, -0.5)
    made = truearm.hexapod_plan(FANUC, place, tool="triangular", branches=["front-up"], out=sheet, steps=steps)
    expected = shown(np.array([row.joints for row in made.reachable.rows]))
    written = [[float(row[f"axis_{i} [deg]"]) for i in range(1, 7)] for row in rows(sheet)]
    assert np.radians(written) == pytest.approx(expected, abs=1e-12)
    first = " ".join(f"{v:.3f}" for v in np.degrees(expected[0]))
    assert f"joints as the controller shows them {first}" in steps.read_text()


# -- frames --------------------------------------------------------------------------------------------------


def turned() -> Robot:
    """Return an arm whose controller has its base half a turn about z and its flange elsewhere."""
    controller = Controller(
        base=Transform((0.1, 0.0, 0.2), (0.0, 0.0, 0.0, 1.0)), flange=Transform((0.0, 0.0, 0.05), (HALF, 0, HALF, 0))
    )
    return replace(load_robot("irb120"), controller=controller)


def test_poses_in_the_controllers_frame_are_of_its_flange(tmp_path: Path) -> None:
    robot, q = turned(), np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]])
    p, R = robot.forward(q)
    there, its = robot.forward(q, frame="controller")
    flange = p + R[:, :, 2] * 0.05
    assert there == pytest.approx((flange - [0.1, 0.0, 0.2]) * [-1, -1, 1])
    assert its[0] == pytest.approx(np.diag([-1.0, -1.0, 1.0]) @ R[0] @ [[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    (tmp_path / "robot.yaml").write_text(robot_text(robot))
    assert read_robot(tmp_path / "robot.yaml").controller.flange == robot.controller.flange
    found = robot.inverse(there, its, frame="controller", seed=q)
    assert found.joints == pytest.approx(q, abs=1e-7)
    step = 1e-6
    rates = (robot.forward(q + np.eye(1, 6) * step, frame="controller")[0] - there) / step
    assert robot.jacobian(q, frame="controller")[0, :3, 0] == pytest.approx(rates[0], abs=1e-5)
    aimed = robot.with_frames(Transform((1.0, 2.0, 3.0)), {"tip": (0.1, 0.0, 0.2)})
    base, _ = aimed.forward(q, target="tip")
    there, _ = aimed.forward(q, frame="controller", target="tip")
    assert there == pytest.approx((base - [0.1, 0, 0.2]) * [-1, -1, 1])


def test_poses_in_the_models_frame_are_said_to_be() -> None:
    robot, q = turned(), np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]])
    p, R = robot.forward(q)
    (said,) = truearm.inverse(robot, p, R, seed_joints=q[0]).warnings
    assert (said.code, said.level) == ("model-frame", "note")
    assert "for poses that the pendant shows use `frame=controller`" in said.message
    there = robot.forward(q, frame="controller")
    assert not truearm.inverse(robot, *there, seed_joints=q[0], frame="controller").warnings
    assert not truearm.inverse(robot, p, R, seed_joints=q[0], frame="world").warnings
    assert not truearm.inverse("irb120", p, R, seed_joints=q[0]).warnings


def test_a_urdf_of_ros_industrial_knows_the_controllers_base(tmp_path: Path) -> None:
    links = ["base_link", "base", "arm", "flange", "tool0"]
    joints = [
        ("to_base", "fixed", "base_link", "base", "0 0 0", f"0 0 {np.pi!r}"),
        ("turn", "revolute", "base_link", "arm", "0 0 0.3", "0 0 0"),
        ("to_flange", "fixed", "arm", "flange", "0.5 0 0", "0 0 0"),
        ("to_tool0", "fixed", "flange", "tool0", "0 0 0", f"0 {np.pi / 2!r} 0"),
    ]
    text = '<robot name="ur">' + "".join(f'<link name="{link}"/>' for link in links)
    for name, kind, parent, child, xyz, rpy in joints:
        text += f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        text += f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>'
    (tmp_path / "ur.urdf").write_text(text + "</robot>")
    for end in ("", "#flange"):
        robot = load_robot(f"{tmp_path / 'ur.urdf'}{end}")
        p, R = robot.forward([np.pi / 2], frame="controller")
        assert p[0] == pytest.approx([0.0, -0.5, 0.3], abs=1e-12)
        assert R[0, :, 2] == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)
        assert not robot.controller.counts_known
    text = text.replace('"tool0"', '"other"')
    (tmp_path / "ur.urdf").write_text(text + "</robot>")
    assert load_robot(tmp_path / "ur.urdf").controller == Controller()


# -- what is shown -------------------------------------------------------------------------------------------


def test_joints_are_shown_of_the_controller_where_it_is_known() -> None:
    said = truearm.show(UNKNOWN, joint_positions=np.zeros(5))
    assert any("does not say where its controller has its frames" in line for line in said.lines())
    assert said.summary()["at"]["joints"] == {"model": [0.0] * 5}
    assert truearm.show(UNKNOWN).summary()["at"] is None
    q = np.radians([10.0, 20.0, -50.0, -40.0, -50.0, -60.0])
    joints = truearm.show(FANUC, joint_positions=q, joints_are="model").summary()["at"]["joints"]
    assert joints["controller"] == pytest.approx([10, 20, 30, 40, 50, 60])


# -- refused -------------------------------------------------------------------------------------------------


def headed(folder: Path, *names: str) -> Path:
    file = folder / "data.csv"
    joints = ",".join(f"{name} [deg]" for name in names)
    file.write_text(f"configuration,{joints},target,x [mm],y [mm],z [mm]\na{',1' * len(names)},t,1,2,3\n")
    return file


NOT_KNOWN = "it is not known how the controller of katana450 counts the joints"


def test_what_nobody_knows_of_joints_and_frames_is_refused(tmp_path: Path) -> None:
    words = "one kind; got 'joint_1, axis_2'.*Keep the columns of one kind"
    refused(None, words, truearm.load_data, headed(tmp_path, "joint_1", "axis_2"))
    words = "the column axis_2 is missing; got 'axis_1, axis_3'; allowed: axis_1, axis_2"
    refused(None, words, truearm.load_data, headed(tmp_path, "axis_1", "axis_3"))
    every = headed(tmp_path, *(f"axis_{number}" for number in range(1, 6)))
    refused(None, f"data.csv, column axis_1: {NOT_KNOWN}.*under controller", truearm.check, UNKNOWN, every)
    one = headed(tmp_path, "axis_1")
    refused(None, "Give one column axis_i for each joint", truearm.check, FANUC, one)
    words = r"the joint positions are the controller's.*truearm.load_data\(data, robot\)"
    refused(None, words, lambda: truearm.load_data(one).postures)
    words = "no such kind of joint positions; got 'robot'; allowed: model, controller, converted"
    refused("joints_are", words, Dataset.of, [[0.0]], [[1.0, 2, 3]], joints_are="robot")
    refused("joints", NOT_KNOWN, truearm.plan, UNKNOWN, poses=4, joints="controller")
    show, zero = partial(truearm.show, UNKNOWN), np.zeros(5)
    refused("joints_are", NOT_KNOWN, show, joint_positions=zero, joints_are="controller")
    refused("joint_positions", "", truearm.show, FANUC, joint_positions=[0.0, 1.0])
    words = "it is not known where the controller of katana450 has its frames.*Say under controller"
    refused("frame", words, load_robot(UNKNOWN).forward, zero, frame="controller")
    words = "the controller's flange is not the model's.*`frame=base`"
    refused("orientation", words, turned().inverse, [[0.3, 0, 0.3]], frame="controller", orientation="free")
