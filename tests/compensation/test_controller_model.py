"""What is asked of a controller before poses are corrected for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.commanding import Truearm
from tests.compensation.workplace import cell
from tests.ur_controller import UR3E_CONF, UR10_CONF

import truearm
from truearm import InputError, Robot
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
    for stated in (None, "unknown"):
        with pytest.raises(InputError, match="compute with what the factory measured") as refusal:
            compensate(worn("ur10"), [program(tmp_path, POSES)], controller_kinematics=stated)
        assert refusal.value.parameter == "controller_kinematics"
        for words in ("calibration.conf", "`controller_kinematics=nominal`", "proprietary"):
            assert words in str(refusal.value)


def test_the_call_counts_more_than_the_robot_file(tmp_path: Path) -> None:
    job = [program(tmp_path, POSES)]
    assert compensate(worn("ur10", "nominal"), job, controller_kinematics=None).files[0].corrected == 2
    with pytest.raises(InputError, match="before this is answered"):
        compensate(worn("ur10", "nominal"), job, controller_kinematics="unknown")


def test_a_model_that_nobody_can_read_is_refused_for_poses(tmp_path: Path) -> None:
    for robot, text in (("ur10", POSES), ("irb120", RAPID)):
        with pytest.raises(InputError, match="a model that nobody else can read") as refusal:
            compensate(worn(robot, "proprietary"), [program(tmp_path, text)], controller_kinematics=None)
        assert "`controller_kinematics=nominal`" in str(refusal.value), robot


def test_joints_do_not_pass_through_kinematics(tmp_path: Path) -> None:
    for kinematics in ("proprietary", "unknown"):
        job = [program(tmp_path, JOINTS)]
        result = truearm.compensate(worn("ur10", kinematics), job)  # nothing is corrected, so nothing is asked either
        assert result.files[0].text == job[0].read_bytes(), kinematics
        outcome = compensate(worn("ur10", kinematics), job, controller_kinematics=None, joint_targets="correct")
        assert outcome.files[0].corrected == 2, kinematics


def test_both_questions_are_asked_at_once_and_nothing_is_written(tmp_path: Path) -> None:
    """ABB delivers Absolute Accuracy where it was ordered, and no program says which of its points were taught."""
    job, out = [program(tmp_path, RAPID)], tmp_path / "out"
    with pytest.raises(InputError, match="before this is answered") as refusal:
        truearm.compensate(worn("irb120"), job, out=out)
    assert refusal.value.parameter == "taught, controller_kinematics"
    for words in (
        "`taught=none`",
        "(taught: [none])",
        "Does this controller have Absolute Accuracy?",
        "`controller_kinematics=nominal`",
        "(controller_kinematics: nominal)",
    ):
        assert words in str(refusal.value)
    assert not out.exists()
    answers = ({"taught": ["none"]}, "controller_kinematics"), ({"controller_kinematics": "nominal"}, "taught")
    for answered, left in answers:
        with pytest.raises(InputError) as refusal:
            truearm.compensate(worn("irb120"), job, out=out, **answered)
        assert refusal.value.parameter == left
    result = compensate(worn("irb120"), job, out=out)
    assert result.files[0].corrected == 2
    assert result.files[0].text == compensate(worn("irb120", "nominal"), job).files[0].text


def test_a_cell_file_keeps_the_answers(tmp_path: Path) -> None:
    job = [program(tmp_path, RAPID)]
    answers = cell(tmp_path, "taught: [none]\ncontroller_kinematics: nominal\n")
    result = compensate(worn("irb120"), job)
    for built in (
        truearm.compensate(worn("irb120"), job, tools=answers),
        truearm.compensate(worn("irb120"), job, frames=answers),
    ):
        assert (built.files[0].text, built.applied()["taught"]) == (result.files[0].text, [])
        assert built.applied()["controller"] == result.applied()["controller"]
    assert truearm.compensate(worn("irb120"), job, tools=answers, taught=["points"]).files[0].kept == {"taught": 1}
    with pytest.raises(InputError, match="two files answer this differently"):
        truearm.compensate(worn("irb120"), job, tools=answers, frames=cell(tmp_path, "taught: [points]\n", "b.yaml"))
    other = cell(tmp_path, "controller_kinematics: proprietary\n", "b.yaml")
    with pytest.raises(InputError, match="that nobody else can read"):
        compensate(worn("irb120"), job, controller_kinematics=None, frames=other)


def test_a_cell_file_names_a_kinematics_file_from_its_own_folder(tmp_path: Path) -> None:
    """The file is of another UR10 than this one, which is noticed only if it is read."""
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "calibration.conf").write_text(UR10_CONF)
    for name, words in (("calibration.conf", "not those of this arm"), ("calibration.cnf", "no such file")):
        answers = cell(tmp_path / "cell", f"taught: [none]\ncontroller_kinematics: {name}\n")
        with pytest.raises(InputError, match=words) as refusal:
            truearm.compensate(worn("ur10"), [program(tmp_path, POSES)], tools=answers)
    assert refusal.value.parameter == "tools, frames"


def test_kinematics_of_another_arm_are_refused_until_they_are_accepted(tmp_path: Path) -> None:
    """What a factory measured of an arm is nearer to what calibration finds of it than the data sheet is."""
    robot, job, out = worn("ur10"), [program(tmp_path, POSES)], tmp_path / "out"
    for text, words in (
        (UR3E_CONF, "the kinematics of another type of robot"),
        (UR10_CONF[:300], "six numbers in brackets belong here"),
        (UR10_CONF, r"not those of this arm: .* the data sheet 1\.00 mm"),
    ):
        conf = tmp_path / "other.conf"
        conf.write_text(text)
        with pytest.raises(InputError, match=words) as refusal:
            compensate(robot, job, controller_kinematics=conf, out=out)
        assert refusal.value.parameter == "controller_kinematics"
        assert not out.exists()
    assert compensate(robot, job, controller_kinematics=conf, accept=["other-kinematics"]).files
    # The file of the kinematics is not overwritten.
    out.mkdir()
    for name in ("compensation.html", "a.script", "a.script.truearm.json"):
        conf = conf.rename(out / name)
        with pytest.raises(InputError, match="overwritten"):
            compensate(robot, job, controller_kinematics=conf, out=out, accept=["other-kinematics"])
        assert conf.read_text() == UR10_CONF


def test_a_controller_of_a_maker_who_calibrates_every_arm_is_doubted_to_be_nominal(tmp_path: Path) -> None:
    result = compensate(worn("ur10"), [program(tmp_path, POSES)], controller_kinematics="nominal")
    assert "controller-nominal" in {notice.code for notice in result.warnings}


def test_an_imported_robot_is_not_a_calibrated_one(tmp_path: Path) -> None:
    (tmp_path / "calibration.conf").write_text(UR10_CONF)
    imported = truearm.import_ur_kinematics(tmp_path / "calibration.conf", "ur10").robot
    with pytest.raises(InputError, match="not calibrated"):
        nominal_robot(imported)
    nominal, joints = nominal_robot(imported.with_values({"a_3": -0.6})), np.zeros((1, 6))
    np.testing.assert_allclose(nominal.forward(joints)[0], imported.forward(joints)[0], rtol=1e-5, atol=1e-8)
    # A conversion says nothing of the controller any more.
    assert truearm.convert(imported, "mcpc").robot.controller.kinematics.kind == "unknown"
    assert truearm.convert(worn("ur10", "nominal"), "mcpc").robot.controller.kinematics.kind == "nominal"


def test_saying_what_the_controller_has_does_not_change_what_is_known_of_a_calibration(tmp_path: Path) -> None:
    text = robot_text(sealed(worn("ur10"), Proof("converged", (), (), (), (), (), ())))
    for entry, intact in (("kinematics: nominal", True), ("base: {translation: [1, 0, 0]}", False)):
        (tmp_path / "mine.yaml").write_text(text.replace("controller:\n", f"controller:\n  {entry}\n"))
        assert is_intact(read_robot(tmp_path / "mine.yaml")) is intact


def test_the_command_names_its_option(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "worn.yaml").write_text(robot_text(worn("ur10")))
    answers = ("--taught", "none", "--out", tmp_path / "out")
    command = ("compensate", tmp_path / "worn.yaml", program(tmp_path, POSES), *answers)
    refused = truearm(*command)
    assert refused.code == 2
    assert "--controller-kinematics nominal" in " ".join(refused.err.split())
    (tmp_path / "calibration.conf").write_text(UR10_CONF)
    other = truearm(*command, "--controller-kinematics", tmp_path / "calibration.conf")
    assert other.code == 2
    assert "--accept other-kinematics" in " ".join(other.err.split())
    accepted = ("--controller-kinematics", tmp_path / "calibration.conf", "--accept", "other-kinematics")
    assert truearm(*command, *accepted).code == 0


def test_the_command_imports(truearm: Truearm, tmp_path: Path) -> None:
    conf, out = tmp_path / "calibration.conf", tmp_path / "mine.yaml"
    conf.write_text(UR10_CONF)
    outcome = truearm("import", "ur-kinematics", conf, "--robot", "ur10e", "--out", out)
    assert outcome.code == 0
    assert "Warning (type-doubtful): The file is rather of an arm of type ur10." in " ".join(outcome.out.split())
    again = truearm("import", "ur-kinematics", conf, "--robot", "ur10", "--out", out)
    assert again.code == 2  # nothing is overwritten
    refused = truearm("import", "ur-kinematics", conf, "--robot", "ur5e", "--out", tmp_path / "no.yaml")
    assert refused.code == 2
    assert "Of the library, ur10 and ur10e fit." in " ".join(refused.err.split())
    assert not (tmp_path / "no.yaml").exists()
    listing = truearm("import", "ur-kinematics", conf, "--robot", "ur10", "--out", tmp_path / "b.yaml", "--json")
    assert '"type-not-told"' in listing.out
    assert '"joint_checksum": "0x6e0f7bf' in listing.out
