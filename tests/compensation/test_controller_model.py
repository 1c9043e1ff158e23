"""What is asked of a controller before poses are corrected for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.ur_controller import UR3E_CONF, UR10_CONF

import truearm
from truearm import InputError, Robot
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot_file.entries import STATED
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.seal import is_intact, sealed
from truearm.engine.robot.robot_file.writing import robot_text

POSES = (
    "def a():\n  set_tcp(p[0,0,0,0,0,0])\n"
    "  movel(p[-0.5, -0.3, 0.4, 0, 3.1, 0])\n  movel(p[-0.5, -0.2, 0.4, 0, 3.1, 0])\nend\n"
)
JOINTS = (
    "def a():\n  set_tcp(p[0,0,0,0,0,0])\n"
    "  movej([0.1, -1.2, 1.3, -1.5, -1.5, 0.2])\n  movej([0.3, -1.2, 1.3, -1.5, -1.5, 0.2])\nend\n"
)
RAPID = (
    "MODULE a\n  CONST robtarget p1:=[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    "  PROC main()\n    MoveL p1,v100,fine,tool0;\n    MoveL Offs(p1,0,90,0),v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
)


def worn(robot: str, kinematics: str | None = None) -> Robot:
    arm = truearm.load_robot(robot)
    arm = arm.with_values({"a_3": arm.values["a_3"] + 1e-3, "alpha_4": arm.values["alpha_4"] + 1e-3})
    if kinematics is None:
        return arm
    return replace(arm, controller=replace(arm.controller, kinematics=STATED[kinematics]))


def program(folder: Path, text: str) -> Path:
    path = folder / ("a.script" if text.startswith("def") else "a.mod")
    path.write_text(text)
    return path


def test_a_controller_that_is_surely_calibrated_is_asked_for_its_kinematics(tmp_path: Path) -> None:
    for said in (None, "unknown"):
        with pytest.raises(InputError, match="compute with what the factory measured") as refusal:
            compensate(worn("ur10"), [program(tmp_path, POSES)], controller_kinematics=said)
        assert refusal.value.parameter == "controller_kinematics"
        for words in ("calibration.conf", "`controller_kinematics=nominal`", "proprietary"):
            assert words in str(refusal.value)


def test_the_call_counts_more_than_the_robot_file(tmp_path: Path) -> None:
    job = [program(tmp_path, POSES)]
    assert compensate(worn("ur10", "nominal"), job, controller_kinematics=None).files[0].corrected == 2
    with pytest.raises(InputError, match="before this is answered"):
        compensate(worn("ur10", "nominal"), job, controller_kinematics="unknown")


@pytest.mark.parametrize(("robot", "text"), [("ur10", POSES), ("irb120", RAPID)])
def test_a_model_that_nobody_can_read_is_refused_for_poses(robot: str, text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a model that nobody else can read") as refusal:
        compensate(worn(robot, "proprietary"), [program(tmp_path, text)], controller_kinematics=None)
    assert "`controller_kinematics=nominal`" in str(refusal.value)


@pytest.mark.parametrize("kinematics", ["proprietary", "unknown"])
def test_joints_do_not_pass_through_kinematics(kinematics: str, tmp_path: Path) -> None:
    job = [program(tmp_path, JOINTS)]
    made = truearm.compensate(worn("ur10", kinematics), job)  # nothing is corrected, so nothing is asked either
    assert made.files[0].text == job[0].read_bytes()
    told = compensate(worn("ur10", kinematics), job, controller_kinematics=None, joint_targets="correct")
    assert told.files[0].corrected == 2


def test_both_questions_are_asked_at_once_and_nothing_is_written(tmp_path: Path) -> None:
    """ABB delivers Absolute Accuracy where it was ordered, and no program says which of its points were taught."""
    job, out = [program(tmp_path, RAPID)], tmp_path / "out"
    with pytest.raises(InputError, match="before this is answered") as refusal:
        truearm.compensate(worn("irb120"), job, out=out)
    assert refusal.value.parameter == "taught, controller_kinematics"
    for words in (
        "computed off-line, or taught with this robot?",
        "`taught=none`",
        "(taught: [none])",
        "Does this controller have Absolute Accuracy?",
        "`controller_kinematics=nominal`",
        "(controller_kinematics: nominal)",
        "(controller: {kinematics: nominal})",
    ):
        assert words in str(refusal.value)
    assert not out.exists()
    for answered, left in (
        ({"taught": ["none"]}, "controller_kinematics"),
        ({"controller_kinematics": "nominal"}, "taught"),
    ):
        with pytest.raises(InputError) as refusal:
            truearm.compensate(worn("irb120"), job, out=out, **answered)
        assert refusal.value.parameter == left
    made = compensate(worn("irb120"), job, out=out)
    assert made.files[0].corrected == 2
    assert made.files[0].text == compensate(worn("irb120", "nominal"), job).files[0].text


CELL = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"


def test_a_cell_file_keeps_the_answers(tmp_path: Path) -> None:
    job, cell, other = [program(tmp_path, RAPID)], tmp_path / "cell.yaml", tmp_path / "other.yaml"
    cell.write_text(f"{CELL}taught: [none]\ncontroller_kinematics: nominal\n")
    told = compensate(worn("irb120"), job)
    for kept in (
        truearm.compensate(worn("irb120"), job, tools=cell),
        truearm.compensate(worn("irb120"), job, frames=cell),
    ):
        assert (kept.files[0].text, kept.applied()["taught"]) == (told.files[0].text, [])
        assert kept.applied()["controller"] == told.applied()["controller"]
    assert truearm.compensate(worn("irb120"), job, tools=cell, taught=["points"]).files[0].kept == {"taught": 1}
    other.write_text(f"{CELL}taught: [points]\n")
    with pytest.raises(InputError, match="two files answer this differently"):
        truearm.compensate(worn("irb120"), job, tools=cell, frames=other)
    other.write_text(f"{CELL}controller_kinematics: proprietary\n")
    with pytest.raises(InputError, match="that nobody else can read"):
        compensate(worn("irb120"), job, controller_kinematics=None, frames=other)


def test_a_cell_file_names_a_kinematics_file_from_its_own_folder(tmp_path: Path) -> None:
    """The file is of another UR10 than this one, which is noticed only if it is read."""
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "calibration.conf").write_text(UR10_CONF)
    cell = tmp_path / "cell" / "cell.yaml"
    cell.write_text(f"{CELL}taught: [none]\ncontroller_kinematics: calibration.conf\n")
    with pytest.raises(InputError, match="not those of this arm"):
        truearm.compensate(worn("ur10"), [program(tmp_path, POSES)], tools=cell)
    cell.write_text(f"{CELL}taught: [none]\ncontroller_kinematics: calibration.cnf\n")
    with pytest.raises(InputError, match="no such file") as refusal:
        truearm.compensate(worn("ur10"), [program(tmp_path, POSES)], tools=cell)
    assert refusal.value.parameter == "tools, frames"


def test_every_maker_who_calibrates_is_known() -> None:
    makers = {one.calibration.maker: one.calibration.always for one in LANGUAGES if one.calibration is not None}
    assert makers == {"ABB": False, "KUKA": False, "FANUC": False, "Universal Robots": True, "Yaskawa": False}


def test_another_robots_file_is_refused_by_its_parameter(tmp_path: Path) -> None:
    for name, text in (("ur3e.conf", UR3E_CONF), ("short.conf", UR10_CONF[:300])):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError) as refusal:
            compensate(
                worn("ur10"), [program(tmp_path, POSES)], controller_kinematics=tmp_path / name, out=tmp_path / "o"
            )
        assert refusal.value.parameter == "controller_kinematics"
        assert not (tmp_path / "o").exists()


def test_kinematics_of_another_arm_are_refused_until_they_are_accepted(tmp_path: Path) -> None:
    """What a factory measured of an arm is nearer to what calibration finds of it than the data sheet is."""
    conf = tmp_path / "other.conf"
    conf.write_text(UR10_CONF)
    robot, job = worn("ur10"), [program(tmp_path, POSES)]
    with pytest.raises(InputError, match=r"not those of this arm: .* the data sheet 1\.00 mm") as refusal:
        compensate(robot, job, controller_kinematics=conf)
    assert refusal.value.parameter == "controller_kinematics"
    assert compensate(robot, job, controller_kinematics=conf, accept=["other-kinematics"]).files


def test_a_controller_of_a_maker_who_calibrates_every_arm_is_doubted_to_be_nominal(tmp_path: Path) -> None:
    made = compensate(worn("ur10"), [program(tmp_path, POSES)], controller_kinematics="nominal")
    assert "controller-nominal" in {notice.code for notice in made.warnings}


@pytest.mark.parametrize("name", ["compensation.html", "a.script", "a.script.truearm.json"])
def test_the_kinematics_file_is_not_overwritten(name: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text(UR10_CONF)
    job, accept = [program(tmp_path, POSES)], ["other-kinematics"]
    with pytest.raises(InputError, match="overwritten"):
        compensate(worn("ur10"), job, controller_kinematics=out / name, out=out, accept=accept)
    assert (out / name).read_text() == UR10_CONF


def test_an_imported_robot_is_not_a_calibrated_one(tmp_path: Path) -> None:
    (tmp_path / "calibration.conf").write_text(UR10_CONF)
    imported = truearm.import_ur_kinematics(tmp_path / "calibration.conf", "ur10").robot
    with pytest.raises(InputError, match="not calibrated"):
        nominal_robot(imported)
    joints = np.zeros((1, 6))
    assert np.allclose(
        nominal_robot(imported.with_values({"a_3": -0.6})).forward(joints)[0], imported.forward(joints)[0]
    )


def test_saying_what_the_controller_has_does_not_change_what_is_known_of_a_calibration(tmp_path: Path) -> None:
    robot = sealed(worn("ur10"), Proof("converged", (), (), (), (), (), ()))
    text = robot_text(robot)
    (tmp_path / "mine.yaml").write_text(text.replace("controller:\n", "controller:\n  kinematics: nominal\n"))
    assert is_intact(read_robot(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text(
        text.replace("controller:\n", "controller:\n  base: {translation: [1, 0, 0]}\n")
    )
    assert not is_intact(read_robot(tmp_path / "mine.yaml"))


def test_a_conversion_says_nothing_of_the_controller_any_more(tmp_path: Path) -> None:
    (tmp_path / "calibration.conf").write_text(UR10_CONF)
    imported = truearm.import_ur_kinematics(tmp_path / "calibration.conf", "ur10").robot
    assert truearm.convert(imported, "mcpc").robot.controller.kinematics.kind == "unknown"
    assert truearm.convert(worn("ur10", "nominal"), "mcpc").robot.controller.kinematics.kind == "nominal"
