"""Yaskawa jobs.

The samples follow the job data format of the NX100 and DX100 data transmission manuals (HW0481924 section 4.1,
HW0482494 section 4.1): sections, ``///`` lines, tables C, BC, EC and P, ``RCONF``; instructions as the FS100 INFORM
manual has them. The meaning of flip and no-flip is that of the NX100 operator's manual, "Manipulator types".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import pytest
from tests.engine.programs.reading import reasons, said, sample, split, way

from truearm.engine.base.errors import InputError
from truearm.engine.programs.jbi import JBI
from truearm.engine.programs.program import Configuration, Source, Split
from truearm.engine.robot.transform import FIXED_XYZ_ANGLES


def job(
    table: Sequence[str], instructions: Sequence[str] = (), count: int | None = None, group: str = "RB1"
) -> list[Source]:
    """A job with a table and instructions."""
    steps = sum(line.startswith("C") for line in table) if count is None else count
    head = ["/JOB", "//NAME A", "//POS", f"///NPOS {steps},0,0,0,0,0"]
    lines = [*head, *table, "//INST", f"///GROUP1 {group}", "NOP", *instructions, "END", ""]
    return [Source(Path("a.jbi"), "\n".join(lines))]


PULSES = ("///TOOL 1", "///POSTYPE PULSE", "///PULSE")
POSES = ("///TOOL 1", "///POSTYPE ROBOT", "///RECTAN", "///RCONF 1,0,0,0,0,0")


def test_lines_that_begin_with_slashes_hold_for_what_follows() -> None:
    program = sample(JBI, "weld.jbi")
    found = {t.name: (t.form.name, t.tool, t.frame) for t in program.targets}
    pose = "rectangular position"
    assert found == {
        "C00000": ("pulses", "2", ""),
        "C00001": ("pulses", "2", ""),
        **dict.fromkeys(("C00002", "C00003", "C00004", "C00005", "C00006"), (pose, "2", "3")),
        "C00007": (pose, "0", ""),
        "C00008": (pose, "0", ""),
        "C00009": ("joint angles", "0", ""),
        "C00010": (pose, "2", "3"),
        "P00001": (pose, "2", "3"),
    }
    by_name = {t.name: t for t in program.targets}
    assert by_name["C00001"].values == (31877.0, 12.0, -8801.0, -1020.0, -44012.0, 77.0)
    assert by_name["C00001"].form.decimals == (0, 0)
    assert by_name["C00008"].values == (910.0, 10.5, 614.0, 179.9981, -5.2855, -4.3206)
    assert by_name["C00008"].form.orientation is FIXED_XYZ_ANGLES
    assert by_name["C00009"].values == (10.0, -20.5, 30.25, 0.0, -45.0, 90.0)


def test_moves_and_what_is_left() -> None:
    program = sample(JBI, "weld.jbi")
    assert way(program) == [
        ("joint", "C00000", None), ("joint", "C00001", None), ("linear", "C00002", None), ("linear", "C00003", None),
        ("circular", "C00005", "C00004"), ("linear", "C00006", None), ("joint", "C00007", None),
        ("linear", "P00001", None), ("joint", "C00008", None), ("joint", "C00009", None),
    ]  # fmt: skip
    assert said(program, 4) == ("MOVC C00004 V=46.0\r\nMOVC C00005 V=46.0 FPT", "C00005", "C00004")
    assert said(program, 5)[0] == "MOVL C00006 V=93.5 UNTIL IN#(7)=ON"
    assert reasons(program) == [
        (35, "C00011 is shifted by SFTON when the program runs"),
        (37, "P00002 is the increment of IMOV, not a place"),
        (38, "P00010 is also used by SET"),
        (66, "MOVL: the position is chosen when the program runs"),
        (67, "MOVL P00077: a position variable of the controller"),
        (68, "MOVL C00099: not in the table of positions"),
    ]
    assert program.unknown == {"GRIPX": 1}
    # A label may be reached from elsewhere, and after an unknown move nobody knows where the robot is.
    assert program.moves[1].routine < program.moves[2].routine == program.moves[7].routine < program.moves[8].routine


def test_base_axes_carry_the_robot() -> None:
    program = sample(JBI, "cell/main.jbi", "cell/track.jbi")
    assert [t.name for t in program.targets] == ["C0001", "C0002", "C0003", "C0004", "C0005"]
    assert [(s.source, s.line, s.reason) for s in program.skipped] == [
        (1, 9, "C0000 is in a job whose base axes carry the robot")
    ]
    # Moves of several groups of axes go ways that the robot's positions alone do not tell.
    assert way(program) == [
        ("joint", "C0001", None), ("linear", "C0002", None), ("circular", "C0004", "C0003"),
        ("joint", "C0005", None),
    ]  # fmt: skip
    assert program.targets[4].values == (120.0, -340.0, 560.0, -78.0, 90.0, 1200.0)


def allows(configuration: Configuration, joint: int, degrees: float) -> bool:
    reading = math.radians(degrees)
    inside = all(low <= reading < high for j, low, high in configuration.ranges if j == joint)
    return inside and not any(low <= reading < high for j, low, high in configuration.outside if j == joint)


def configuration(rconf: str) -> Configuration:
    return JBI.read(job([*POSES[:3], f"///RCONF {rconf}", "C00000=1,2,3,4,5,6"])).targets[0].configuration


def test_flip_is_what_the_manual_draws() -> None:
    """Flip: -90 < R <= 90, 270 < R <= 360, -360 < R <= -270; far: beyond 180, or -180 and less."""
    for flip, far, degrees in product((True, False), (True, False), range(-360, 361, 15)):
        found = configuration(f"{int(not flip)},0,0,{int(far)},0,0")
        flipped = -90 < degrees <= 90 or degrees > 270 or degrees <= -270
        turned = not -180 < degrees <= 180
        assert allows(found, 4, degrees) == (flipped == flip and turned == far), (flip, far, degrees)


def test_posture_of_rconf() -> None:
    front = configuration("1,0,0,0,0,1,0,0")
    assert (front.shoulder, front.elbow, front.wrist) == ("front", "up", None)
    assert allows(front, 6, 180.0)
    assert not allows(front, 6, -180.0)
    assert allows(front, 1, 190.0)
    assert not allows(front, 1, 180.0)
    lower, rear = configuration("0,1,0,0,0,0"), configuration("0,1,1,0,1,0")
    assert (lower.shoulder, lower.elbow) == ("front", "down")
    assert (rear.shoulder, rear.elbow) == ("back", None)
    assert not allows(rear, 6, 0.0)
    assert configuration("1,0") == configuration("1,0,7") == Configuration()
    assert configuration("1,0,0").ranges == ()
    # Pulses have none.
    (target,) = JBI.read(job([*PULSES, "///RCONF 1,1,1,1,1,1", "C00000=1,2,3,4,5,6"])).targets
    assert target.configuration == Configuration()


def row(*tags: str) -> list[tuple[str, str, str | None]]:
    """The way of a row of MOVC with tags behind them."""
    table = [*PULSES, *(f"C{i:05d}=1,2,3,4,5,6" for i in range(len(tags)))]
    return way(JBI.read(job(table, [f"MOVC C{i:05d} V=10.0{tag}" for i, tag in enumerate(tags)])))


def test_three_points_are_a_circle() -> None:
    table = [*PULSES, *(f"C{i:05d}=1,2,3,4,5,6" for i in range(3))]
    called = job(table, ["MOVC C00000 V=1.0", "CALL JOB:X", "MOVC C00001 V=1.0", "MOVC C00002 V=1.0"])
    assert [kind for kind, _, _ in way(JBI.read(called))] == ["linear", "linear", "joint"]
    assert row("", "", "") == [("linear", "C00000", None), ("circular", "C00002", "C00001")]
    assert row("", "") == [("linear", "C00000", None), ("joint", "C00001", None)]
    assert row("", "", "", "") == [("linear", "C00000", None), *(("joint", f"C0000{i}", None) for i in (1, 2, 3))]
    assert row("", "", " FPT", "", "") == [
        ("linear", "C00000", None),
        ("circular", "C00002", "C00001"),
        ("circular", "C00004", "C00003"),
    ]


def test_skipped_positions() -> None:
    for table, group, reason in (
        ([*PULSES, "C00000=1,2,3,4"], "RB1", "has 4 numbers, 6 are expected"),
        ([*PULSES, "C00000=1,2,3,4,5,6,7"], "RB1", "moves a seventh axis of the arm too"),
        ([*PULSES, "C00000=1,2,3,4,5,6"], "RB1,RB2", "is in a job of two robots, and it is not known whose it is"),
        (["///POSTYPE MTOOL", "C00000=1,2,3,4,5,6"], "RB1", "is in coordinates of the master tool"),
        (["///POSTYPE USER", "C00000=1,2,3,4,5,6"], "RB1", "is in a user frame whose number is not given"),
    ):
        program = JBI.read(job(table, ["MOVJ C00000 VJ=1.00"], group=group))
        assert program.targets == (), table
        assert program.moves == (), table
        assert [s.reason for s in program.skipped] == [f"C00000 {reason}"], table


def test_a_seventh_number_that_is_zero_is_let_be() -> None:
    (target,) = JBI.read(job([*POSES, "C00000=1,2,3,4,5,6,0.000"])).targets
    assert len(target.places) == len(target.values) == 6


def test_an_indexed_variable_may_be_any() -> None:
    table = [*PULSES, "P00001=1,2,3,4,5,6"]
    program = JBI.read(job(table, ["MOVJ P001 VJ=1.00", "GETS P[I000] $PX001"], count=0))
    assert [s.reason for s in program.skipped] == [
        "P00001 may be changed by an instruction that chooses a position variable by its index"
    ]
    assert len(JBI.read(job(table, ['MSG "P[I000] P001"', "REFP 1 P001"], count=0)).targets) == 1


def test_several_jobs_in_a_file() -> None:
    (first,) = job([*PULSES, "C00000=1,2,3,4,5,6"], ["MOVJ C00000 VJ=1.00"])
    (second,) = job([*POSES, "C00000=7,8,9,1,2,3"], ["MOVL C00000 V=1.0"])
    program = JBI.read([Source(first.path, first.text + second.text)])
    assert [(t.name, t.values[0], t.tool) for t in program.targets] == [("C00000", 1.0, "1"), ("C00000", 7.0, "1")]
    assert [(m.target, m.routine) for m in program.moves] == [(0, 0), (1, 1)]


def refused(sources: list[Source]) -> str:
    with pytest.raises(InputError) as caught:
        JBI.read(sources)
    assert str(caught.value).startswith("a.jbi")
    return str(caught.value)


def test_malformed_tables_are_refused() -> None:
    for table, count, what in (
        (["C00000=1,2,3,4,5,6"], None, "a.jbi, line 5: C00000 stands before any ///POSTYPE"),
        ([*PULSES, "C00000=1,2,3,4,5"], 2, "line 4: the job has 1 positions C and says 2"),
        ([*PULSES, "C00000=1,2,3,4,5,6 7"], None, "line 8: a number is missing or malformed"),
        ([*PULSES, "C00000=1,2,3.5,4,5,6"], None, "line 8: C00000 has a part of a pulse"),
        ([*POSES, "C00000=1,2,-1000001,4,5,6"], None, "line 9: C00000 has a number out of all proportion"),
        ([*PULSES, "C00000=1,2,3,4,5,6", "C00000=1,2,3,4,5,6"], None, "line 9: C00000 is given twice"),
        (["///POSTYPE JOINTS"], None, "line 5: there are no such positions"),
        (["///TOOL one"], None, "line 5: ///TOOL needs a number"),
        ([*PULSES, "1,2,3,4,5,6"], None, "line 8: this is no line of a table of positions"),
        (["///NPOS ,0"], None, "line 5: the number of positions is missing"),
    ):
        assert what in refused(job(table, count=count)), table


def test_incomplete_jobs_are_refused() -> None:
    (source,) = job([*PULSES, "C00000=1,2,3,4,5,6"], ["MOVJ C00000 VJ=1.00"])
    whole = source.text
    for cut, what in (
        (whole.index("END"), "it has no END"),
        (whole.index("//INST"), "it has no line //INST"),
        (whole.index("NAME"), "it has no line //INST"),
        (0, "it has no line /JOB"),
    ):
        assert what in refused([Source(source.path, whole[:cut])])
    without = whole.replace("///NPOS 1,0,0,0,0,0\n", "")
    assert "does not say how many positions" in refused([Source(source.path, without)])


def test_a_line_is_split() -> None:
    before = sample(JBI, "weld.jbi")
    points = (((101.0, -20.5, 5.0, 180.0, 0.0, -45.25), None), ((102.0, 0.12345, -0.0, 180.0, 0.0, -1e-9), None))
    after = split(JBI, before, Split(5, points))
    lines = after.sources[0].text.split("\r\n")
    assert lines[3] == "///NPOS 14,0,0,3,0,0"
    assert lines[35:39] == [
        "///RCONF 0,1,0,1,0,0,0,0",
        "C00012=101.000,-20.500,5.000,180.0000,0.0000,-45.2500",
        "C00013=102.000,0.123,0.000,180.0000,0.0000,0.0000",
        "///RCONF 1,0,0,0,0,0",
    ]
    at = lines.index("\tMOVL C00006 V=93.5 UNTIL IN#(7)=ON")
    assert lines[at - 2 : at] == [f"\tMOVL {name} V=93.5 UNTIL IN#(7)=ON" for name in ("C00012", "C00013")]
    assert {t.name: t.values for t in before.targets}.items() <= {t.name: t.values for t in after.targets}.items()


def test_states_are_as_before_behind_new_positions() -> None:
    table = [*PULSES, "C00000=1,2,3,4,5,6", "///TOOL 7", "///USER 4", "///POSTYPE USER", "///RECTAN"]
    table += ["///RCONF 1,0,0,0,0,0", "C00001=1,2,3,4,5,6", "P00003=9,8,7,6,5,4"]
    whole = JBI.read(job(table, ["MOVL C00000 V=1.0", "MOVL C00001 V=1.0"]))
    numbers = ((10.0, 20.0, 30.4, 40.6, -50.0, 60.0), None)
    after = split(JBI, whole, Split(1, (numbers,)), Split(0, (numbers,)))
    targets = {t.name: t for t in after.targets}
    assert targets["C00002"].values == (10.0, 20.0, 30.0, 41.0, -50.0, 60.0)
    assert (targets["C00002"].form.kind, targets["C00002"].tool) == ("pulses", "1")
    assert (targets["C00003"].form.kind, targets["C00003"].tool, targets["C00003"].frame) == ("pose", "7", "4")
    assert (targets["P00003"].form.kind, targets["P00003"].tool, targets["P00003"].frame) == ("pose", "7", "4")
    assert [name for _, name, _ in way(after)] == ["C00002", "C00000", "C00003", "C00001"]
    assert "C00002=10,20,30,41,-50,60\n" in after.sources[0].text


def test_a_circle_is_split() -> None:
    numbers = {name: tuple(float(i + k) for k in range(6)) for i, name in enumerate(("v", "p", "w"))}
    whole = sample(JBI, "cell/main.jbi", "cell/track.jbi")
    after = split(JBI, whole, Split(2, ((numbers["p"], numbers["v"]),), numbers["w"]))
    assert way(after)[1:5] == [
        ("linear", "C0002", None), ("circular", "C0007", "C0006"), ("linear", "C0008", None),
        ("linear", "C0009", None),
    ]  # fmt: skip
    assert way(after)[5] == ("circular", "C0004", "C0003")
    targets = {t.name: t for t in after.targets}
    assert targets["C0006"].values == numbers["v"]
    assert targets["C0007"].values == targets["C0008"].values == targets["C0009"].values == numbers["p"]
    assert targets["C0003"].values == numbers["w"]
    assert "///NPOS 10,2,1,0,0,0" in after.sources[1].text
    assert after.sources[0] == whole.sources[0]
    # The line to a circle is split by lines.
    lines = split(JBI, whole, Split(1, (((1.0,) * 6, None),)))
    assert way(lines)[1:4] == [("linear", "C0006", None), ("linear", "C0002", None), ("circular", "C0004", "C0003")]
