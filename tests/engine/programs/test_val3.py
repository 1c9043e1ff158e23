"""Staubli VAL3 applications.

The samples follow the VAL3 reference manual (version 5.3, D28062804A: types trsf, frame, tool, point, joint and
config, instructions movej, movel, movec and appro) and both XML formats: that of VAL3 7 (``Database``), which does not
write zeros, and that of versions 5 and 6 (``dataList``), as the VAL3 XML format document (s6.x) has it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.engine.programs.reading import said, sample, way, written

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import Configuration, Program, Source
from truearm.engine.programs.val3 import VAL3
from truearm.engine.robot.transform import MOVING_XYZ_ANGLES

CELL = ("cell/cell.dtx", "cell/start.pgx", "cell/pick.pgx", "cell/cell.pjx")
OLD = ("old/old.dtx", "old/start.pgx")


def data(text: str) -> Source:
    head = (
        '<?xml version="1.0" encoding="utf-8"?>\n<Database xmlns="http://www.staubli.com/robotics/VAL3/Data/2"><Datas>'
    )
    return Source(Path("a.dtx"), f"{head}\n{text}\n</Datas></Database>\n")


def code(text: str, before: str = "", name: str = "start.pgx") -> Source:
    head = '<?xml version="1.0" encoding="utf-8"?>\n<Programs xmlns="http://www.staubli.com/robotics/VAL3/Program/2">'
    program = f'<Program name="start">{before}<Code><![CDATA[begin\n{text}\nend]]></Code></Program>'
    return Source(Path(name), f"{head}\n{program}\n</Programs>\n")


def variable(name: str, type_: str, *values: str) -> str:
    rows = "".join(f'<Value key="{key}" {value} />\n' for key, value in enumerate(values))
    return f'<Data name="{name}" access="public" type="{type_}" size="{len(values)}">\n{rows}</Data>\n'


POINT = variable("pA", "pointRx", 'x="1" y="2" z="3" rx="4" ry="5" rz="6" fatherId="world[0]"')
TOOL = variable("tA", "tool", 'z="100" fatherId="flange[0]"')


@pytest.fixture(scope="module")
def cell() -> Program:
    return sample(VAL3, *CELL)


def test_numbers_tools_and_frames(cell: Program) -> None:
    found = [(t.name, t.line, t.form.name, t.tool, t.frame, t.values) for t in cell.targets]
    assert found == [
        ("jHome", 16, "jointRx", "tGrip", "", (0.0, 0.0, 90.0, 0.0, 90.0, 0.0)),
        ("pApproach", 23, "pointRx", "tGrip", "fTable", (300.0, 0.0, 200.0, 0.0, 180.0, 0.0)),
        ("pGrid", 26, "pointRx", "tTip", "fTable[1]", (10.5, 0.0, -4.25, -180.0, 0.0, 0.0)),
        ("pGrid[1]", 27, "pointRx", "tTip", "fTable[1]", (20.5, 0.0, -4.25, -180.0, 0.0, 0.0)),
        ("pVia", 31, "pointRx", "tGrip", "fTable", (310.0, 10.0, 200.0, 0.0, 180.0, 0.0)),
        ("pEnd", 34, "pointRx", "tGrip", "fTable", (320.0, 0.0, 200.0, 0.0, 180.0, 0.0)),
        ("", 12, "pointRx", "tGrip", "fTable", (0.0, 0.0, -100.5, 0.0, 0.0, 0.0)),
    ]
    assert [written(cell, row) for row in range(7)] == [
        ["", "", "90", "", "90", ""],
        ["300", "0", "200", "0", "180", "0"],
        ["10.5", "", "-4.25", "-180", "", ""],
        ["20.5", "", "-4.25", "-180", "", ""],
        ["310", "10", "200", "", "180", ""],
        ["320", "0", "200", "", "180", ""],
        ["0", "0", "-100.5", "0", "0", "0"],
    ]
    point, offset = cell.targets[1], cell.targets[6]
    assert point.form.orientation is MOVING_XYZ_ANGLES
    assert (offset.parent, offset.turned, offset.source) == (1, True, 1)
    assert (point.parent, point.turned) == (None, False)


def test_zeros_that_are_not_written_have_a_place(cell: Program) -> None:
    for target in cell.targets[:6]:
        text = cell.sources[0].text
        puts = [
            (place[0], form.format(7))
            for place, form in zip(target.places, target.form.absent, strict=True)
            if place is not None and place[0] == place[1]
        ]
        for place, put in reversed(puts):
            text = text[:place] + put + text[place:]
        changed = VAL3.read([replace(cell.sources[0], text=text), *cell.sources[1:]])
        (again,) = (t for t in changed.targets if (t.name, t.line) == (target.name, target.line))
        written = [place is not None and place[0] < place[1] for place in target.places]
        assert list(again.values) == [v if w else 7.0 for v, w in zip(target.values, written, strict=True)]
        assert len(changed.targets) == len(cell.targets)


def test_moves_and_what_is_left(cell: Program) -> None:
    # Offsets that are variables or expressions stay as they are: the fifth and the sixth.
    assert way(cell) == [
        ("joint", "jHome", None), ("joint", "", None), ("linear", "pApproach", None), ("circular", "pEnd", "pVia"),
        ("linear", "pEnd", None), ("linear", "pEnd", None), ("linear", "pGrid[1]", None),
    ]  # fmt: skip
    assert said(cell, 3) == ("movec(pVia,pEnd,tGrip,mNom)", "pEnd", "pVia")
    assert said(cell, 1)[1] == "appro(pApproach,{0,0,-100.5,0,0,0})"
    assert [move.line for move in cell.moves] == [11, 12, 13, 14, 15, 16, 14]
    assert [(s.source, s.line, s.reason) for s in cell.skipped] == [
        (0, 28, "pGrid[2] is not taught: none of its numbers is written"),
        (0, 37, "pBoth is used with several tools, or by no move where moves have several"),
        (0, 40, "pSet is changed by the program"),
        (0, 43, "pGiven is handed to another program"),
        (0, 46, "pLoose is used with several tools, or by no move where moves have several"),
        (1, 23, "the target of the move is computed when the program runs"),
        (1, 24, "the target of the move is computed when the program runs"),
        (1, 25, "pElsewhere is not declared in the data given"),
        (1, 26, "pEmpty has no value in the data"),
        (1, 27, "the offset is from pSet, which is left as it is"),
        (2, 9, "the target of the move is computed when the program runs"),
    ]
    assert cell.unknown == {"wobble": 1}
    assert len({move.routine for move in cell.moves[:6]}) == 1
    assert cell.moves[6].routine != cell.moves[5].routine


def test_frames_and_tools_are_chains(cell: Program) -> None:
    # fMoving is set by the program, fShared stands on a frame of a library.
    assert set(cell.frames) == {"fTable", "fTable[1]"}
    assert set(cell.tools) == {"tGrip", "tTip"}
    table, tilted = cell.frames["fTable"], cell.frames["fTable[1]"]
    assert table.translation == pytest.approx((0.4, -0.2505, -0.12))
    np.testing.assert_allclose(table.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    # 50 mm along the x axis of the table, which is y of the world; then turned by 45 deg about the table's y axis.
    assert tilted.translation == pytest.approx((0.4, -0.2005, -0.12))
    s = math.sqrt(0.5)
    np.testing.assert_allclose(tilted.rotation, np.array([[0, -1, 0], [s, 0, s], [-s, 0, s]]), atol=1e-15)
    assert cell.tools["tTip"].translation == pytest.approx((0.0, 0.0, 0.175))
    c, d = math.cos(math.radians(30)), math.sin(math.radians(30))
    np.testing.assert_allclose(cell.tools["tTip"].rotation, np.array([[0, -d, c], [0, c, d], [-1, 0, 0]]), atol=1e-15)


def test_postures(cell: Program) -> None:
    by_name = {t.name: t.configuration for t in cell.targets}
    inf = math.inf
    assert by_name["pApproach"] == Configuration(shoulder="front", ranges=((3, 0.0, inf), (5, 0.0, inf)))
    assert by_name["pGrid"] == Configuration(shoulder="back", ranges=((3, -inf, 0.0), (5, -inf, 0.0)))
    assert by_name["pGrid[1]"] == by_name["pVia"] == by_name["jHome"] == Configuration()


def test_the_old_format() -> None:
    program = sample(VAL3, *OLD)
    assert [(t.name, t.line, t.tool, t.frame, t.parent) for t in program.targets] == [
        ("jStart", 20, "", "", None), ("pRow", 33, "tPen", "fPart", None), ("pRow[1]", 37, "tPen", "fPart", None),
        ("", 14, "tPen", "fPart", 2),
    ]  # fmt: skip
    assert written(program, 1) == ["366.58", "-390.36", "-359.79", "-179.84", "4.22", "29.87"]
    assert program.targets[0].values == (0.0, -10.5, 100.0, 0.0, 45.25, 0.0)
    first = Configuration(shoulder="front", ranges=((3, 0.0, math.inf), (5, -math.inf, 0.0)))
    assert program.targets[1].configuration == first
    assert program.targets[2].configuration == Configuration()
    assert way(program) == [
        ("joint", "jStart", None), ("linear", "", None), ("linear", "pRow[1]", None), ("linear", "pRow", None),
    ]  # fmt: skip
    assert set(program.frames) == {"fPart"}
    assert program.tools["tPen"].translation == pytest.approx((0.0, 0.0, 0.17))
    assert program.skipped == ()
    assert program.unknown == {}


def test_data_alone_have_their_only_tool() -> None:
    program = sample(VAL3, "points.dtx")
    assert [(t.name, t.form.kind, t.tool, t.values) for t in program.targets] == [
        ("pRs", "pose", "tOnly", (250.125, -100.0, 0.0, 0.0, 0.0, 0.0)),
        ("jRs", "joints", "tOnly", (10.0, 20.0, 150.5, -30.0)),
    ]
    # The shoulder of a SCARA is its elbow: not a word for an arm of six joints.
    assert program.targets[0].configuration == Configuration()
    two = VAL3.read([data(POINT + TOOL + variable("tB", "tool", 'z="1" fatherId="flange[0]"'))])
    assert [s.reason for s in two.skipped] == [
        "pA is used by no move, and it is not known with which tool it is reached"
    ]


def test_points_without_moves_have_the_tool_of_all_moves_and_one_without_father_is_left() -> None:
    more = POINT.replace("pA", "pB") + TOOL + TOOL.replace("tA", "tB") + variable("pC", "pointRx", 'x="1"')
    program = VAL3.read([data(POINT + more), code("movej(pA, tB, mNom)\nmovej(pC, tB, mNom)")])
    assert [(t.name, t.tool) for t in program.targets] == [("pA", "tB"), ("pB", "tB")]
    assert [s.reason for s in program.skipped] == ["pC has no frame"]


def test_skipped_points() -> None:
    for moves, reason in (
        ("movej(pA,tA,m)\nmovel(pA,flange,m)", "is used with several tools, or by no move where moves have several"),
        ("movej(pA,tA[nI],m)", "is reached with a tool that a variable chooses"),
        ("movej(pA,x_tTool,m)", "is reached with a tool that a variable chooses"),
        ("movej(pA,tA,m)\npA = here(tA,world)", "is changed by the program"),
        ("movej(pA,tA,m)\npA[n[2]].trsf.x=1", "is changed by the program"),
        ("movej(pA,tA,m)\nlink(pA,fFrame)", "is changed by the program"),
        ("movej(pA,tA,m)\ncall lib:touch(pA,3)", "is handed to another program"),
        ("movej(pA,tA,m)\n$Xmovej(pA,nTrack,tA,m)", "is handed to another program"),
    ):
        own = '<Parameters><Parameter name="x_tTool" type="tool" /></Parameters>'
        program = VAL3.read([data(POINT + TOOL), code(moves, own)])
        assert program.targets == (), moves
        assert program.moves == (), moves
        assert [s.reason for s in program.skipped if s.source == 0] == [f"pA {reason}"], moves


def test_applications_in_other_folders_have_their_own_names() -> None:
    def of(folder: str, x: str, tool: str) -> list[Source]:
        point = POINT.replace('x="1"', f'x="{x}"')
        both = data(point + TOOL.replace("tA", tool)), code(f"movej(pA,{tool},m)")
        return [Source(Path(folder) / source.path, source.text) for source in both]

    program = VAL3.read([*of("one", "11", "tA"), *of("two", "22", "tB")])
    assert [(t.source, t.name, t.values[0], t.tool) for t in program.targets] == [
        (0, "pA", 11.0, "tA"),
        (2, "pA", 22.0, "tB"),
    ]
    assert [(m.source, m.target) for m in program.moves] == [(1, 0), (3, 1)]
    different = [data(TOOL), Source(Path("b/a.dtx"), data(TOOL.replace("100", "101")).text)]
    with pytest.raises(InputError, match="tA is not the same in two applications"):
        VAL3.read(different)


def test_targets_are_in_the_order_of_the_sources() -> None:
    program = VAL3.read([code("movej(appro(pA,{0,0,1,0,0,0}),tA,m)\nmovel(pA,tA,m)"), data(POINT + TOOL)])
    assert [(t.source, t.name, t.parent) for t in program.targets] == [(0, "", 1), (1, "pA", None)]
    assert [m.target for m in program.moves] == [0, 1]


def test_inches() -> None:
    project = (
        '<Project xmlns="http://www.staubli.com/robotics/VAL3/Project/3"><Parameters millimeterUnit="{}" /></Project>'
    )
    sources = [data(POINT + TOOL), code("movej(pA,tA,m)")]
    inches = VAL3.read([*sources, Source(Path("a.pjx"), project.format("false"))])
    assert inches.targets[0].form.length == 0.0254
    assert inches.targets[0].form.decimals == (5, 4)
    assert inches.tools["tA"].translation == pytest.approx((0.0, 0.0, 2.54))
    millimetres = VAL3.read([*sources, Source(Path("a.pjx"), project.format("true"))])
    assert millimetres.targets == VAL3.read(sources).targets
    assert millimetres.targets[0].form.length == 1e-3


def test_comments_strings_and_comparisons_change_nothing() -> None:
    said = 'putln("a \\" // movel(pA,tB,m)") // movel(pA,tB,m)\n//movel(pA,tB,m) "\nmovel(pA,tA,m)'
    uses = "if pA.trsf.x==1 or nI != 3\nmovej(pA,tA,m)\nendIf\nnI=distance(pA,pA)\nsetFrame(pA,pA,pA,fX)"
    for text in (said, uses):
        program = VAL3.read([data(POINT + TOOL + TOOL.replace("tA", "tB")), code(text)])
        assert [(t.name, t.tool) for t in program.targets] == [("pA", "tA")]
        assert (len(program.moves), program.unknown) == (1, {})


def test_malformed_data_are_refused() -> None:
    for text, what in (
        (POINT + POINT, "line 6: pA is declared twice in one application"),
        (POINT.replace("/>\n", '/>\n<Value key=" 0 " />\n'), "line 5: pA.0. is given twice"),
        (POINT.replace('"3"', '"three"'), "line 4: z of pA is no number"),
        (POINT.replace('"3"', '"1e7"'), "line 4: pA has a number out of all proportion"),
        (POINT.replace('"3"', '"-1e999" a="b"'), "line 4: z of pA is out of all proportion"),
        (POINT.replace("/>\n", ">\n"), "line 5: the file is not complete or not well-formed"),
        (
            variable("fA", "frame", 'x="1" fatherId="fB[0]"') + variable("fB", "frame", 'x="1" fatherId="fA[0]"'),
            "line 4: fA is its own father",
        ),
    ):
        with pytest.raises(InputError, match=f"a.dtx, {what}"):
            VAL3.read([data(text)])


def test_other_texts_and_document_types_are_refused() -> None:
    for put in ('SYSTEM "file:///etc/passwd">', "[<!ENTITY e '1'>]><!-- b -->"):
        text = data(POINT).text.replace("<Database", f"<!-- a --><!DOCTYPE Database {put}\n<Database", 1)
        assert not VAL3.recognizes(text)
        for other in (text, '<?xml version="1.0"?><Database><a/></Database>', "/JOB\n"):
            with pytest.raises(InputError, match=r"a\.dtx: this is no file of a VAL3 application"):
                VAL3.read([Source(Path("a.dtx"), other)])


def test_malformed_code_is_refused() -> None:
    for text, what in (
        ("movej(pA,tA,m", "line 4: a bracket is not closed"),
        ("\nmovel(pA,{0,0,1},m", "line 5: a bracket is not closed"),
        ("movej(pA,tA)", "line 4: movej has 2 arguments"),
        ("movej(appro(pA,{0,0,2e6,0,0,0}),tA,m)", "line 4: an offset is out of all proportion"),
        ("movej(pA,tA,m)\nend\n// and more\nmovej(pA,tA,m)\n//", "line 8: the code is not complete"),
    ):
        source = code(text)
        if "complete" in what:
            source = Source(source.path, source.text.replace("\nend]]>", "]]>"))
        with pytest.raises(InputError, match=f"start.pgx, {what}"):
            VAL3.read([source])
