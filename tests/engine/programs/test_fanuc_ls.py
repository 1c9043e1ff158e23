"""FANUC LS programs.

Syntax from FANUC, R-30iB/R-30iB Mate controller, HandlingTool operator's manual (V9.40), sections 7.2.1 (motion
instructions), 7.2.6 and 11.9 (positions), 7.2.9 (frame numbers), 11.21.2 (configuration) and 12.2.7 (ASCII programs),
by a public repository's notes on it, and from public programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest
from tests.engine.programs.reading import branches, reasons, said, sample, split, way, written

from truearm.engine.base.errors import InputError
from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.fanuc_ls.text import configuration
from truearm.engine.programs.program import Configuration, Program, Skipped, Source, Split
from truearm.engine.robot.library import load_robot

HALF = (-pi, pi)
NUT = Configuration("front", "up", ranges=((1, *HALF), (4, *HALF), (5, -pi, 0.0), (6, *HALF)), literal=True)


def pose(
    number: str | int, data: str = "", head: str = "UF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',", more: str = ""
) -> str:
    data = data or (
        "\tX =   500.000  mm,\tY =     0.000  mm,\tZ =   300.000  mm,\n"
        "\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg"
    )
    return f"P[{number}]{{\n   GP1:\n\t{head}\n{data}{more}\n}};\n"


def program(instructions: Sequence[str], positions: str, attributes: str = "") -> Source:
    lines = "".join(f"{i:4d}:{words} ;\n" for i, words in enumerate(instructions, 1))
    return Source(Path("P.LS"), f"/PROG  P\n/ATTR\n{attributes}/MN\n{lines}/POS\n{positions}/END\n")


def moves(found: Program) -> list[tuple[int, str, str, str | None]]:
    """Return line, kind, target and via of each move."""
    return [(move.line, *one) for move, one in zip(found.moves, way(found), strict=True)]


def test_a_file_of_windows_with_joints_poses_and_frames() -> None:
    found = sample(FANUC_LS, "bracket.ls")
    assert [(t.line, t.name, t.frame, t.tool) for t in found.targets] == [
        (61, "P[1:home]", "2", "3"), (67, "P[2:approach]", "2", "3"), (73, "P[3]", "2", "3"), (79, "P[4]", "2", "3"),
        (85, "P[5]", "2", "3"), (91, "P[6]", "2", "3"), (97, "P[7]", "2", "3"), (109, "P[9]", "2", "3"),
        (115, "P[10]", "", "3"), (121, "P[11]", "2", ""), (133, "P[13]", "2", "3"),
    ]  # fmt: skip
    home, approach, *_ = found.targets
    assert (home.form.kind, home.form.angle, home.values) == ("joints", radians(1), (0.0, -20.0, 15.5, 0.0, -75.5, 0.0))
    assert (approach.form.kind, approach.values) == ("pose", (374.0, -12.25, 80.0, 180.0, -0.003, 30.0))
    assert approach.form.orientation is not None
    assert approach.configuration == NUT
    assert [written(found, row) for row in (0, 1, 10)] == [
        ["0.000", "-20.000", "15.500", ".000", "-75.500", ".000"],
        ["374.000", "-12.250", "80.000", "180.000", "-.003", "30.000"],
        ["430.5", "40", "+120.00000", "-179.500", "90.000", "-170.000"],
    ]
    assert moves(found) == [
        (30, "joint", "P[1:home]", None), (33, "linear", "P[2:approach]", None), (34, "linear", "P[3]", None),
        (36, "linear", "P[4]", None), (37, "circular", "P[6]", "P[5]"), (39, "linear", "P[7]", None),
        (41, "linear", "P[3]", None), (48, "circular", "P[9]", None), (49, "circular", "P[10]", None),
        (50, "circular", "P[11]", None), (55, "linear", "P[13]", None), (59, "joint", "P[1:home]", None),
    ]  # fmt: skip
    assert said(found, 4) == ("C P[5]    \r\n    :  P[6] 80mm/sec CNT100    ;", "P[6]", "P[5]")
    assert found.skipped == (
        Skipped(0, 28, "UFRAME[2] is set here, so where its targets are is not known"),
        Skipped(0, 46, "which position P[R[5]] is, is known only when the program runs"),
        Skipped(0, 47, "PR[2:clear] is a position register, set elsewhere"),
        Skipped(0, 57, "P[77] is not among the positions of this program"),
        Skipped(0, 58, "PAL_1[A_1] is no position of this program"),
        Skipped(0, 103, "P[8] is a step (INC) and no place"),
        Skipped(0, 127, "P[12] is not taught: X is ****"),
        Skipped(0, 140, "P[14] has E1 off zero, and that external axis may carry the robot"),
    )
    assert found.unknown == {"Touch": 1}
    assert found.tools == found.frames == {}


def test_a_file_with_motion_groups_carried_instructions_and_weaving() -> None:
    found = sample(FANUC_LS, "seam.ls")
    assert {t.name: (t.frame, t.tool) for t in found.targets if t.name in ("P[1]", "P[3]", "P[20:unused]")} == {
        "P[1]": ("3", "1"),
        "P[3]": ("1", "1"),
        "P[20:unused]": ("1", "1"),
    }
    assert moves(found) == [
        (20, "linear", "P[1]", None), (23, "joint", "P[3]", None), (28, "linear", "P[4]", None),
        (31, "circular", "P[6]", "P[5]"), (33, "circular", "P[8]", "P[7]"), (38, "circular", "P[11]", None),
        (39, "circular", "P[3]", None), (41, "circular", "P[8]", None),
    ]  # fmt: skip
    assert reasons(found) == [
        (41, "PR[4] is a position register, set elsewhere"),
        (43, "the circle has one position only"),
        (58, "P[2] is for the active user frame, and the program does not say for certain which that is"),
        (106, "P[9] is in a frame that another motion group moves (COORD)"),
        (115, "P[10] is reached with a tool that stands still (RTCP)"),
        (128, "P[12] has no data of motion group 1"),
        (139, "P[21] is for the active user frame, and the program does not say for certain which that is"),
    ]
    assert found.unknown == {"TC_ONLINE": 1, "Weave": 1, "WELD": 1}


def test_a_file_of_a_post_processor_with_a_byte_order_mark_and_carriage_returns() -> None:
    found = sample(FANUC_LS, "wipe.ls")
    assert FANUC_LS.recognizes(found.sources[0].text)
    assert [(t.line, t.name, t.frame, t.tool, t.values[1]) for t in found.targets] == [
        (8, "P[1]", "", "1", 0.0),
        (14, "P[2]", "", "1", 100.0),
        (21, "P[3]", "", "1", 200.0),
    ]
    assert [t.configuration for t in found.targets] == [NUT, NUT, Configuration()]
    assert [move.line for move in found.moves] == [4, 5, 6]


def test_files_are_programs_of_their_own() -> None:
    one, other = (program(["J P[1] 10% FINE"], pose(1)) for _ in range(2))
    found = FANUC_LS.read([one, other])
    assert [(t.source, t.line) for t in found.targets] == [(0, 6), (1, 6)]
    assert [(move.source, move.target) for move in found.moves] == [(0, 0), (1, 1)]
    assert found.moves[0].routine != found.moves[1].routine


def test_what_came_before_a_move_is_known_or_not() -> None:
    for between, is_known in (
        ("DO[1]=ON", True),
        ("!L P[3] 10mm/sec FINE", True),
        ("//CALL AWAY", True),
        ("PR[1]=P[3]", True),
        ("IF R[1]=1,JMP LBL[2]", True),
        ("$SPEED=3", True),
        ("CALL AWAY", False),
        ("IF R[1]=1,CALL AWAY", False),
        ("SELECT R[1]=1,CALL AWAY", False),
        ("LBL[2]", False),
        ("GO HOME", False),
        ("J PR[3] 10% FINE", False),
        ("J P[3] 10% FINE INC", False),
        ("J P[9] 10% FINE", False),
        ("L P[3] 10mm/sec FINE Offset,PR[2]", False),
        ("L P[3] 10mm/sec FINE Skip,LBL[2]", False),
    ):
        found = FANUC_LS.read(
            [program(["L P[1] 10mm/sec FINE", between, "L P[2] 10mm/sec FINE"], pose(1) + pose(2) + pose(3))]
        )
        assert (found.moves[0].routine == found.moves[-1].routine) is is_known, between


def test_the_active_user_frame() -> None:
    for instructions, frame in (
        (["UFRAME_NUM=3", "UTOOL_NUM=2", "L P[1] 10mm/sec FINE"], "3"),
        (["UFRAME_NUM=0", "UTOOL_NUM=2", "L P[1] 10mm/sec FINE"], ""),
        (["UFRAME_NUM[GP1,2]=4", "UTOOL_NUM=2", "L P[1] 10mm/sec FINE"], "4"),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "LBL[1]", "CALL X", "L P[1] 10mm/sec FINE", "JMP LBL[1]"], "3"),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "!UFRAME_NUM=4", "LBL[1]", "L P[1] 10mm/sec FINE"], "3"),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "PR[1]=P[1]"], "3"),
        (["UTOOL_NUM=2", "L P[1] 10mm/sec FINE", "UFRAME_NUM=3"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM[GP2]=4", "L P[1] 10mm/sec FINE"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=R[3]", "L P[1] 10mm/sec FINE"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "$MNUFRAMENUM[1]=R[2]", "L P[1] 10mm/sec FINE"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "IF (R[1]=1),UFRAME_NUM=4", "L P[1] 10mm/sec FINE"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "LBL[1]", "L P[1] 10mm/sec FINE", "UFRAME_NUM=4", "JMP LBL[1]"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "L P[1] 10mm/sec FINE", "UFRAME_NUM=4", "L P[1] 10mm/sec FINE"], None),
        (["UTOOL_NUM=2", "UFRAME_NUM=3", "UFRAME_NUM=4", "PR[1]=P[1]"], None),
    ):
        found = FANUC_LS.read([program(instructions, pose(1, head="UF : F, UT : F,\t\tCONFIG : 'N U T, 0, 0, 0',"))])
        assert [(t.frame, t.tool) for t in found.targets] == ([] if frame is None else [(frame, "2")]), instructions
        assert len(found.skipped) == (frame is None), instructions
        assert all("active user frame" in entry.reason for entry in found.skipped), instructions


def test_joints_do_not_depend_on_frames() -> None:
    """Neither on the active one, nor on one that moves with a conveyor."""
    data = "\tJ1=     0.000 deg,\tJ2=   -20.000 deg,\tJ3=   800.000  mm"
    (target,) = FANUC_LS.read([program(["J P[1] 10% FINE"], pose(1, data, "UF : F, UT : F,"))]).targets
    assert (target.values, target.frame, target.tool) == ((0.0, -20.0, 800.0), "", "")
    attributes = "/APPL\nLINE_TRACK;\n  LINE_TRACK_SCHEDULE_NUMBER      : 2;\n"
    found = FANUC_LS.read([program([], pose(1) + pose(2, data), attributes)])
    assert [t.name for t in found.targets] == ["P[2]"]
    assert reasons(found) == [(8, "P[1] is in a frame that moves with a conveyor (LINE_TRACK)")]


def test_positions_that_are_left() -> None:
    for positions, reason in (
        (pose(1, "\tX =  1.000  mm,\tY =  2.000  mm"), "P[1] has no Z"),
        (pose(1, more=",\n\tX =  1.000  mm"), "P[1] has X twice"),
        (pose(1, more=",\n\tE1=  1.000"), "P[1] has a E1 without mm or deg"),
        (pose(1, "\tX = R[1]"), "P[1] has a X without mm or deg"),
        (pose(1).replace(" mm", "deg"), "P[1] is not in mm and deg"),
        (pose(1, "\tJ1=  1.000 deg,\tJ3=  1.000 deg"), "P[1] has no J2"),
        (pose(1, more=",\n\tJ1=  1.000 deg"), "P[1] has a pose and joints"),
        (pose(1, head="CONFIG : 'N U T, 0, 0, 0',"), "P[1] has no UF and UT"),
        (pose(1, head="UF : 1, UT : 1,\t\tCONFIG : 'N F T, 0, 0, 0',"), "P[1] has a CONFIG that cannot be read"),
        (pose(1).replace("GP1", "GP2"), "P[1] has no data of motion group 1"),
        (pose(1, more="\n   GP1:\n\tUF : 1, UT : 1,\n\tJ1= 0.000 deg"), "P[1] has two groups 1"),
    ):
        found = FANUC_LS.read([program([], positions)])
        assert (found.targets, found.skipped) == ((), (Skipped(0, 5, reason),)), positions


def test_a_step_to_any_position_may_be_each_that_no_other_move_names() -> None:
    found = FANUC_LS.read([program(["L P[1] 9mm/sec FINE", "L P[R[1]] 9mm/sec FINE INC"], pose(1) + pose(2))])
    assert [t.name for t in found.targets] == ["P[1]"]
    assert found.skipped[-1].reason == "P[2] is a step (INC) and no place"


TEXT = program(["J P[1] 10% FINE"], pose(1) + pose(2)).text


def test_what_is_refused() -> None:
    for text, line, what in (
        (TEXT.replace("/PROG", "PROG"), 1, "no section /PROG"),
        (TEXT.replace("/MN", ""), 18, "no section /MN"),
        (TEXT.replace("/END", ""), 18, "no section /END"),
        (TEXT[:-40], 16, "no section /END"),
        (TEXT.replace("};\nP[2]", "\nP[2]"), 6, "no complete position"),
        (TEXT.replace("P[2]{", "Q[2]{"), 12, "no complete position"),
        (TEXT.replace("P[2]{", "P[01]{"), 12, "P[1] appears twice"),
        (TEXT.replace("500.000", "1000001.0"), 9, "out of all proportion"),
    ):
        with pytest.raises(InputError) as refused:
            FANUC_LS.read([Source(Path("P.LS"), text)])
        assert what in refused.value.what, text
        assert refused.value.where == f"P.LS, line {line}", text


def test_configurations() -> None:
    rows: tuple[tuple[str, str | None, str | None, dict[int, tuple[float, float]]], ...] = (
        ("N U T, 0, 0, 0", "front", "up", {1: HALF, 4: HALF, 5: (-pi, 0), 6: HALF}),
        ("FUT,1,-1,0", "front", "up", {1: (pi, 3 * pi), 4: (-3 * pi, -pi), 5: (0, pi), 6: HALF}),
        ("n d t, 0, 0, -2", "front", "down", {1: HALF, 4: HALF, 5: (-pi, 0), 6: (-5 * pi, -3 * pi)}),
        ("F L U B, 0, 0, 0", "back", "down", {1: HALF, 4: HALF, 5: (0, pi), 6: HALF}),
        ("N D B, 0, 0, 0", "back", "up", {1: HALF, 4: HALF, 5: (-pi, 0), 6: HALF}),
        ("N U T", "front", "up", {5: (-pi, 0)}),
        ("R, 0, 0, 0", None, None, {}),
        ("", None, None, {}),
    )
    for text, shoulder, elbow, ranges in rows:
        found = configuration(text)
        assert found is not None, text
        assert (found.shoulder, found.elbow, found.wrist, found.near) == (shoulder, elbow, None, None), text
        assert {joint: pytest.approx((low, high)) for joint, low, high in found.ranges} == ranges, text


def test_configurations_that_cannot_be_read() -> None:
    for text in ("N N T, 0, 0, 0", "U D T, 0, 0, 0", "X U T, 0, 0, 0", "N U T, 0, a, 0", "N U T, 0, 0.5, 0"):
        assert configuration(text) is None, text


#: J1, J4, J5 and J6 [deg] that controllers show with a configuration: "The perils of six-axis robots", onerobotics.com
#: (R-2000iB/165F), and CURPOS.DG files.
SHOWN = [
    ("N U T, 0, 0, 0", (7.962, 77.661, -51.975, -79.273)),
    ("F U T, 0, 0, 0", (7.962, -102.339, 51.975, 100.727)),
    ("F U T, 0, 0, 0", (-8.01, 95.18, 54.12, -4.79)),
    ("N U T, 0, 0, 0", (-70.39, -0.15, -89.38, -19.65)),
    ("N U T, 0, 0, 0", (86.75, 56.19, -81.55, -94.01)),
]


def test_configurations_that_controllers_show() -> None:
    for text, joints in SHOWN:
        found, other = configuration(text), configuration(text.translate(str.maketrans("NF", "FN")))
        assert found is not None, text
        assert other is not None, text
        shown = dict(zip((1, 4, 5, 6), map(radians, joints), strict=True))
        assert all(low <= shown[joint] < high for joint, low, high in found.ranges), text
        assert not all(low <= shown[joint] < high for joint, low, high in other.ranges), text


def test_up_stays_up_when_the_arm_leans_back_over_its_first_axis() -> None:
    robot = load_robot("lrmate200ic")
    # Joint 3 is the angle between upper arm and forearm, which bends forward from 0 to 142 deg and a little before.
    leaning = np.deg2rad([[0, 30, 0, 0, 40, 0], [0, -55, -40, 0, 40, 0]])
    straight = np.deg2rad([[0, 30, -100, 0, 40, 0], [0, -55, -130, 0, 40, 0]])
    for postures, side in ((leaning, "U"), (straight, "D")):
        for name, place in zip(branches(robot, postures), "TB", strict=True):
            found = configuration(f"N {side} {place}, 0, 0, 0")
            assert found is not None
            assert name.startswith(f"{found.shoulder}-{found.elbow}-")


LINE = (374.0, -12.25, -1.0, 180.0, 0.0, 30.0)


def test_a_line_and_a_circle_are_split() -> None:
    found = sample(FANUC_LS, "bracket.ls")
    first, second = (382.5, -12.25, 39.5, 180.0, -0.0015, 30.0), (390.0, -12.25, 20.0, 180.0, 0.0, 30.0)
    via, end, last_via = (
        (431.0, -11.0, -1.0, 180.0, 0.0, 37.0),
        (440.0, -6.0, -1.0, 180.0, 0.0, 47.0),
        (451.0, 9.0, -1.0, 180.0, 0.0, 66.0),
    )
    added = split(FANUC_LS, found, Split(4, ((end, via),), last_via), Split(2, ((first, None), (second, None))))
    lines = added.sources[0].text.split("\r\n")
    assert lines[32:43] == [
        "  10:L P[2:approach] 250mm/sec CNT50    ;",
        "  11:L P[100] R[4:speed]mm/sec CNT100    ;",
        "  12:L P[101] R[4:speed]mm/sec CNT100    ;",
        "  13:L P[3] R[4:speed]mm/sec FINE    ;",
        "  14:  DO[5:spindle]=ON ;",
        "  15:L P[4] 80mm/sec CNT100 ACC80 TB    .10sec,DO[6]=ON    ;",
        "  16:C P[102]    ",
        "    :  P[103] 80mm/sec CNT100    ;",
        "  17:C P[104]    ",
        "    :  P[6] 80mm/sec CNT100    ;",
        "  18:L P[7] 80mm/sec FINE    ;",
    ]
    assert "LINE_COUNT\t= 37;" in lines
    values = {t.name: t.values for t in added.targets}
    assert values["P[100]"] == (382.5, -12.25, 39.5, 180.0, -0.0015, 30.0)
    assert (values["P[101]"], values["P[102]"], values["P[103]"], values["P[104]"]) == (second, via, end, last_via)
    assert {(t.frame, t.tool, t.configuration) for t in added.targets[-5:]} == {("2", "3", NUT)}


def test_what_is_to_happen_once_is_not_said_in_segments() -> None:
    found = sample(FANUC_LS, "bracket.ls")
    lines = split(FANUC_LS, found, Split(3, ((LINE, None),))).sources[0].text.split("\r\n")
    assert lines[35:37] == [
        "  13:L P[100] 80mm/sec CNT100 ACC80    ;",
        "  14:L P[4] 80mm/sec CNT100 ACC80 TB    .10sec,DO[6]=ON    ;",
    ]


def test_instructions_that_a_move_carries_keep_their_numbers() -> None:
    words = [f"J P[{i}] 100% FINE" for i in (1, 2, 1)]
    source = program(["L P[1] 9mm/sec FINE", *words], pose(1) + pose(2))
    carried = "      1:  TC_ONLINE (ON) ;\n      2:  DO[1]=ON ;\n      3:  DO[2]=ON ;\n       ------ ;\n"
    source = replace(source, text=source.text.replace("   3:", carried + "   3:"))
    text = split(FANUC_LS, FANUC_LS.read([source]), Split(0, ((LINE, None),))).sources[0].text
    assert carried in text
    assert f"   2:L P[1] 9mm/sec FINE ;\n   3:J P[1] 100% FINE ;\n{carried}   4:J P[2] 100% FINE ;\n" in text
    assert "\n   5:J P[1] 100% FINE ;\n/POS" in text


def test_lines_without_numbers_stay_without() -> None:
    found = sample(FANUC_LS, "wipe.ls")
    lines = split(FANUC_LS, found, Split(2, ((LINE, None),))).sources[0].text.split("\r")
    assert lines[4:7] == [":L P[2] 100mm/sec CNT50 ;", ": L P[4] 100mm/sec CNT100    ;", ": L P[3] 100mm/sec FINE ;"]
    assert lines[-7:-1] == ["P[4]{", "GP1:", "UF : 0, UT : F,", *lines[-4:-2], "}"]
    assert lines[-4] == "X = 374.000 mm, Y = -12.250 mm, Z = -1.000 mm,"
    assert lines[-3] == "W = 180.0000 deg, P = 0.0000 deg, R = 30.0000 deg"


def test_numbers_of_lines_grow_into_the_blanks_before_them() -> None:
    source = program(["L P[1] 9mm/sec FINE"] * 9 + ["END"], pose(1), "LINE_COUNT = 10;\n")
    found = FANUC_LS.read([source])
    text = split(FANUC_LS, found, *(Split(k, ((LINE, None),)) for k in range(9))).sources[0].text
    assert "\n   9:L P[6] 9mm/sec CNT100    ;\n  10:L P[1] 9mm/sec FINE ;\n" in text
    assert text.count("\n  19:END ;\n") == 1
    assert "LINE_COUNT = 19;" in text


def test_moves_that_are_left_whole() -> None:
    for words, change in (
        ("L P[1] 2.5sec FINE", str),
        ("L P[1] R[3]sec CNT100", str),
        ("L P[1] 9mm/sec FINE Wjnt", str),
        ("L P[1] 9mm/sec FINE Offset,PR[1]", str),
        ("L P[1] 9mm/sec FINE Skip,LBL[1]", str),
        ("L P[1] 9mm/sec FINE\n    :  Arc Start[1]", str),
        ("A P[1] 9mm/sec FINE", str),
        ("C P[2] Tool_Offset,PR[1]\n    :  P[1] 9mm/sec FINE", str),
        ("L P[1] 9mm/sec FINE", lambda text: text.replace("deg\n}", "deg,\n\tE1=   0.000  mm\n}", 1)),
        (
            "L P[1] 9mm/sec FINE",
            lambda text: text.replace("deg\n}", "deg\n   GP2:\n\tUF : 0, UT : 1,\n\tJ1= 1.000 deg\n}", 1),
        ),
    ):
        source = program([words], pose(1) + pose(2))
        source = replace(source, text=change(source.text))
        found = FANUC_LS.read([source])
        is_circle = found.moves[0].kind == "circular"
        cut = Split(0, ((LINE, LINE if is_circle else None),), LINE if is_circle else None)
        assert split(FANUC_LS, found, cut).sources == (source,), words


def test_tools_and_frames_that_the_program_puts_elsewhere_are_named() -> None:
    read = FANUC_LS.read([program(["UTOOL[1]=PR[7]", "PR[7]=UTOOL[1]", "UFRAME[2] = PR[1]"], "")])
    said = "is set here, so where its targets are is not known"
    assert reasons(read) == [(4, f"UTOOL[1] {said}"), (6, f"UFRAME[2] {said}")]
