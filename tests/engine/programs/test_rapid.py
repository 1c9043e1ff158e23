"""RAPID: every target of programs in the syntax of ABB's manuals, found where it stands, and nothing else.

The sample programs are ours. Their syntax is that of the sections on MoveAbsJ, MoveC, MoveExtJ, MoveJ, MoveL, MoveLDO,
SearchL, TriggL, Offs, RelTool, confdata, jointtarget, robtarget, tooldata and wobjdata of ABB's "Technical reference
manual, RAPID Instructions, Functions and Data types" (3HAC050917-001), of "RAPID Kernel" (3HAC050946-001), and of the
application manual "Arc and Arc Sensor" for ArcL, ArcLStart and ArcCEnd, as public programs and code that quotes the
manuals have them.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.programs.reading import branches, said, sample, split

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import ANY_POSTURE, Program, Source, Split
from truearm.engine.programs.rapid import RAPID
from truearm.engine.programs.rapid.data import configuration
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform

NO_AXES = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"
DOWN = (0.0, 0.7071068, 0.7071068, 0.0)
PEN = "PERS tooldata tPen:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];"
TABLE = 'PERS wobjdata wTable:=[FALSE,TRUE,"",[[300,0,50],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'


def pose(x: float = 300, y: float = 0, z: float = 200, rest: str = f"[0,0,1,0],[0,0,0,0],{NO_AXES}") -> str:
    return f"[[{x},{y},{z}],{rest}]"


def read(body: str, data: str = "") -> Program:
    """Read a module with one routine, in which the first line of `body` is line 6."""
    text = f"MODULE One\n{PEN}\n{TABLE}\n{' '.join(data.splitlines())}\nPROC main()\n{body}\nENDPROC\nENDMODULE\n"
    return RAPID.read([Source(Path("one.mod"), text)])


def quadrants(*numbers: int) -> tuple[tuple[int, float, float], ...]:
    return tuple((joint, k * pi / 2, (k + 1) * pi / 2) for joint, k in zip((1, 4, 6), numbers, strict=True))


@pytest.fixture(scope="module")
def polish() -> Program:
    return sample(RAPID, "polish.mod")


def test_every_target_of_a_program_is_found(polish: Program) -> None:
    found = [(t.line, t.name, t.form.name, t.values, t.tool, t.frame, t.parent, t.turned) for t in polish.targets]
    disc = ("tDisc", "wCover")
    assert found == [
        (19, "jHome", "jointtarget", (0.0, -20.5, 25.0, 0.0, 60.0, -15.0), "tDisc", "", None, False),
        (21, "p10", "robtarget", (60.125, -14.0, 12.0, *DOWN), *disc, None, False),
        (22, "p20", "robtarget", (61.5, 4.75, 12.0, 0.0087265, 0.7071068, 0.7070529, 0.0), *disc, None, False),
        (26, "pRow{1}", "robtarget", (0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0), *disc, None, False),
        (27, "pRow{2}", "robtarget", (0.0, 10.0, 5.0, 0.0, 1.0, 0.0, 0.0), *disc, None, False),
        (28, "pRow{3}", "robtarget", (0.0, 20.0, 5.0, 0.0, 1.0, 0.0, 0.0), *disc, None, False),
        (31, "pGrid{2,1}", "robtarget", (0.0, 5.0, 40.0, 0.0, 1.0, 0.0, 0.0), *disc, None, False),
        (47, "", "robtarget", (62.0, 10.0, 12.0, *DOWN), *disc, None, False),
        (50, "", "Offs", (0.0, 0.0, -2.5), *disc, 1, False),
        (51, "", "RelTool", (0.0, 0.5, -30.0, 0.0, 0.0, 12.5), *disc, 2, True),
        (52, "", "Offs", (1.0, 2.0, 3.0), *disc, 1, False),
        (52, "", "RelTool", (4.0, 5.0, 6.0, 1.0, -2.0, 0.0), *disc, 10, True),
        (54, "", "robtarget", (300.0, 0.0, 400.0, 0.0, 0.0, 1.0, 0.0), "", "", None, False),
        (73, "", "jointtarget", (10.0, 0.0, 0.0, 0.0, 30.0, -720.25), "tDisc", "", None, False),
        (86, "p10", "robtarget", (1.5, 2.5, 3.5, 1.0, 0.0, 0.0, 0.0), *disc, None, False),
    ]


def test_the_configuration_data_say_which_postures_are_meant(polish: Program) -> None:
    (source,) = polish.sources
    looked_at = RAPID.read([Source(source.path, source.text.replace("ConfL \\Off", "ConfL \\On "))])
    assert looked_at.targets[1].configuration.ranges == quadrants(0, -1, -2)
    assert looked_at.targets[1].configuration.elbow == "up"
    assert looked_at.targets[2].configuration.ranges == quadrants(-1, 0, 1)
    assert looked_at.targets[2].configuration.elbow == "down"
    assert looked_at.targets[0].configuration.ranges == ()
    assert {t.configuration.wrist or t.configuration.shoulder for t in looked_at.targets} == {None}


def test_the_configuration_data_are_free_where_the_controller_does_not_look_at_them(polish: Program) -> None:
    """ConfL Off frees what lines alone go to; p10 is also the target of a MoveJ."""
    assert polish.targets[1].configuration.ranges == quadrants(0, -1, -2)
    assert polish.targets[2].configuration == ANY_POSTURE
    line, joint = (f"Move{word} {pose(rest=f'[0,0,1,0],[0,-1,1,0],{NO_AXES}')},v9,fine,tool0;" for word in "LJ")
    lines = [line, "! ConfJ \\Off;", joint, "ConfJ\\Off; confl \\off;", joint, line, "ConfL\\On;", line, joint]
    free = [target.configuration == ANY_POSTURE for target in read("\n".join(lines)).targets]
    assert free == [False, False, True, True, False, True]


def test_every_move_is_found(polish: Program) -> None:
    """What stands before a move is known only where no call, loop, IF, TEST or the like comes between."""
    text = polish.sources[0].text
    assert [(m.kind, m.line, m.target, m.via, m.routine, text[slice(*m.target_text)]) for m in polish.moves] == [
        ("joint", 44, 0, None, 0, ""),
        ("joint", 45, 1, None, 0, ""),
        ("linear", 46, 2, None, 0, "p20"),
        ("circular", 47, 1, 7, 0, "p10"),
        ("linear", 50, 8, None, 1, "Offs(p10,0,0,-2.5)"),
        ("linear", 51, 9, None, 1, "RelTool (p20, 0, 0.5, -30 \\Rz:=12.5)"),
        ("linear", 52, 11, None, 1, ""),
        ("linear", 53, 1, None, 2, ""),
        ("linear", 54, 12, None, 3, ""),
        ("linear", 55, 1, None, 4, ""),
        ("linear", 59, 6, None, 5, "pGrid{2,1}"),
        ("linear", 62, 2, None, 6, ""),
        ("linear", 64, 2, None, 7, ""),
        ("joint", 73, 13, None, 8, ""),
        ("joint", 81, 1, None, 9, ""),
        ("linear", 87, 14, None, 10, ""),
    ]
    statement, _, via = said(polish, 3)
    assert via.startswith("[[62,10,12],")
    assert statement.startswith(f"MoveC {via}")
    assert statement.endswith("\\WObj:=wCover;")


def test_tools_and_frames_of_the_program_are_known(polish: Program) -> None:
    # tStand is not held by the robot, wTable and wPart move. The user frame of wCover is turned by 90 deg about z.
    assert list(polish.tools) == ["tDisc"]
    assert polish.tools["tDisc"].translation == (-0.0125, 0.00025, 0.11875)
    assert_allclose(polish.tools["tDisc"].quaternion, (np.cos(pi / 12), 0, np.sin(pi / 12), 0), rtol=0, atol=1e-7)
    assert list(polish.frames) == ["wCover"]
    cover = polish.frames["wCover"]
    assert_allclose(cover.translation, (0.330, -0.050, 0.0805), rtol=0, atol=1e-15)
    assert_allclose(cover.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], rtol=0, atol=1e-15)


def test_what_is_left_as_it_is_says_why(polish: Program) -> None:
    reasons = {skip.line: skip.reason for skip in polish.skipped}
    parts = {
        20: "jTrack does not say where all joints",
        29: "pGrid{1,1} is used by no move",
        30: "pGrid{1,2} is used by no move",
        32: "pGrid{2,2} is used by no move",
        33: "pFound has no numbers in the program",
        34: "pShift gets its numbers while the program runs, in line 89",
        35: "pMixed has nX in place of numbers",
        36: "pBoth is used with more than one tool or work object",
        37: "tStand, which is not held by the robot",
        38: "wTable, which is moved by another mechanical unit",
        39: "pSpare is used by no move",
        71: "not declared in this program: pElsewhere",
        72: "is computed",
        94: "is a parameter of the routine: pGiven",
    }
    assert len(polish.skipped) == len(reasons)
    assert reasons.keys() == parts.keys()
    assert [line for line, part in parts.items() if part not in reasons[line]] == []
    assert polish.unknown == {"GlueOn": 2}


def test_several_modules_are_one_program() -> None:
    program = sample(RAPID, "cell/MainModule.mod", "cell/Data.sys")
    assert [(t.source, t.line, t.name) for t in program.targets] == [
        (0, 2, "pUp"), (1, 4, "pSeam10"), (1, 5, "pSeam20"), (1, 6, "pSeam30"), (1, 7, "pSeam40"), (1, 8, "pUp"),
    ]  # fmt: skip
    assert {(t.tool, t.frame) for t in program.targets} == {("tTorch", "wFixture")}
    assert [(m.kind, m.source, m.line, m.target, m.via, m.routine) for m in program.moves] == [
        ("joint", 0, 5, 0, None, 0), ("linear", 0, 6, 1, None, 0), ("linear", 0, 7, 2, None, 0),
        ("circular", 0, 8, 4, 3, 0), ("linear", 0, 11, 0, None, 1), ("joint", 1, 16, 5, None, 2),
    ]  # fmt: skip
    assert program.frames["wFixture"] == Transform((0.28, -0.15, 0.0725))
    assert not program.skipped
    assert not program.unknown


def test_a_file_alone_does_not_know_the_names_of_the_other() -> None:
    program = sample(RAPID, "cell/MainModule.mod")
    assert [(t.name, t.tool) for t in program.targets] == [("pUp", "tTorch")]
    assert not program.tools
    assert [skip.line for skip in program.skipped] == [6, 7, 8, 8]


def test_names_do_not_depend_on_their_case_and_those_of_elsewhere_stay() -> None:
    program = read(
        f"again: movej P1,v100,fine,TPEN\\wobj:=WTABLE;\nMoveL {pose()},v100,fine,Tool0\\WObj:=WOBJ0;\n"
        f"MoveL {pose()},v100,fine,tFar\\WObj:=wFar;\nMoveL {pose()},v100,fine,TFAR\\WObj:=WFAR;",
        f"const Robtarget p1:={pose()};",
    )
    far = ("", "tFar", "wFar")
    assert [(t.name, t.tool, t.frame) for t in program.targets] == [("p1", "tPen", "wTable"), ("", "", ""), far, far]


def test_each_instruction_has_its_arguments_in_its_own_places() -> None:
    for instruction, kind in (
        ('MoveJSync {},v100,z5,tPen,"act";', "joint"),
        ("MoveLDO {},v100,z5,tPen\\WObj:=wTable,do1,1;", "linear"),
        ("TriggJ {},v100,tr1\\T2:=tr2,z5,tPen;", "joint"),
        ("TriggLIOs {},v100\\TriggData1:=a{*},z5,tPen;", "linear"),
        ("TriggC {},{},v100,tr1,z5,tPen;", "circular"),
        ("SearchL \\Stop,di1\\Flanks,pHit,{},v100,tPen;", "linear"),
        ("SearchC di1,pHit,{},{},v100,tPen;", "circular"),
        ("ArcC1 {},{},v100,sm1,wd1\\Weave:=wv1,z1,tPen\\Track:=tr1;", "circular"),
        ("SpotL {},vmax,gun1,spot10,tPen;", "linear"),
        ("DispL \\On,{},v250,bead1,z30,tPen;", "linear"),
    ):
        program = read(instruction.replace("{}", pose(7), 1).replace("{}", pose(9)))
        (move,) = program.moves
        assert move.kind == kind, instruction
        assert program.targets[move.target].values[0] == (9 if kind == "circular" else 7), instruction
        assert (move.via is None) == (kind != "circular"), instruction
        assert {t.tool for t in program.targets} == {"tPen"}, instruction
        assert not program.skipped, instruction
        assert not program.unknown, instruction


P1 = f"CONST robtarget p1:={pose()};"
PERS_P1 = f"PERS robtarget p1:={pose()};"
ROW = f"CONST robtarget p1{{1}}:=[{pose()}];"
TO_P1 = "MoveL p1,v1,fine,tPen;"
TO = f"MoveL {pose()},v1,fine"
HELD = 'PERS wobjdata wHeld:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'


def test_what_cannot_be_corrected_is_skipped() -> None:
    for body, data, line, part in (
        (TO_P1, "", 6, "not declared in this program: p1"),
        ("MoveL *,v1,fine,tPen;", "", 6, "not written in the text"),
        (TO_P1, "CONST jointtarget p1:=[[0,0,0,0,0,0],[0,0,0,0,0,0]];", 6, "is no robtarget: p1"),
        (TO_P1, ROW, 6, "p1 is an array"),
        ("MoveL p1{1},v1,fine,tPen;", P1, 6, "p1 is no array"),
        ("MoveL p1{2},v1,fine,tPen;", ROW, 6, "not declared in this program: p1{"),
        (TO_P1, f"{P1} CONST robtarget P1:={pose()};", 4, "more than once"),
        (TO_P1, "CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0]];", 4, "missing or computed"),
        (TO_P1, f"CONST robtarget p1:={pose(rest='[-q,0,0,0],[0,0,0,0],x')};", 4, "has q in place"),
        (f"p1.trans.x:=3; {TO_P1}", PERS_P1, 4, "program runs, in line 6"),
        (f"IF a p1:=b; {TO_P1}", PERS_P1, 4, "program runs, in line 6"),
        ("MoveL p1{1},v1,fine,tPen;", ROW.replace("p1{1}", "p1{3}"), 4, "missing or computed"),
        ("MoveL Offs(p1,1),v1,fine,tPen;", P1, 6, "is computed"),
        (f"MoveL {'Offs(' * 99}p1{',1,2,3)' * 99},v1,fine,tPen;", P1, 6, "is computed"),
        (f"Incr p1.trans.x; {TO_P1}", PERS_P1, 4, "while the program runs"),
        ("SearchL d,p1,p1,v1,tPen;", PERS_P1, 4, "while the program runs"),
        (f"{TO},tools{{i}};", "", 6, "a tool that is computed"),
        (f"{TO},tPen\\WObj:=Best();", "", 6, "a work object that is computed"),
        (f"{TO},wTable;", "", 6, "wTable, which is no tool"),
        (f"{TO},tA;", "PERS tooldata tA; LOCAL PERS tooldata tA;", 6, "declared more than once"),
        (f"{TO},tPen\\WObj:=wHeld;", HELD, 6, "wHeld, which is held by the robot"),
        ("MoveL Offs(p1,1,2,3),v1,fine,tPen; MoveL p1,v1,fine,tool0;", P1, 6, "an offset"),
        (f"MoveL {pose()},v1;", "", 6, "too few arguments"),
        (f"PDispSet f; {TO},tPen;", "", 6, "may be displaced by the program, which"),
        (f"CutL {pose()},v1,c1,fine,tPen;", "", 6, "CutL is an instruction that is not known"),
        ("CutL p1,v1,c1,fine,tPen;", P1, 4, "is used by CutL, which is not known"),
        (f"main {pose()};", "", 6, "main is a routine of the program"),
        ("", f"CONST station s1:=[{pose()},3];", 4, "s1 is of type station"),
        ("", P1, 4, "is used by no move of the program"),
        (f"{TO},tPen; {TO},tool0;", P1, 4, "not known which tool and work object"),
        ("MoveAbsJ p1,v1,fine,tPen;", f"CONST jointtarget p1:=[[0,0,0,0,0,9E9],{NO_AXES}];", 4, "not say where all"),
        (f"MoveAbsJ [[0,0,0],{NO_AXES}],v1,fine,tPen;", "", 6, "missing or computed"),
        (TO_P1, P1.replace("9E+09", "500", 1), 4, "an external axis that is not at zero"),
        (TO_P1, P1.replace("9E+09", "-0.5", 1), 4, "an external axis that is not at zero"),
    ):
        program = read(body, data)
        skips = [skip for skip in program.skipped if part in skip.reason]
        assert {skip.line for skip in skips} == {line}, program.skipped
        moved = {program.targets[move.target].line for move in program.moves}
        assert not moved or line not in moved or "tool0" in body, body


def test_a_target_of_no_move_has_the_only_tool_and_work_object() -> None:
    program = read(
        f"MoveL {pose()},v1,fine,tPen\\WObj:=wTable; MoveAbsJ [[1,2,3,4,5,6],{NO_AXES}],v1,fine,tPen;",
        f"CONST robtarget p1:={pose()};\nCONST jointtarget j1:=[[1,2,3,4,5,6],{NO_AXES}];",
    )
    assert [(t.name, t.tool, t.frame) for t in program.targets[:2]] == [("p1", "tPen", "wTable"), ("j1", "tPen", "")]
    assert not program.skipped


def test_offsets_by_expressions_are_left_alone_and_their_targets_corrected() -> None:
    program = read(
        "MoveL p1,v1,fine,tPen;\nMoveL Offs(p1,0,0,nUp+5),v1,fine,tPen;\nMoveL p1,v1,fine,tPen;",
        f"CONST robtarget p1:={pose()};",
    )
    assert [t.name for t in program.targets] == ["p1"]
    assert [(m.target, m.routine, m.statement == (0, 0)) for m in program.moves] == [
        (0, 0, False), (0, 1, True), (0, 2, False),
    ]  # fmt: skip
    assert not program.skipped


def test_an_own_function_of_the_name_is_not_the_controllers() -> None:
    own = "FUNC robtarget Offs(robtarget p,num x,num y,num z) RETURN p; ENDFUNC"
    text = f"MODULE Own\n{PEN}\n{own}\nPROC main() MoveL Offs({pose()},1,2,3),v1,fine,tPen; ENDPROC\nENDMODULE\n"
    program = RAPID.read([Source(Path("own.mod"), text)])
    assert not program.targets
    assert [skip.reason for skip in program.skipped] == ["the target of MoveL is computed"]


def test_a_tool_that_the_program_changes_is_not_known() -> None:
    moved = f"MoveL {pose()},v1,fine,tPen\\WObj:=wTable;"
    program = read(f"tPen.tframe.trans.z:=nLength; wTable.oframe:=pFound; {moved}")
    assert not program.tools
    assert not program.frames
    assert (program.targets[0].tool, program.targets[0].frame) == ("tPen", "wTable")
    assert list(read(f"tPen.tload.mass:=3; {moved}").tools) == ["tPen"]


MOVED = "MoveL p1,v1,fine,tPen\\WObj:=wTable;"


def test_malformed_text_is_refused() -> None:
    for text, line, part in (
        ("PROC main()\nENDPROC\n", 1, "there is no MODULE"),
        ("MODULE A\nENDMODULE\nMODULE B\nMODULE C\nENDMODULE\n", 3, "a MODULE has no ENDMODULE"),
        ("MODULE A\nENDMODULE\nENDMODULE\n", 3, "an ENDMODULE closes no MODULE"),
        ("MODULE A\nPROC main()\nENDMODULE\n", 2, "a routine has no ENDPROC"),
        ("MODULE A\nPROC main()\nPROC b()\nENDPROC\nENDMODULE\n", 2, "a routine has no ENDPROC"),
        ("MODULE A\nPROC main()\nENDFUNC\nENDMODULE\n", 3, "an ENDFUNC closes nothing"),
        ("MODULE A\nPROC\n", 2, "the head of a PROC is incomplete"),
        ("MODULE A\nVAR num x;\nVAR num y:=1];\nENDMODULE\n", 3, "a bracket is not"),
        ("MODULE A\nVAR num y{3}:=[1,(2],3);\nENDMODULE\n", 2, "a bracket is not"),
        ('MODULE A\nVAR string s:="ab"";\nVAR string t:=";\nENDMODULE\n', 2, "a string is not closed"),
    ):
        with pytest.raises(InputError, match=part) as refused:
            RAPID.read([Source(Path("bad.mod"), text)])
        assert refused.value.where == f"bad.mod, line {line}", text


def test_numbers_that_cannot_be_are_refused() -> None:
    turned = "[{}],[0,0,0,0]," + NO_AXES
    far = f"CONST jointtarget j1:=[[0,0,0,0,0,-2E6],{NO_AXES}];"
    for data, part in (
        (f"CONST robtarget p1:={pose(rest=turned.format('0,0.7,0.7,0'))};", "quaternion"),
        (f"CONST robtarget p1:={pose(rest=turned.format('0,0,0,0'))};", "quaternion"),
        (f"CONST robtarget p1:={pose(1.1e6)};", "out of all proportion"),
        (f"CONST robtarget p1:={pose(z=-1e400)};".replace("-inf", "-1e400"), "out of all proportion"),
        (f"{P1} {far}", "out of all proportion"),
    ):
        with pytest.raises(InputError, match=part) as refused:
            read(MOVED, data)
        assert refused.value.where == "one.mod, line 4"
    # A quaternion may be a thousandth off.
    assert len(read(MOVED, f"CONST robtarget p1:={pose(rest=turned.format('0,1.0009,0,0'))};").targets) == 1


@pytest.mark.parametrize(("old", "new"), [("[[0,0,100],[1,0,", "[[0,0,100],[1,0.1,"), ("[[300,0,50]", "[[3E7,0,50]")])
def test_tools_and_frames_that_cannot_be_are_refused_if_they_are_used(old: str, new: str) -> None:
    def module(tool: str) -> list[Source]:
        routine = f"PROC main()\n  MoveL {pose()},v1,z1,{tool};\nENDPROC"
        return [Source(Path("a.mod"), f"MODULE A\n{PEN}\n{TABLE}\n{routine}\nENDMODULE\n".replace(old, new, 1))]

    with pytest.raises(InputError, match=r"quaternion|proportion") as refused:
        RAPID.read(module("tPen\\WObj:=wTable"))
    assert refused.value.where in ("a.mod, line 2", "a.mod, line 3")
    unused = RAPID.read(module("tool0"))
    assert len(unused.tools) + len(unused.frames) == 1


def test_elbow_words_agree_with_the_arm() -> None:
    """The manual's table, worked out with the drawing of the IRB 120 for random joint positions."""
    robot = load_robot("irb120").rigid
    q = robot.random_configurations(2000, np.random.default_rng(3))
    words = [name.split("-") for name in branches(robot, q)]
    tilt, bend = q[:, 1], q[:, 2]
    behind_axis_1 = 270 * np.sin(tilt) + 302 * np.cos(tilt + bend) + 70 * np.sin(tilt + bend) < 0
    behind_arm = 302 * np.cos(bend) + 70 * np.sin(bend) < 0
    cfx = 4 * behind_axis_1 + 2 * behind_arm + (q[:, 4] < 0)
    assert len(set(cfx.tolist())) == 8
    for (shoulder, elbow, _), behind, number in zip(words, behind_axis_1, cfx, strict=True):
        assert shoulder == ("back" if behind else "front")
        assert configuration("0", "0", "0", str(number)).elbow == elbow


def test_what_is_no_quadrant_and_no_cfx_leaves_the_posture_open() -> None:
    for cfx in ("8", "-1", "1000", "0.5", "9E9"):
        assert configuration("0", "-4", "3", cfx).elbow is None, cfx
        assert configuration("0", "-4", "3", cfx).ranges == quadrants(0, -4, 3), cfx
    assert configuration("9E9", "0.5", "-1", "0").ranges == ((6, -pi / 2, 0.0),)


def between(move: int, *points: tuple[float, ...]) -> Split:
    return Split(move, tuple((point, None) for point in points))


def test_a_linear_move_is_split_by_the_same_instruction() -> None:
    down = pose(rest="[0,0,1,0],[0,-1,1,5],[0,9E9,9E9,9E9,9E9,9E9]")
    program = read(
        "  MoveJ p1,v1,z1,tPen;\n  MoveL p2, v100,fine\t,tPen\\WObj:=wobj0 ; ! down",
        f"CONST robtarget p1:={pose()};\nCONST robtarget p2:={down};",
    )
    points = (1.0, 2.0, -0.0001, 0.6, 0.8, 0.0, 0.0), (1.5, 2.25, 3.0005, 0.0, 0.0, 1.0, 0.0)
    again = split(RAPID, program, between(1, *points))
    assert again.sources[0].text.splitlines()[5:9] == [
        "  MoveJ p1,v1,z1,tPen;",
        "  MoveL [[1.000,2.000,0.000],[0.6000000,0.8000000,0.0000000,0.0000000],[0,-1,1,5],"
        "[0,9E9,9E9,9E9,9E9,9E9]], v100,z1\t,tPen\\WObj:=wobj0 ;",
        "  MoveL [[1.500,2.250,3.001],[0.0000000,0.0000000,1.0000000,0.0000000],[0,-1,1,5],"
        "[0,9E9,9E9,9E9,9E9,9E9]], v100,z1\t,tPen\\WObj:=wobj0 ;",
        "  MoveL p2, v100,fine\t,tPen\\WObj:=wobj0 ; ! down",
    ]
    assert [m.kind for m in again.moves] == ["joint", "linear", "linear", "linear"]
    assert [again.targets[m.target].values[0] for m in again.moves] == [300.0, 1.0, 1.5, 300.0]


def test_offsets_stay_offsets(polish: Program) -> None:
    again = split(RAPID, polish, between(4, (1.0, -2.0, 3.5)), between(5, (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)))
    lines = again.sources[0].text.splitlines()
    assert lines[49] == "    MoveL Offs(p10,1.000,-2.000,3.500),v100,z5,tDisc\\WObj:=wCover;"
    assert lines[51] == (
        "    MoveL RelTool (p20, 1.000,2.000,3.000\\Rx:=0.1000\\Ry:=0.2000\\Rz:=0.3000), v100, z5,"
        " tDisc \\WObj:=wCover;"
    )
    assert len(again.targets) == len(polish.targets) + 2


def test_moves_that_cannot_be_split_are_left_whole() -> None:
    for body in (
        f"MoveL {pose()},v1\\T:=5,fine,tPen;",
        f"MoveL {pose()}\\ID:=5,v1,fine,tPen;",
        f"MoveL \\Conc,{pose()},v1,fine,tPen;",
        f"MoveLDO {pose()},v1,fine,tPen,do1,1;",
        f"TriggL {pose()},v1,t1,fine,tPen;",
        f"ArcLStart {pose()},v1,s1,w1,fine,tPen;",
        f"IF a MoveL {pose()},v1,fine,tPen;",
        f"MoveL Offs({pose()},1,2,3),v1,fine,tPen;",
    ):
        program = read(body)
        (move,) = program.moves
        assert move.statement == (0, 0), body
        count = len(program.targets[move.target].values)
        assert split(RAPID, program, between(0, (1.0,) * count)).sources == program.sources, body
