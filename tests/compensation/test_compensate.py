"""``truearm compensate``: its contract, its files, its refusals."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.answered import ANSWERS
from tests.commanding import Truearm
from tests.plate import PLATE
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
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
def cell(tmp_path: Path) -> Path:
    """A folder with a calibrated robot, the plate's program and a file of its tool and frame."""
    (tmp_path / "calibrated.yaml").write_text(robot_text(worn()))
    (tmp_path / "plate.mod").write_text(PLATE)
    (tmp_path / "cell.yaml").write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        "tools:\n  tProbe: {of: flange, translation: [0.2, 0, 125]}\n"
        "frames:\n  wobjPlate: {of: base, translation: [310.5, -110, 60]}\n"
    )
    return tmp_path


def run(truearm: Truearm, cell: Path, *words: object, program: str = "plate.mod", out: str = "out") -> tuple[int, str]:
    answers = () if "--revert" in words else ANSWERS
    done = truearm("compensate", cell / "calibrated.yaml", cell / program, "--out", cell / out, *answers, *words)
    return done.code, done.out + done.err


def test_the_contract(truearm: Truearm, cell: Path) -> None:
    code, said = run(truearm, cell, "--json")
    assert code == 0
    told = json.loads(said)
    assert set(told) == {"programs", "expected_is_lower_bound", "expected_is_relative", "warnings"}
    (program,) = told["programs"]
    assert set(program) == {
        "file",
        "language",
        "targets",
        "corrected",
        "kept",
        "skipped",
        "shift_mm",
        "expected_mm",
        "not_better",
    }
    assert (program["file"], program["language"]) == ("plate.mod", "RAPID")
    assert (program["targets"], program["corrected"], program["kept"]) == (44, 43, {"given by joints": 1})
    assert 0.05 < program["shift_mm"]["mean"] < program["shift_mm"]["max"] < 3.0
    assert {warning["code"] for warning in told["warnings"]} == {
        "unproven",
        "frames-assumed",
        "tools-assumed",
        "joint-targets-kept",
        "loads-taken",
    }
    assert sorted(p.name for p in (cell / "out").iterdir()) == [
        "compensation.html",
        "plate.mod",
        "plate.mod.truearm.json",
        "truearm.manifest.json",
    ]
    record = json.loads((cell / "out" / "plate.mod.truearm.json").read_text())
    assert record["applied"]["frames"] == "assumed"
    assert record["applied"]["payload_kg"] == {"tProbe": 2.7}


def test_without_the_answers_nothing_is_written(truearm: Truearm, cell: Path) -> None:
    done = truearm("compensate", cell / "calibrated.yaml", cell / "plate.mod", "--out", cell / "out")
    assert (done.code, done.out) == (2, "")
    said = " ".join(done.err.split())
    assert "--taught, --controller-kinematics: nothing is corrected before this is answered" in said
    for answer in ("--taught none", "taught: [none]", "--controller-kinematics nominal", "controller_kinematics: no"):
        assert answer in said
    assert not (cell / "out").exists()
    (cell / "answers.yaml").write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\ntaught: [none]\ncontroller_kinematics: nominal\n"
    )
    words = ("--frames", cell / "answers.yaml", "--out", cell / "out")
    assert truearm("compensate", cell / "calibrated.yaml", cell / "plate.mod", *words).code == 0


def test_with_tool_and_frame_nothing_is_assumed(truearm: Truearm, cell: Path) -> None:
    places = ["--tools", cell / "cell.yaml", "--frames", cell / "cell.yaml"]
    code, said = run(truearm, cell, *places, "--controller-kinematics", "nominal", "--json")
    assert code == 0
    told = json.loads(said)
    assert [w["code"] for w in told["warnings"]] == [
        "loads-taken",
        "unproven",
        "joint-targets-kept",
    ]
    # The frame is half a millimetre beside what the controller has.
    assert 0.5 < told["programs"][0]["shift_mm"]["mean"] < 3.0


def test_a_robot_without_a_payload_is_asked_for_one_if_it_bends(truearm: Truearm, cell: Path) -> None:
    for robot, asked in ((worn().with_payload(Payload()), True), (stiff(), False)):
        (cell / "calibrated.yaml").write_text(robot_text(robot))
        program = cell / "plate.mod"
        program.write_text(program.read_text().replace("[2.7,[50,25,100]", "[0.001,[0,0,0.001]"))
        code, said = run(truearm, cell, "--json", out=f"out{asked}")
        assert code == 0
        assert ("no-payload" in {warning["code"] for warning in json.loads(said)["warnings"]}) == asked


def test_the_report_says_how_to_do_it_again(truearm: Truearm, cell: Path) -> None:
    options = ["--tools", str(cell / "cell.yaml"), "--payload", "1.5kg,0mm,0mm,80mm", "--split", "0.05"]
    code, _ = run(truearm, cell, *options)
    assert code == 0
    page = (cell / "out" / "compensation.html").read_text()
    command = page.partition("How to reproduce this")[2].partition("<pre>")[2].partition("</pre>")[0]
    assert sorted(shlex.split(command)[4:]) == sorted([*options, *ANSWERS, "--out", "DIR"])


def test_the_payload_matters(truearm: Truearm, cell: Path) -> None:
    shifts = []
    for number, words in enumerate(([], ["--payload", "0kg,0mm,0mm,0mm"], ["--payload", "4kg,0mm,0mm,100mm"])):
        options = ("--tools", cell / "cell.yaml", "--frames", cell / "cell.yaml", "--json")
        code, said = run(truearm, cell, *options, *words, out=f"out{number}")
        assert code == 0
        shifts.append(json.loads(said)["programs"][0]["shift_mm"]["mean"])
        assert ("no-payload" in said) == (number == 1)
    assert len(set(shifts)) == 3


def test_corrected_again_and_reverted(truearm: Truearm, cell: Path) -> None:
    assert run(truearm, cell)[0] == 0
    code, said = run(truearm, cell, program="out/plate.mod", out="twice")
    assert code == 2
    assert "corrected already" in said
    assert not (cell / "twice").exists()
    code, _ = run(truearm, cell, "--again", program="out/plate.mod", out="again")
    assert code == 0
    assert (cell / "again" / "plate.mod").read_bytes() == (cell / "out" / "plate.mod").read_bytes()
    code, said = run(truearm, cell, "--revert", "--json", program="out/plate.mod", out="back")
    assert code == 0
    assert json.loads(said) == {"reverted": [str(cell / "back" / "plate.mod")]}
    assert (cell / "back" / "plate.mod").read_bytes() == (cell / "plate.mod").read_bytes()
    for other in (["--again"], ["--split", "0"], ["--payload", "1kg,0mm,0mm,0mm"]):
        code, said = run(truearm, cell, "--revert", *other, program="out/plate.mod", out="back")
        assert code == 2
        assert "only one of them can hold" in said


def test_what_cannot_be_corrected_is_listed_and_refused_unless_accepted(truearm: Truearm, cell: Path) -> None:
    program = cell / "plate.mod"
    program.write_text(program.read_text().replace("[[20.0,20.0,0.0]", "[[2000.0,20.0,0.0]"))
    code, said = run(truearm, cell)
    assert code == 2
    assert "3 targets cannot be corrected, and the others would move without them" in said
    assert f"{program}, line 9: out of reach of the nominal robot" in said
    assert "with --keep; or accept all of them with --accept skipped." in " ".join(said.split())
    assert not (cell / "out").exists()
    code, said = run(truearm, cell, "--accept", "skipped", "--details")
    assert code == 0
    assert "plate.mod, line 9: out of reach of the nominal robot" in said
    assert "44 targets: 40 corrected, 1 kept (given by joints), 3 left unchanged" in said
    line = next(text for text in (cell / "out" / "plate.mod").read_text().splitlines() if "pHole1:" in text)
    assert "[[2000.0,20.0,0.0]" in line


def test_moves_are_split(truearm: Truearm, cell: Path) -> None:
    code, said = run(truearm, cell, "--split", "0.005")
    assert code == 0
    assert "moves split by" in said
    assert "moves-not-divided" in said
    text = (cell / "out" / "plate.mod").read_text()
    assert text.count("MoveC") > 2


def test_a_move_on_which_the_posture_changes_is_not_split(truearm: Truearm, cell: Path) -> None:
    """No straight move leads from one posture of the wrist to the other, and no number of segments would do."""
    joints = np.radians([[10.0, 20, 10, 30, 50, 20], [15.0, 22, 8, -148, -52, 202]])
    position, rotation = load_robot("irb120").world_poses(joints)
    configurations = ((0, 0), (-2, 2))
    moves = [
        f"    MoveL [[{','.join(f'{1e3 * v:.3f}' for v in p)}],[{','.join(f'{v:.7f}' for v in q)}],[0,{c4},{c6},0],"
        "[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;"
        for p, q, (c4, c6) in zip(position, quaternion_from_rotation(rotation), configurations, strict=True)
    ]
    (cell / "turn.mod").write_text("\n".join(["MODULE Turn", "  PROC main()", *moves, "  ENDPROC", "ENDMODULE", ""]))
    code, said = run(truearm, cell, "--split", "0.01", program="turn.mod")
    assert code == 0
    assert "2 targets: 2 corrected; moved by" in said
    assert "split by" not in said
    assert "the posture changes on the way" in said
    assert (cell / "out" / "turn.mod").read_text().count("MoveL") == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("tProbe:=[TRUE", "tOther:=[TRUE"), "line 7: this tool is used and never defined; got 'tProbe'"),
        (("wobjPlate:=[FALSE", "wobjP:=[FALSE"), "this frame is used and never defined; got 'wobjPlate'. Did you mean"),
        (("[-0.069237,", "[-0.169237,"), "plate.mod, line 8"),
        (("ENDMODULE", ""), "plate.mod"),
    ],
)
def test_a_faulty_program_is_refused(truearm: Truearm, cell: Path, change: tuple[str, str], said: str) -> None:
    program = cell / "plate.mod"
    program.write_text(program.read_text().replace(*change))
    before = program.read_bytes()
    code, words = run(truearm, cell)
    assert code == 2
    assert said in words
    assert "Traceback" not in words
    assert program.read_bytes() == before
    assert not (cell / "out").exists()


def test_a_frame_that_the_program_does_not_define_may_come_from_the_file(truearm: Truearm, cell: Path) -> None:
    program = cell / "plate.mod"
    program.write_text(program.read_text().replace("PERS wobjdata wobjPlate", "PERS wobjdata wobjElsewhere"))
    (cell / "cell.yaml").write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        "frames:\n  WOBJPLATE: {of: controller, translation: [310, -110, 60]}\n"
    )
    code, said = run(truearm, cell, "--frames", cell / "cell.yaml", "--json")
    assert code == 0
    assert "frames-assumed" in {warning["code"] for warning in json.loads(said)["warnings"]}


def test_real_places_are_given_for_all_frames_or_for_none(truearm: Truearm, cell: Path) -> None:
    program = cell / "plate.mod"
    text = program.read_text().replace("pHole7,v20,fine,tProbe\\WObj:=wobjPlate", "pHole7,v20,fine,tProbe")
    text = text.replace("Offs(pHole7,0,0,15),v200,z5,tProbe\\WObj:=wobjPlate", "Offs(pHole7,0,0,15),v200,z5,tProbe")
    program.write_text(text)
    code, said = run(truearm, cell, "--frames", cell / "cell.yaml")
    assert code == 2
    assert "line 15: only some of the frames in use have a real place in the file; got 'base'" in said


def test_a_program_without_targets_says_so(truearm: Truearm, cell: Path) -> None:
    (cell / "plate.mod").write_text('MODULE m\n  PROC main()\n    TPWrite "nothing";\n  ENDPROC\nENDMODULE\n')
    code, said = run(truearm, cell, "--json")
    assert code == 0
    told = json.loads(said)
    assert [warning["code"] for warning in told["warnings"]] == ["no-targets", "unproven"]
    assert told["programs"][0]["shift_mm"] == {"mean": 0.0, "max": 0.0, "common": None, "remainder": None}
    assert (cell / "out" / "plate.mod").read_bytes() == (cell / "plate.mod").read_bytes()


def test_one_joint_target_alone_has_nothing_left_to_correct(truearm: Truearm, cell: Path) -> None:
    (cell / "plate.mod").write_text(
        "MODULE m\n  CONST jointtarget j:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
        "  PROC main()\n    MoveAbsJ j,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    )
    code, said = run(truearm, cell, "--joint-targets", "correct")
    assert code == 0
    assert "\nWarning (nothing-corrected): Nothing can be corrected: only one target is left to correct" in said
    assert said.splitlines()[0] == "plate.mod  RAPID: the error to expect is not known"
    assert "1 target: 0 corrected, 1 kept (alone, with --frames not given)" in said
    assert (cell / "out" / "plate.mod").read_bytes() == (cell / "plate.mod").read_bytes()


@pytest.mark.parametrize(("kind", "name"), [("tool", "tProbe"), ("frame", "wobjPlate")])
def test_a_file_without_the_tools_or_frames_in_use_is_refused(
    truearm: Truearm, cell: Path, kind: str, name: str
) -> None:
    """Else what was measured would count for nothing because of a slip in a name."""
    file = cell / "cell.yaml"
    file.write_text(file.read_text().replace(name, "Elsewhere"))
    code, said = run(truearm, cell, f"--{kind}", file)
    assert code == 2
    assert f"no {kind} that the programs use is in the file; got 'elsewhere'; allowed: {name}." in said
    assert not (cell / "out").exists()


@pytest.mark.parametrize("words", [(), ("--revert",)])
def test_a_folder_is_no_program(truearm: Truearm, cell: Path, words: tuple[str, ...]) -> None:
    for folder in (".", cell):
        done = truearm("compensate", cell / "calibrated.yaml", folder, "--out", cell / "out", *words)
        assert done.code == 2
        assert "this is a folder, a program is needed. Name the files in it." in done.err


def test_what_was_left_or_is_on_an_edge_is_said_with_its_file(truearm: Truearm, cell: Path) -> None:
    program = cell / "plate.mod"
    lines = [
        "  PROC edge()",
        "    MoveL [[374,0,500],[0,0,1,0],[-1,-1,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;",
        "    MoveL pNowhere,v100,fine,tool0;",
        "  ENDPROC",
        "ENDMODULE",
    ]
    text = program.read_text().replace("ENDMODULE", "\n".join(lines))
    program.write_text(text)
    code, said = run(truearm, cell, "--accept", "skipped", "--details")
    assert code == 0
    number = next(i for i, line in enumerate(text.splitlines(), 1) if "[374,0,500]" in line)
    assert "Warning (targets-skipped): 1 target was left unchanged, as listed with the reason." in said
    assert "1 target was moved across the edge of a quadrant or turn of the configuration" in said
    assert f"as at 0: plate.mod line {number}. Controllers" in said


def test_a_robot_that_is_not_calibrated_is_refused(truearm: Truearm, cell: Path) -> None:
    done = truearm("compensate", "irb120", cell / "plate.mod", *ANSWERS, "--out", cell / "out")
    assert done.code == 2
    assert "not calibrated" in done.err


def test_two_programs_of_one_name_keep_their_folders(truearm: Truearm, cell: Path) -> None:
    paths = [cell / folder / "p.ls" for folder in ("one", "two")]
    for path in paths:
        path.parent.mkdir()
        path.write_text(LS)
    words = ("--accept", "maker", "--accept", "skipped", "--out", cell / "out", "--json")
    done = truearm("compensate", cell / "calibrated.yaml", *paths, *ANSWERS, *words)
    assert done.code == 0
    assert [file["file"] for file in json.loads(done.out)["programs"]] == ["one/p.ls", "two/p.ls"]
    assert (cell / "out" / "two" / "p.ls.truearm.json").exists()


LS = """\
/PROG  PLATE
/ATTR
/MN
   1:J P[1] 20% FINE    ;
   2:L P[2] 100mm/sec FINE    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   400.000  mm,\tY =    20.000  mm,\tZ =   350.000  mm,
\tW =   180.000 deg,\tP =   -60.000 deg,\tR =   180.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   400.000  mm,\tY =    80.000  mm,\tZ =   330.000  mm,
\tW =   180.000 deg,\tP =   -60.000 deg,\tR =   180.000 deg
};
/END
"""


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
    head = "MODULE m\n  PROC main()\n"
    lines = [
        f"    MoveL [[{x},0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n"
        for x in (250, 420, 2000)
    ]
    (tmp_path / "m.mod").write_text(f"{head}{''.join(lines)}  ENDPROC\nENDMODULE\n")
    robot, known = demonstrated.folder / "calibrated.yaml", (*ANSWERS, "--accept", "skipped")
    done = truearm("compensate", robot, tmp_path / "m.mod", *known, "--out", tmp_path / "out")
    said = " ".join(done.out.split())
    assert "2 corrected, 1 left unchanged" in said
    assert "What is left unchanged is not in them" in said


def test_a_fit_that_lost_rank_is_accepted_by_name(truearm: Truearm, cell: Path) -> None:
    made = calibrate("irb120", campaign("irb120", 3, 2e-5, 1)[1], model="geometric", train="all")
    (cell / "calibrated.yaml").write_text(robot_text(made.robot))
    code, said = run(truearm, cell)
    assert code == 2
    assert "got 'rank-loss'" in said
    assert "give --accept rank-loss" in " ".join(said.split())
    assert not (cell / "out").exists()
    code, said = run(truearm, cell, "--accept", "rank-lost")
    assert code == 2
    assert "--accept: there is no status or notice of this name" in " ".join(said.split())
    code, said = run(truearm, cell, "--accept", "rank-loss", "--accept", "not-better-here")
    assert code == 0
    assert "Warning (rank-loss)" in said
    assert "compensate" in (cell / "out" / "compensation.html").read_text()
    assert "--accept rank-loss --accept not-better-here" in (cell / "out" / "compensation.html").read_text()


def test_accept_does_not_go_with_revert(truearm: Truearm, cell: Path) -> None:
    code, said = run(truearm, cell, "--revert", "--accept", "rank-loss")
    assert code == 2
    assert "--accept" in said
