"""Programs that compute with numbers of their targets: every language's way to read them, and what only looks so."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.answered import compensate
from tests.compensation.workplace import codes, module, pose

from truearm.engine.base.errors import InputError
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.program import Language
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


@pytest.mark.parametrize("language", LANGUAGES, ids=lambda one: one.name)
def test_what_reads_a_place_is_found_and_what_only_looks_so_is_not(language: Language) -> None:
    reads, lines = language.reads, READ[language.name]
    assert (reads is None) == (not lines)
    if reads is None:
        return
    for line, name in lines:
        assert name in [result[1] for result in reads.finditer(line)], line
    for line in NOT_READ[language.name]:
        assert not [result for result in reads.finditer(line) if result[1] not in (None, "p", "tProbe")], line


def test_a_branch_that_the_correction_would_change_is_refused(tmp_path: Path) -> None:
    """A height of 0 mm became 1.453, and the robot plunged by 40 mm where the original never did."""
    arm = load_robot("irb120")
    worn = arm.with_values({"a_3": arm.values["a_3"] + 1e-3, "alpha_4": arm.values["alpha_4"] + 1e-3})
    out, branch = tmp_path / "out", ("IF p2.trans.z>400 THEN", "Stop;", "ENDIF")
    points = tuple(f"CONST robtarget p{k}:={pose(300 + 60 * k, 0, 400)};" for k in (1, 2, 3))
    moves = tuple(f"MoveL p{k},v100,fine,tool0;" for k in (1, 2, 3))
    path = module(tmp_path, *moves, *branch, data=points)
    with pytest.raises(InputError, match=r"computes with numbers of targets.*line 9: p2\.trans\.z\)") as refusal:
        compensate(worn, [path], out=out)
    assert "`accept=numbers-read`" in str(refusal.value)
    assert not out.exists()
    assert codes(compensate(worn, [path], accept=["numbers-read"]))["numbers-read"] == "warning"
    result = compensate(worn, [path], keep=["p2"])
    for honest in (result, compensate(worn, [module(tmp_path, *moves, data=points)])):
        assert "numbers-read" not in codes(honest)
        assert honest.files[0].corrected > 1
