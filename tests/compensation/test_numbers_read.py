"""Programs that compute with numbers of their targets: every language's way to read them, and what only looks so."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.answered import compensate

from truearm.engine.base.errors import InputError
from truearm.engine.programs import LANGUAGES
from truearm.engine.robot.library import load_robot

READ = {
    "RAPID": [
        ("IF pHole2.trans.z>0.5 THEN", "pHole2"),
        ("MoveL Offs(p1,0,0,pRow{2}.trans.z),v10,fine,t;", "pRow"),
        ("rX:=p1 . rot.q1;", "p1"),
    ],
    "KRL": [("IF XB.X>90 THEN", "XB"), ("N=XL[3].C+1", "XL")],
    "URScript": [("if (p2[0] > 0.4):", "p2"), ("movel(pose_trans(p1,p[0,0,p2[2],0,0,0]))", "p2")],
    "FANUC LS": [("   4:  PR[1]=P[2:seam]    ;", "P[2")],
    "VAL3": [("if pHole[1].trsf.z&gt;0.5", "pHole"), ("trX=p1.trsf", "p1")],
    "INFORM": [],
}
NOT_READ = {
    "RAPID": ["p1.trans.z:=5;", "! p1.trans.z", 'TPWrite "p1.trans";', "p1.robconf.cf1", "tProbe.tframe.trans.z:=1;"],
    "KRL": ["XB.X=90", "; XB.X", "XB.S=2", "XB={X 1,Y 2}"],
    "URScript": ["p2[0]=0.4", "# p2[0]", "movel(p[1, 2, 3, 0, 0, 0])", "p2[6]"],
    "FANUC LS": ["   4:L P[2] 100mm/sec FINE    ;", "   4:  !PR[1]=P[2]    ;", "   4:  P[2]=PR[1]    ;"],
    "VAL3": ["p1.trsf.z=5", "// p1.trsf", "p1.config"],
    "INFORM": [],
}


def test_every_language_is_tried() -> None:
    assert {one.name for one in LANGUAGES} == READ.keys() == NOT_READ.keys()
    assert {one.name for one in LANGUAGES if one.reads is None} == {name for name, lines in READ.items() if not lines}


@pytest.mark.parametrize(("language", "line", "name"), [(k, *one) for k, lines in READ.items() for one in lines])
def test_what_reads_a_place_is_found(language: str, line: str, name: str) -> None:
    (reads,) = [one.reads for one in LANGUAGES if one.name == language]
    assert reads is not None
    assert name in [found[1] for found in reads.finditer(line)]


@pytest.mark.parametrize(("language", "line"), [(k, line) for k, lines in NOT_READ.items() for line in lines])
def test_what_only_looks_so_is_not(language: str, line: str) -> None:
    (reads,) = [one.reads for one in LANGUAGES if one.name == language]
    assert reads is not None
    assert not [found[1] for found in reads.finditer(line) if found[1] not in (None, "p", "tProbe")]


POSE = "[[{x},0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def test_a_branch_that_the_correction_would_change_is_refused(tmp_path: Path) -> None:
    """A height of 0 mm became 1.453, and the robot plunged by 40 mm where the original never did."""
    arm = load_robot("irb120")
    worn = arm.with_values({"a_3": arm.values["a_3"] + 1e-3, "alpha_4": arm.values["alpha_4"] + 1e-3})
    path, out = tmp_path / "m.mod", tmp_path / "out"
    points = "".join(f"  CONST robtarget p{k}:={POSE.format(x=300 + 60 * k)};\n" for k in (1, 2, 3))
    moves = "".join(f"    MoveL p{k},v100,fine,tool0;\n" for k in (1, 2, 3))
    branch = "    IF p2.trans.z>400 THEN\n      Stop;\n    ENDIF\n"
    path.write_text(f"MODULE m\n{points}  PROC main()\n{moves}{branch}  ENDPROC\nENDMODULE\n")
    with pytest.raises(InputError, match=r"computes with numbers of targets.*line 9: p2\.trans\.z\)") as refusal:
        compensate(worn, [path], out=out)
    assert "`accept=numbers-read`" in str(refusal.value)
    assert not out.exists()
    accepted = compensate(worn, [path], accept=["numbers-read"])
    assert [one.level for one in accepted.warnings if one.code == "numbers-read"] == ["warning"]
    for honest in (compensate(worn, [path], keep=["p2"]), compensate(worn, [_without(path, branch)])):
        assert "numbers-read" not in {one.code for one in honest.warnings}
        assert honest.files[0].corrected > 1


def _without(path: Path, text: str) -> Path:
    other = path.with_name("other.mod")
    other.write_text(path.read_text().replace(text, ""))
    return other
