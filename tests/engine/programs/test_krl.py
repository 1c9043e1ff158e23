"""KUKA programs: what the reader finds, leaves alone and refuses, and how it splits moves.

The syntax of the samples is that of KUKA System Software 8.3, Operating and Programming Instructions for System
Integrators ("Programming for user group Expert", "Status and Turn") and of KUKA, Expert Programming, KSS 5.2 ("Motion
programming": aggregates, geometric operator, CIRC), as public programs have it; inline forms are as the teach pendant
of KSS 8.3 writes them.
"""

from __future__ import annotations

from math import inf, pi
from pathlib import Path

import numpy as np
import pytest
from tests.engine.programs.reading import reasons, said, sample, split

from truearm.engine.base.errors import InputError
from truearm.engine.programs.krl import KRL
from truearm.engine.programs.program import ANY_POSTURE, Program, ProgramTarget, Source, Split

CELL = ("cell/cell.src", "cell/cell.dat", "cell/$config.dat")
EXTERNAL = "an external axis is not at zero, and may carry the robot or move the work"
SEVERAL = "XP1 has several values, and which one holds here is not known"
FRAMES = "{X 1.0,Y 2.0,Z 3.0,A 10.0,B 20.0,C 30.0}"


def read(body: str, data: str = "", others: str = "") -> Program:
    """Read a routine and a data list."""
    sources = [Source(Path("part.src"), f"DEF PART ( )\n{body}\nEND\n{others}")]
    return KRL.read([*sources, Source(Path("part.dat"), f"DEFDAT PART\n{data}\nENDDAT\n")] if data else sources)


def named(program: Program, name: str) -> ProgramTarget:
    (target,) = [target for target in program.targets if target.name == name]
    return target


@pytest.fixture(scope="module")
def cell() -> Program:
    return sample(KRL, *CELL)


def test_targets_of_the_cell(cell: Program) -> None:
    found = [(t.source, t.line, t.name, t.tool, t.frame, t.parent) for t in cell.targets]
    assert found == [
        (0, 48, "", "2", "", 18), (0, 50, "", "2", "", None), (0, 53, "", "2", "", None), (0, 55, "", "2", "", None),
        (0, 57, "", "2", "", None), (0, 60, "", "2", "", None), (0, 61, "", "2", "", None),
        (0, 62, "", "2", "", None), (0, 62, "", "2", "", None), (0, 63, "", "2", "", None),
        (1, 7, "XP1", "1", "2", None), (1, 10, "XP2", "1", "2", None), (1, 12, "XP3", "1", "2", None),
        (1, 14, "XP4", "1", "2", None), (1, 15, "XP5", "1", "2", None), (1, 16, "XP6", "2", "", None),
        (1, 19, "XP8", "2", "2", None), (1, 23, "P[1]", "2", "", None), (1, 24, "P[2]", "2", "", None),
    ]  # fmt: skip
    assert cell.targets[10].values == (850.125, -20.5, 1200.0, 180.0, 30.25, 179.5)
    assert cell.targets[11].values == (900.0, 0.0, 1000.0, 0.0, 0.0, 180.0)  # written in another order
    assert cell.targets[1].values == (700.0, -150.0, 600.25, 10.0, 0.0, 180.0)
    assert cell.targets[9].values == (10.0, -90.0, 90.0, 0.0, 45.5, -5.25)
    assert cell.targets[9].form.kind == "joints"
    shift = cell.targets[0]
    assert shift.values == (0.0, 0.0, -100.5)
    assert shift.turned
    assert shift.form.orientation is None


def test_moves_of_the_cell(cell: Program) -> None:
    text = cell.sources[0].text
    found = [(m.kind, m.line, m.routine, cell.targets[m.target].name, text[slice(*m.target_text)]) for m in cell.moves]
    assert found[:6] == [
        ("joint", 28, 0, "XP1", "XP1"), ("linear", 33, 0, "XP2", "XP2"), ("circular", 36, 0, "XP4", "XP4"),
        ("circular", 37, 0, "XP5", ""), ("linear", 39, 0, "XP6", ""), ("joint", 47, 1, "P[1]", "P[1]"),
    ]  # fmt: skip
    assert [m.line for m in cell.moves[6:]] == [48, 49, 50, 53, 55, 57, 60, 61, 62, 63]
    whole = [m.line for m in cell.moves if m.target_text == (0, 0)]
    assert whole == [37, 39, 48, 53, 55, 57, 60]
    assert cell.targets[cell.moves[2].via or 0].name == "XP3"
    assert said(cell, 2) == ("circ XP3, XP4 C_DIS", "XP4", "XP3")


def test_what_the_cell_leaves_alone(cell: Program) -> None:
    assert [(s.source, s.line, s.reason) for s in cell.skipped] == [
        (0, 40, "LOCAL is declared without numbers"),
        (0, 51, "Y, Z, A, B, C are not written and would stay as before"),
        (0, 65, "the tool is computed"),
        (1, 18, "an external axis is not at zero, and may carry the robot or move the work"),
    ]
    assert cell.unknown == {"MSGNOTIFY": 1}


def test_tools_and_bases_of_the_cell(cell: Program) -> None:
    assert set(cell.tools) == {"1", "2"}
    assert set(cell.frames) == {"1", "2"}
    assert cell.tools["1"].translation == (0.0, 0.0, 0.15)
    # B turns about y: the tool's x axis points along the flange's negative z.
    np.testing.assert_allclose(cell.tools["1"].rotation[:, 0], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(cell.frames["2"].rotation[:, 0], [0.0, 1.0, 0.0], atol=1e-12)


def test_a_milling_program_with_its_own_tool() -> None:
    program = sample(KRL, "milling.src")
    assert {target.tool for target in program.targets} == {"$TOOL={X 1.5,Y -2.5,Z 180,A 0,B 0,C 0}"}
    assert {target.frame for target in program.targets} == {"TABLE"}
    assert program.tools["$TOOL={X 1.5,Y -2.5,Z 180,A 0,B 0,C 0}"].translation == (0.0015, -0.0025, 0.18)
    assert program.frames == {}
    assert program.unknown == {"SPINDLE": 2}
    assert program.skipped == ()
    assert [move.kind for move in program.moves] == ["joint", "linear", "linear", "linear", "circular"]


def test_status_and_turn() -> None:
    for status, turn, shoulder, elbow, wrist in (
        ("2", "35", "front", "up", (5, 0.0, pi)),
        ("6", "19", "front", "up", (5, -pi, 0.0)),
        ("0", "0", "front", "down", (5, 0.0, pi)),
        ("3", "0", "back", "down", (5, 0.0, pi)),
        ("1", "0", "back", "up", (5, 0.0, pi)),
        ("'B10110'", "'H32'", "front", "up", (5, -pi, 0.0)),
    ):
        program = read(f"PTP {{X 1,Y 2,Z 3,A 4,B 5,C 6,S {status},T {turn}}}")
        configuration = program.targets[0].configuration
        assert (configuration.shoulder, configuration.elbow, configuration.wrist) == (shoulder, elbow, None), status
        number = {"'H32'": 50}.get(turn) or int(turn)
        signs = [(i + 1, -inf, 0.0) if number >> i & 1 else (i + 1, 0.0, inf) for i in range(6)]
        assert configuration.ranges == (wrist, *signs), status
    # These are no bits.
    assert read("PTP {X 1,Y 2,Z 3,A 4,B 5,C 6,S 'B2',T 2}").targets[0].configuration.shoulder is None


def test_status_and_turn_are_for_moves_by_axes() -> None:
    taught = "{X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35}"
    program = read(f"PTP {FRAMES}\nLIN {taught}\nLIN XP1\nPTP XP1", f"DECL POS XP1={taught}\nDECL POS XP2={taught}")
    frame, line, both, unused = program.targets
    assert frame.configuration == ANY_POSTURE
    assert line.configuration == ANY_POSTURE
    assert len(both.configuration.ranges) == 7
    assert unused.configuration == both.configuration
    first = read(f"LIN {taught}").targets[0].configuration
    assert (first.shoulder, first.elbow, first.ranges) == ("front", "up", ((5, 0.0, pi),))


def test_tool_and_base() -> None:
    for body, tool, frame in (
        ("", "", ""),
        ("BAS(#TOOL,3)\nBAS ( #BASE , 4 )", "3", "4"),
        ("BAS(#INITMOV,0)", "1", ""),
        ("$TOOL=TOOL_DATA[ 12 ]\n$BASE = BASE_DATA[2] ; BASE_DATA[3]", "12", "2"),
        ("$tool=$nullframe\n$base=$world", "", ""),
        ("FDAT_ACT={TOOL_NO 11, BASE_NO 1, IPO_FRAME #BASE}", "11", "1"),
        ("BAS(#TOOL,3)\nBAS(#BASE,1)\nSPINDLE()\nBAS(#FRAMES)", "3", "1"),
        ("BAS(#TOOL,3)\nBAS(#BASE,1)\nOTHER()", "8", "1"),
        ("$TOOL=LANCE\n$BASE=$ROBROOT", "LANCE", ""),
    ):
        program = read(f"{body}\nLIN {FRAMES}", others="DEF OTHER ( )\nBAS(#TOOL,8)\nEND\n" if "OTHER" in body else "")
        assert (program.targets[0].tool, program.targets[0].frame) == (tool, frame), body
        assert program.skipped == (), body


def test_a_routine_begins_with_what_the_file_set_before() -> None:
    program = read(f"BAS(#TOOL,3)\nLIN {FRAMES}", others=f"DEF NEXT ( )\nLIN {FRAMES}\nEND\n")
    assert [target.tool for target in program.targets] == ["3", "3"]
    assert [move.routine for move in program.moves] == [0, 1]


def test_a_declared_frame_may_be_a_tool() -> None:
    program = read(f"DECL FRAME F\n$TOOL=LANCE\nLIN {FRAMES}", f"FRAME LANCE={FRAMES}")
    assert program.targets[0].tool == "LANCE"
    assert program.tools["LANCE"].translation == (0.001, 0.002, 0.003)
    assert len(program.targets) == 1


def test_tools_and_bases_that_are_not_known() -> None:
    for body, reason in (
        ("$TOOL=TOOL_DATA[N]", "the tool is computed"),
        ("$TOOL.X=5", "$TOOL is changed in part"),
        ("$BASE=BASE_DATA[1]:BASE_DATA[2]", "the base is computed"),
        (
            "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,BASE_DATA[3])",
            "the base is moved by an external axis",
        ),
        ("BAS(#EX_BASE,2)", "the base is moved by an external axis"),
        ("$IPO_MODE=#TCP", "the tool stands still and the robot holds the work (#TCP)"),
        ("FDAT_ACT={TOOL_NO 1,BASE_NO 1,IPO_FRAME #TCP}", "the tool stands still and the robot holds the work (#TCP)"),
        ("FDAT_ACT=FP9", "FP9, which gives its tool and base, is not declared in this program"),
        ("BASE_DATA[3]=$POS_ACT\n$BASE=BASE_DATA[3]", "the base is computed"),
        ("BASE_DATA[3].X=5\nBAS(#BASE,3)", "the base is computed"),
        ("BAS(#INITMOV,0)\nSETUP()", "SETUP, which is not in this program, may set the tool"),
    ):
        program = read(f"BAS(#TOOL,1)\nBAS(#BASE,1)\n{body}\nLIN {FRAMES}\nPTP {{A1 0,A2 -90,A3 90,A4 0,A5 1,A6 0}}")
        assert [(s.line, s.reason) for s in program.skipped] == [(body.count("\n") + 5, reason)], body
        assert [move.kind for move in program.moves] == ["joint"], body  # axis values need neither


def test_a_tool_that_is_set_too_late() -> None:
    late = "the %s is set only further down in the file"
    assert reasons(read(f"LIN {FRAMES}\nBAS(#TOOL,1)")) == [(2, late % "tool")]
    assert reasons(read(f"LIN {FRAMES}", others="DEF B ( )\n$BASE=BASE_DATA[1]\nEND\n")) == [(2, late % "base")]


def test_targets_that_cannot_be_corrected() -> None:
    for body, data, reason in (
        ("LIN XP1", "", "XP1 is not declared in this program"),
        ("LIN XP1", "DECL E6POS XP1", "XP1 is declared without numbers"),
        ("XP1.X=XP1.X+5\nLIN XP1", f"DECL POS XP1={FRAMES}", "XP1 is computed, in line 2"),
        ("XP1=XP2\nLIN XP1", "DECL POS XP1,XP2", "XP1 is computed, in line 2"),
        ("LIN PLACE_OF(3)", "", "the words of this move are not understood"),
        (f"LIN {FRAMES}:XP1", f"DECL FRAME XP1={FRAMES}", "the place is computed: it begins with an offset"),
        ("LIN F1:XP1", f"DECL FRAME F1={FRAMES}\nDECL POS XP1={FRAMES}", "the place is computed from others"),
        ("PTP {A1 10,A2 -90}", "", "A3, A4, A5, A6 are not written and would stay as before"),
        ("LIN {X 1,Y 2,Z ZPOS,A 4,B 5,C 6}", "", "Z is not a number"),
        ("LIN XP1:{X 5,Y DY,Z 0}", f"DECL POS XP1={FRAMES}", "Y is not a number"),
        ("LIN {X 1,X 2,Y 2,Z 3,A 4,B 5,C 6}", "", "X appears twice"),
        ("LIN {X 1,Y 2,Z 3,A 4,B 5,C 6,Q 1}", "", "Q is no part of a position"),
        ("LIN {X 1,Y 2,Z 3,A 4,B 5,C 6,E2 5}", "", EXTERNAL),
        ("LIN P[I]", "DECL POS P[2]", "P[I] is not written out in this program"),
        ("LIN XP1", f"DECL POS XP1={FRAMES}\nXP1={FRAMES}", SEVERAL),
        ("CIRC XP1", f"DECL POS XP1={FRAMES}", "the words of this move are not understood"),
    ):
        program = read(body, data)
        assert reason in [why for _, why in reasons(program)], body
        assert program.moves == (), body


def test_one_name_is_listed_once() -> None:
    assert reasons(read("PTP XP2\nLIN XP1\nPTP XP2\nPTP $POS_ACT\nPTP XHOME")) == [
        (2, "XP2 is not declared in this program"),
        (3, "XP1 is not declared in this program"),
    ]


def test_two_tools_for_one_target() -> None:
    program = read("BAS(#TOOL,1)\nLIN XP1\nBAS(#TOOL,2)\nLIN XP1\nPTP XJ\nBAS(#TOOL,1)\nPTP XJ",
                   f"DECL POS XP1={FRAMES}\nAXIS XJ={{A1 0,A2 -90,A3 90,A4 0,A5 1,A6 0}}")  # fmt: skip
    assert [why for _, why in reasons(program)] == ["it is used with different tools or bases"]
    assert [target.name for target in program.targets] == ["XJ"]
    assert len(program.moves) == 2


def test_targets_without_moves() -> None:
    data = f"DECL POS XP1={FRAMES}\nDECL POS XP2={FRAMES}\nFRAME OFF={FRAMES}\nDECL POS LIFT={FRAMES}"
    one = read("BAS(#TOOL,1)\nBAS(#BASE,2)\nLIN XP1\nLIN XP1:OFF", data.replace("DECL POS LIFT", "FRAME LIFT"))
    assert [(t.name, t.tool, t.frame) for t in one.targets] == [("XP1", "1", "2"), ("XP2", "1", "2")]
    none = read("WAIT SEC 1", data)
    assert {why for _, why in reasons(none)} == {"no move uses it, so its tool and base are not known"}
    two = read("BAS(#TOOL,1)\nLIN XP1\nBAS(#TOOL,2)\nLIN " + FRAMES, data)
    said = "no move uses it, and not all moves of the program have one tool and one base"
    assert {why for _, why in reasons(two)} == {said}
    form = read("WAIT SEC 1", f"{data}\nDECL FDAT FP2={{TOOL_NO 4,BASE_NO 5,IPO_FRAME #BASE}}")
    assert [(t.name, t.tool, t.frame) for t in form.targets] == [("XP2", "4", "5")]
    # A place that serves as an offset is no target.
    assert "XP2" not in [t.name for t in read("LIN XP1\nLIN XP1:XP2", data).targets]


def test_offsets() -> None:
    data = f"DECL POS XP1={FRAMES}\nDECL FRAME LIFT={FRAMES}"
    program = read("LIN XP1\nLIN XP1:LIFT\nLIN XP1:{Z 50}\nLIN XP1:{X 1,Y 2,Z 3,A 0,B 0,C 90}:{Z 5.5}\nLIN XP1", data)
    assert program.skipped == ()
    parent = program.targets.index(named(program, "XP1"))
    first, second, third = program.targets[:3]
    assert (first.values, first.parent, first.turned) == ((0.0, 0.0, 50.0), parent, True)
    assert first.places[:2] == (None, None)
    assert second.form.orientation is not None
    assert (second.parent, third.parent, third.values) == (parent, 1, (0.0, 0.0, 5.5))
    # An offset in a variable is left alone; the place before it is the target.
    assert [move.target for move in program.moves] == [parent, parent, 0, 2, parent]
    # Only the last move is known to begin and to end at a target.
    assert [move.target_text != (0, 0) for move in program.moves] == [False, False, False, False, True]


def test_assignments_hold_in_the_order_of_the_text() -> None:
    other = FRAMES.replace("1.0", "100.0")
    program = read(f"DECL POS P1\nP1={FRAMES}\nLIN P1\nP1={{POS: {other[1:]}\nLIN P1")
    assert [target.values[0] for target in program.targets] == [1.0, 100.0]
    assert [move.target for move in program.moves] == [0, 1]


def test_every_element_of_a_list_has_the_tool_of_its_move() -> None:
    program = read("BAS(#TOOL,6)\nFOR I=1 TO 2\nLIN P[I]\nENDFOR", f"POS P[2]\nP[1]={FRAMES}\nP[2]={FRAMES}")
    assert [(target.name, target.tool) for target in program.targets] == [("P[1]", "6"), ("P[2]", "6")]
    assert program.skipped == ()


def test_moves_are_split_only_where_it_is_known_from_where_they_come() -> None:
    for between in (
        "LOOP",
        "ELSE",
        "AGAIN:",
        "GRIP()",
        "LIN_REL {X 5}",
        "PTP XHOME",
        "LIN {X 5}",
        "CIRC XP1,XP1,CA 90",
        "TRIGGER WHEN DISTANCE=1 DELAY=0 DO A=1",
    ):
        data = f"DECL POS XP1={FRAMES}"
        plain = read("PTP XP1\nWAIT SEC 0.5\n$OUT[3]=TRUE\nLIN XP1", data).moves[-1]
        assert plain.target_text != (0, 0), between
        assert read(f"PTP XP1\n{between}\nLIN XP1", data).moves[-1].target_text == (0, 0), between


def test_malformed_text_is_refused() -> None:
    for text, message in (
        ("DEF A ( )\nLIN {X 1,Y 2\nEND", "curly brackets"),
        ('DEF A ( )\nMsgNotify("half\nEND', "a string does not close"),
        ("DEF A ( )\nDEF B ( )\nEND", "this has no END"),
        ("DEFFCT INT A ( )\nRETURN 1\n", "this has no ENDFCT"),
        ("DEFDAT A\nDECL INT B=1\n", "this has no ENDDAT"),
        ("DEFDAT A\nEND\n", "ends what did not begin"),
        ("PTP XHOME\n", "outside of DEF and END"),
        ("DEF A ( )\nLIN {X 1e7,Y 2,Z 3,A 4,B 5,C 6}\nEND", "out of all proportion"),
        ("DEF A ( )\nLIN {C 1e999,Y 2,Z 3,A 4,B 5,X 6}\nEND", "out of all proportion"),
    ):
        with pytest.raises(InputError, match=message) as refusal:
            KRL.read([Source(Path("bad.src"), text)])
        assert refusal.value.where is not None, text
        assert refusal.value.where.startswith("bad.src, line "), text


def test_a_split_line(cell: Program) -> None:
    line = next(i for i, move in enumerate(cell.moves) if move.line == 61)
    pieces = (
        ((703.25, -55.0, 640.0, 10.0, 0.00001, 180.0), None),
        ((703.5, -50.0, 640.00049, 10.0, 0.0, -180.0), None),
    )
    assert (
        "\tLIN {X 703.250,Y -55.000,Z 640.000,A 10.0000,B 0.0000,C 180.0000} C_DIS\r\n"
        "\tLIN {X 703.500,Y -50.000,Z 640.000,A 10.0000,B 0.0000,C -180.0000} C_DIS\r\n"
        "\tLIN {X 704.0,Y -40.0,Z 640.0,A 10.0,B 0.0,C 180.0} C_DIS ;split me\r\n"
    ) in split(KRL, cell, Split(line, pieces)).sources[0].text
