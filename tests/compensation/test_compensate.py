"""``truearm compensate``: its contract, its files, its refusals."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import ANSWERS
from tests.commanding import Truearm
from tests.compensation.workplace import NO_AXES, cell, module, plate, pose

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.starting.demo import Demonstration
from truearm.starting.jobs import demo


def worn() -> Robot:
    """Return an IRB 120 as a calibration leaves it: errors, springy joints, a base in the instrument's frame."""
    springy = load_robot("irb120").with_effects(["compliance"]).with_payload(Payload(2.0, (0.0, 0.0, 0.1)))
    errors = {"a_3": 0.2708, "theta_offset_3": 0.002, "alpha_4": -1.5695, "d_4": 0.3024, "compliance_3": 1.3e-4}
    return springy.with_values(errors | {"base_x": 1.0, "base_rz": 0.5})


def stiff() -> Robot:
    """Return an IRB 120 whose gears err and whose joints do not bend."""
    return load_robot("irb120").with_effects(["transmission-error"]).with_values({"a_3": 0.2708, "alpha_4": -1.5695})


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a calibrated robot, the plate's program and a file of its tool and frame."""
    (tmp_path / "calibrated.yaml").write_text(robot_text(worn()))
    plate(tmp_path)
    tool = "tools:\n  tProbe: {of: flange, translation: [0.2, 0, 125]}\n"
    cell(tmp_path, f"{tool}frames:\n  wobjPlate: {{of: base, translation: [310.5, -110, 60]}}\n")
    return tmp_path


def run(truearm: Truearm, place: Path, *words: object, program: str = "plate.mod", out: str = "out") -> tuple[int, str]:
    answers = () if "--revert" in words else ANSWERS
    outcome = truearm("compensate", place / "calibrated.yaml", place / program, "--out", place / out, *answers, *words)
    return outcome.code, outcome.out + outcome.err


def result_of(truearm: Truearm, place: Path, *words: object, out: str = "out") -> dict[str, Any]:
    code, output = run(truearm, place, "--json", *words, out=out)
    assert code == 0, output
    content: dict[str, Any] = json.loads(output)
    return content


def test_the_contract(truearm: Truearm, place: Path) -> None:
    result = result_of(truearm, place)
    assert set(result) == {"programs", "expected_is_lower_bound", "expected_is_relative", "warnings"}
    (program,) = result["programs"]
    keys = {"file", "language", "targets", "corrected", "kept", "skipped", "shift_mm", "expected_mm", "not_better"}
    assert set(program) == keys
    assert (program["file"], program["language"]) == ("plate.mod", "RAPID")
    assert (program["targets"], program["corrected"], program["kept"]) == (44, 43, {"given by joints": 1})
    assert 0.05 < program["shift_mm"]["mean"] < program["shift_mm"]["max"] < 3.0
    assumed = {"unproven", "frames-assumed", "tools-assumed", "joint-targets-kept", "loads-taken"}
    assert {warning["code"] for warning in result["warnings"]} == assumed
    files = ["compensation.html", "plate.mod", "plate.mod.truearm.json", "truearm.manifest.json"]
    assert sorted(p.name for p in (place / "out").iterdir()) == files
    record = json.loads((place / "out" / "plate.mod.truearm.json").read_text())
    assert record["applied"]["frames"] == "assumed"
    assert record["applied"]["payload_kg"] == {"tProbe": 2.7}


def test_with_tool_and_frame_nothing_is_assumed_and_the_payload_matters(truearm: Truearm, place: Path) -> None:
    shifts = []
    for number, words in enumerate(([], ["--payload", "0kg,0mm,0mm,0mm"], ["--payload", "4kg,0mm,0mm,100mm"])):
        places = ("--tools", place / "cell.yaml", "--frames", place / "cell.yaml")
        result = result_of(truearm, place, *places, *words, out=f"out{number}")
        shifts.append(result["programs"][0]["shift_mm"]["mean"])
        codes = [warning["code"] for warning in result["warnings"]]
        assert not {"frames-assumed", "tools-assumed"} & {*codes}
        assert ("no-payload" in codes) == (number == 1)
    # The frame is half a millimetre beside what the controller has.
    assert 0.5 < shifts[0] < 3.0
    assert len(set(shifts)) == 3


def test_a_robot_without_a_payload_is_asked_for_one_if_it_bends(truearm: Truearm, place: Path) -> None:
    plate(place, ("[2.7,[50,25,100]", "[0.001,[0,0,0.001]"))
    for robot, asked in ((worn().with_payload(Payload()), True), (stiff(), False)):
        (place / "calibrated.yaml").write_text(robot_text(robot))
        result = result_of(truearm, place, out=f"out{asked}")
        assert ("no-payload" in {warning["code"] for warning in result["warnings"]}) == asked


def test_the_report_says_how_to_do_it_again_and_moves_are_split(truearm: Truearm, place: Path) -> None:
    options = ["--tools", str(place / "cell.yaml"), "--payload", "1.5kg,0mm,0mm,80mm", "--split", "0.005"]
    code, words = run(truearm, place, *options)
    assert code == 0
    assert "moves split by" in words
    assert "moves-not-divided" in words
    assert (place / "out" / "plate.mod").read_text().count("MoveC") > 2
    page = (place / "out" / "compensation.html").read_text()
    command = page.partition("How to reproduce this")[2].partition("<pre>")[2].partition("</pre>")[0]
    assert sorted(shlex.split(command)[4:]) == sorted([*options, *ANSWERS, "--out", "DIR"])


def test_corrected_again_and_reverted(truearm: Truearm, place: Path) -> None:
    assert run(truearm, place)[0] == 0
    code, words = run(truearm, place, program="out/plate.mod", out="twice")
    assert code == 2
    assert "corrected already" in words
    assert not (place / "twice").exists()
    assert run(truearm, place, "--again", program="out/plate.mod", out="again")[0] == 0
    assert (place / "again" / "plate.mod").read_bytes() == (place / "out" / "plate.mod").read_bytes()
    code, words = run(truearm, place, "--revert", "--json", program="out/plate.mod", out="back")
    assert code == 0
    assert json.loads(words) == {"reverted": [str(place / "back" / "plate.mod")]}
    assert (place / "back" / "plate.mod").read_bytes() == (place / "plate.mod").read_bytes()
    for other in (["--again"], ["--split", "0"], ["--payload", "1kg,0mm,0mm,0mm"], ["--accept", "rank-loss"]):
        code, words = run(truearm, place, "--revert", *other, program="out/plate.mod", out="back")
        assert code == 2
        assert "only one of them can hold" in words, other


def test_what_cannot_be_corrected_is_listed_and_refused_unless_accepted(truearm: Truearm, place: Path) -> None:
    program = plate(place, ("[[20.0,20.0,0.0]", "[[2000.0,20.0,0.0]"))
    code, words = run(truearm, place)
    assert code == 2
    assert "3 targets cannot be corrected, and the others would move without them" in words
    assert f"{program}, line 9: out of reach of the nominal robot" in words
    assert "with --keep; or accept all of them with --accept skipped." in " ".join(words.split())
    assert not (place / "out").exists()
    code, words = run(truearm, place, "--accept", "skipped", "--details")
    assert code == 0
    assert "plate.mod, line 9: out of reach of the nominal robot" in words
    assert "44 targets: 40 corrected, 1 kept (given by joints), 3 left unchanged" in words
    line = next(text for text in (place / "out" / "plate.mod").read_text().splitlines() if "pHole1:" in text)
    assert "[[2000.0,20.0,0.0]" in line


def test_a_move_on_which_the_posture_changes_is_not_split(truearm: Truearm, place: Path) -> None:
    """No straight move leads from one posture of the wrist to the other, and no number of segments would do."""
    joints = np.radians([[10.0, 20, 10, 30, 50, 20], [15.0, 22, 8, -148, -52, 202]])
    position, rotation = load_robot("irb120").world_poses(joints)
    moves = [
        f"MoveL [[{','.join(f'{1e3 * v:.3f}' for v in p)}],[{','.join(f'{v:.7f}' for v in q)}],[0,{c4},{c6},0],"
        f"{NO_AXES}],v100,z1,tool0;"
        for p, q, (c4, c6) in zip(position, quaternion_from_rotation(rotation), ((0, 0), (-2, 2)), strict=True)
    ]
    module(place, *moves)
    code, words = run(truearm, place, "--split", "0.01", program="m.mod")
    assert code == 0
    assert "2 targets: 2 corrected; moved by" in words
    assert "split by" not in words
    assert "the posture changes on the way" in words
    assert (place / "out" / "m.mod").read_text().count("MoveL") == 2


def test_a_tool_or_frame_that_nobody_defines_is_refused(truearm: Truearm, place: Path) -> None:
    for change, message in (
        (("tProbe:=[TRUE", "tOther:=[TRUE"), "line 7: this tool is used and never defined; got 'tProbe'"),
        (("wobjPlate:=[FALSE", "wobjP:=[FALSE"), "this frame is used and never defined; got 'wobjPlate'. Did you mean"),
    ):
        program = plate(place, change)
        before = program.read_bytes()
        code, words = run(truearm, place)
        assert code == 2
        assert message in words
        assert program.read_bytes() == before
        assert not (place / "out").exists()
    # A frame may come from the file.
    cell(place, "frames:\n  WOBJPLATE: {of: controller, translation: [310, -110, 60]}\n")
    content = result_of(truearm, place, "--frames", place / "cell.yaml")
    assert "frames-assumed" in {warning["code"] for warning in content["warnings"]}


def test_a_program_without_targets_says_so(truearm: Truearm, place: Path) -> None:
    (place / "plate.mod").write_text('MODULE m\n  PROC main()\n    TPWrite "nothing";\n  ENDPROC\nENDMODULE\n')
    result = result_of(truearm, place)
    assert [warning["code"] for warning in result["warnings"]] == ["no-targets", "unproven"]
    shift = result["programs"][0]["shift_mm"]
    assert shift == {"mean": 0.0, "max": 0.0, "common": None, "remainder": None}
    assert (place / "out" / "plate.mod").read_bytes() == (place / "plate.mod").read_bytes()


def test_a_folder_is_no_program(truearm: Truearm, place: Path) -> None:
    for words in ((), ("--revert",)):
        code, output = run(truearm, place, *words, program=".")
        assert code == 2
        assert "this is a folder, a program is needed" in output


def test_what_was_left_or_is_on_an_edge_is_said_with_its_file(truearm: Truearm, place: Path) -> None:
    on_edge = pose(374, 0, 500, "[0,0,1,0],[-1,-1,-1,0]")
    lines = [f"MoveL {on_edge},v100,fine,tool0;", "MoveL pNowhere,v100,fine,tool0;", "GlueOn 5;"]
    text = plate(place, ("ENDMODULE", "\n".join(["PROC edge()", *lines, "ENDPROC", "ENDMODULE"]))).read_text()
    code, words = run(truearm, place, "--accept", "skipped", "--details")
    assert code == 0
    number = next(i for i, line in enumerate(text.splitlines(), 1) if "[374,0,500]" in line)
    assert "Warning (targets-skipped): 1 target was left unchanged, as listed with the reason." in words
    assert "(instructions-unknown): 1 unknown instruction was left alone: GlueOn (1)" in words
    assert "1 target was moved across the edge of a quadrant or turn of the configuration" in words
    assert f"as at 0: plate.mod line {number}. Controllers" in words


def test_the_demo_ends_with_a_corrected_program(demonstrated: Demonstration, tmp_path: Path) -> None:
    shown, out = demonstrated, shutil.copytree(demonstrated.folder, tmp_path / "demo")
    assert shown.correction is not None
    simulated = shown.correction.simulated
    assert simulated is not None
    assert shown.calibration.validation is not None
    assert simulated.corrected.mean() < 1.5 * shown.calibration.validation.position_norms.mean()
    assert simulated.original.mean() > 10 * simulated.corrected.mean()
    page = (out / "corrected" / "compensation.html").read_text()
    assert f"{1e3 * simulated.corrected.mean():.3f}" in page
    assert "Before and after" in page
    # What it wrote itself it writes again; another program of that name stays.
    demo(out)
    shutil.copy(out / "measurements.csv", out / "plate.mod")
    with pytest.raises(ValueError, match="another file of that name"):
        demo(out)


def test_relative_errors_say_what_is_not_in_them(demonstrated: Demonstration, truearm: Truearm, tmp_path: Path) -> None:
    """One of three targets was left unchanged, and nothing said that it now lies off the others."""
    program = module(tmp_path, *(f"MoveL {pose(x, 0, 500)},v100,fine,tool0;" for x in (250, 420, 2000)))
    robot, known = demonstrated.folder / "calibrated.yaml", (*ANSWERS, "--accept", "skipped")
    outcome = truearm("compensate", robot, program, *known, "--out", tmp_path / "out")
    message = " ".join(outcome.out.split())
    assert "2 corrected, 1 left unchanged" in message
    assert "What is left unchanged is not in them" in message
