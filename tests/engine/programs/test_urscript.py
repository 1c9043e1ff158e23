"""URScript: what is found in scripts, what is refused or left, and split moves.

Syntax and meaning are those of Universal Robots, The URScript Programming Language (script manual, e-Series): "Module
motion" (movej, movel, movep, movec), "Module internals" (get_inverse_kin, set_tcp), "Module urmath" (pose_trans,
pose_add), "Scoping rules", "Threads", "Program Label". The samples are written after exports of PolyScope (two
variables a waypoint), after those of offline programming (a frame and a TCP a routine) and as people write by hand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.engine.programs.reading import reasons, said, sample, split, written

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import Program, Source, Split
from truearm.engine.programs.program_poses import poses_of
from truearm.engine.programs.urscript import URSCRIPT

TCP = "set_tcp(p[0, 0, 0.1, 0, 0, 0])\n"


def read(text: str) -> Program:
    return URSCRIPT.read([Source(Path("a.script"), text)])


def test_waypoints_of_an_export() -> None:
    program = sample(URSCRIPT, "palletizing.script")
    assert [(t.line, t.name, t.form.kind, t.tool, t.frame) for t in program.targets] == [
        (17, "Home_q", "joints", "Gripper", ""), (18, "Waypoint_1_p", "pose", "Gripper", ""),
        (20, "Waypoint_2_p", "pose", "Gripper", ""), (22, "Corner_p", "pose", "Gripper", "Pallet"),
        (23, "Arc_via_p", "pose", "Gripper", ""), (24, "Arc_end_p", "pose", "Gripper", ""),
        (43, "", "pose", "Gripper", ""),
    ]  # fmt: skip
    home, first, second = program.targets[:3]
    assert home.values == (-1.5708, -1.6, -1.9, -1.2, 1.5708, 0.0)
    assert second.values == (0.433025361705, -0.267959205379, 0.202310714714, 3.12145, 0.021427297251, 0.030987104689)
    assert written(program, 6) == [".45", "-.2", ".25", "3.12", ".01", "0"]
    near = first.configuration.near
    assert near is not None
    assert near[:2] == (-0.5942498207092285, -1.6684614620604457)
    assert near[2:] == (1.9330504576312464, -1.8718423169902344, -1.5709004402160645, 0.0036344528198242188)
    assert {t.configuration.near for t in program.targets[2:]} == {None}
    # Units are metres and radians.
    assert (home.form.angle, first.form.length, first.form.angle) == (1.0, 1.0, 1.0)
    assert home.form.decimals == first.form.decimals == (6, 6)
    turned = Rotation.from_rotvec(first.values[3:]).as_matrix()
    assert poses_of(program)[1, :3, :3] == pytest.approx(turned, abs=1e-12)
    assert [(m.kind, m.target, m.via, m.line) for m in program.moves] == [
        ("joint", 0, None, 28), ("joint", 1, None, 30), ("linear", 2, None, 33), ("linear", 1, None, 36),
        ("linear", 3, None, 41), ("linear", 6, None, 43), ("circular", 5, 4, 44),
    ]  # fmt: skip
    assert program.tools["Gripper"].translation == (0.0, 0.0, 0.17425)
    assert program.frames["Pallet"].translation == (0.4123, -0.3551, 0.021)
    assert program.frames["Pallet"].quaternion == pytest.approx((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    assert program.skipped == ()
    assert program.unknown == {"force_mode": 1, "speedl": 1}


def test_frames_and_tcps_of_routines_with_dos_line_ends() -> None:
    program = sample(URSCRIPT, "milling.script")
    assert [t.line for t in program.targets] == [11, 12, 17, 18, 19, 19, 20]
    assert [t.tool for t in program.targets] == ["tcp"] * 2 + ["tcp 2"] * 5
    assert [t.frame for t in program.targets] == ["", "ref_frame"] + ["ref_frame 2"] * 4 + [""]
    assert program.tools["tcp 2"].quaternion == pytest.approx((np.sqrt(0.5), -np.sqrt(0.5), 0, 0), abs=1e-6)
    assert program.frames["ref_frame 2"].rotation == pytest.approx(
        Rotation.from_rotvec([0, 0, 0.785398]).as_matrix(), abs=1e-12
    )
    assert program.unknown == {"SpindleOff": 1}
    statement, target, _ = said(program, 1)
    assert statement.startswith("movel(pose_trans(ref_frame,p[0.010000,")
    assert statement.endswith("accel_mss,speed_ms,0,0.000)")
    assert target == "p[0.010000, 0.182525, 0.121866, 3.141593, 0.000000, 0.000000]"


def test_an_orientation_that_a_circle_does_not_need_is_that_of_its_end_and_not_written() -> None:
    program = sample(URSCRIPT, "milling.script")
    circle = program.moves[4]
    assert (circle.kind, circle.target, circle.via) == ("circular", 5, 4)
    via, end = program.targets[4], program.targets[5]
    assert via.values == (0.145355, 0.197170, 0.021866, *end.values[3:])
    assert written(program, 4) == ["0.145355", "0.197170", "0.021866", None, None, None]


def test_offsets_mean_what_the_manual_says() -> None:
    program = sample(URSCRIPT, "handling.urscript")
    assert [t.name for t in program.targets] == ["home", "grip", "place", "grip_pre", "", ""]
    assert [t.line for t in program.targets] == [8, 9, 10, 13, 17, 27]
    assert [(t.parent, t.turned) for t in program.targets[3:5]] == [(1, True), (1, False)]
    assert written(program, 2) == ["+0.30", "0.25", "5.0E-2", "0", "3.1415", "0"]
    poses = poses_of(program)
    turned = Rotation.from_rotvec([3.1415, 0, 0]).as_matrix()
    assert poses[3, :3, 3] == pytest.approx(np.array([0.4, -0.1, 0.05]) + turned @ [0, 0, -0.1])
    assert poses[3, :3, :3] == pytest.approx(turned)
    assert poses[4, :3, 3] == pytest.approx([0.4, -0.1, 0.2])
    assert poses[4, :3, :3] == pytest.approx(turned)
    # An offset that several targets share stays as it is, and those move.
    assert [m.target for m in program.moves] == [0, 3, 1, 4, 2, 2, 1, 5]
    assert [m.line for m in program.moves] == [14, 15, 16, 17, 18, 19, 24, 27]
    assert reasons(program) == [
        (25, "it is computed by above"),
        (26, "it depends on where the robot is"),
        (28, "its numbers are computed"),
    ]


def test_pose_add_turns_as_well() -> None:
    program = read(f"{TCP}a = p[0.4, 0, 0.3, 3.1, 0.1, 0]\nmovel(a)\nmovel(pose_add(a, p[0.1, 0, 0, 0, 0.2, 0.3]))\n")
    pose = poses_of(program)[1]
    turned = Rotation.from_rotvec([3.1, 0.1, 0]) * Rotation.from_rotvec([0, 0.2, 0.3])
    assert pose[:3, 3] == pytest.approx([0.5, 0, 0.3])
    assert pose[:3, :3] == pytest.approx(turned.as_matrix())


def test_an_offset_within_a_frame_is_in_the_axes_of_the_frame() -> None:
    program = read(
        f"{TCP}table = p[1, 0, 0, 0, 0, 1.5707963267948966]\na = p[0.1, 0, 0, 0, 0, 0]\nmovel(pose_trans(table, a))\n"
        "movel(pose_trans(table, pose_add(a, p[0, 0.2, 0, 0, 0, 0])))\n"
    )
    assert [(t.frame, t.parent) for t in program.targets] == [("table", None), ("table", 0)]
    assert poses_of(program)[1, :3, 3] == pytest.approx([0.1, 0.2, 0])


def test_a_pose_that_only_others_stand_on_is_a_frame() -> None:
    program = read(
        f"{TCP}corner = p[0.5, 0, 0, 0, 0, 0]\nmovel(pose_trans(corner, p[0, 0.1, 0, 0, 3, 0]))\n"
        "movel(pose_trans(p[0.7,  0, 0, 0, 0, 0], p[0, 0.2, 0, 0, 3, 0]))\n"
        "movel(pose_trans(Plane_1, p[0, 0.3, 0, 0, 3, 0]))\n"
    )
    assert [t.frame for t in program.targets] == ["corner", "p[0.7, 0, 0, 0, 0, 0]", "Plane_1"]
    assert list(program.frames) == ["corner", "p[0.7, 0, 0, 0, 0, 0]"]


def test_ways_to_say_the_same() -> None:
    for script in (
        "movel(p[1,2,.3,0,0,0], a=1.2)",
        "movel(a=1.2, pose=p[1,2,.3,0,0,0])",
        "movel( p[ 1 , 2 ,\n .3, # three\n 0,0,0 ] )",
        "if True: movel(p[1,2,.3,0,0,0])\nend",
        "movep(get_inverse_kin(p[1,2,.3,0,0,0]), 1.2, 0.25)",
        "optimovel(p[1,2,.3,0,0,0], a=0.4, v=0.6)",
        'q = get_inverse_kin(p[1,2,.3,0,0,0], tcp="active_tcp")\nmovel(q)',
        "a = p[1,2,.3,0,0,0]\nb = a\nmovel(b)",
    ):
        program = read(TCP + script)
        assert program.skipped == (), script
        (target,) = program.targets
        assert target.values == (1, 2, 0.3, 0, 0, 0), script
        assert [word and float(word) for word in written(program, 0)] == [1, 2, 0.3, 0, 0, 0], script
        assert [move.kind for move in program.moves] == ["linear"], script


def test_every_assignment_is_a_target_and_the_text_says_which_one_a_move_means() -> None:
    program = read(
        f"{TCP}wp = p[.1,.2,.3,0,3,0]\nmovel(wp)\nwhile True:\n"
        "  wp = p[.1,.2,.4,0,3,0]\n  movel(wp)\n  wp = p[.1,.2,.5,0,3,0]\nend\n"
    )
    assert [t.values[2] for t in program.targets] == [0.3, 0.4, 0.5]
    assert [m.target for m in program.moves] == [0, 1]
    assert program.skipped == ()


def test_variables_have_the_scope_of_the_manual() -> None:
    program = read(
        f"def prog():\n  {TCP}  global a = p[.1,0,0,0,3,0]\n"
        "  def one():\n    local a = p[.2,0,0,0,3,0]\n    movel(a)\n  end\n"
        "  def two():\n    a = p[.3,0,0,0,3,0]\n    movel(a)\n  end\n  one()\n  two()\n  movel(a)\nend\n"
    )
    assert [t.values[0] for t in program.targets] == [0.1, 0.2, 0.3]
    assert [m.target for m in program.moves] == [1, 2, 2]


def test_numbers_that_no_move_uses_are_no_targets() -> None:
    program = read(
        f"{TCP}set_gravity([0, 0, 9.82])\nforces = [0, 0, 10, 0, 0, 0]\npulses = [100000, 0, 0, 0, 0, 0]\n"
        "spare = p[.1,.2,.3,0,0,0]\n"
        'textmsg(spare)\nspeedj([.1,.1,.1,0,0,0], 1, 1)\nx = "p[.1,.2,.3,0,0,0]"\nmovel(p[.4,.2,.3,0,3,0])\n'
    )
    assert [t.line for t in program.targets] == [9]
    assert program.skipped == ()
    assert program.unknown == {"speedj": 1}


def test_before_the_first_set_tcp_it_is_another_tool() -> None:
    program = read(
        f"movej([0,0,0,0,0,0])\n{TCP}movej([1,0,0,0,0,0])\nset_tcp(p[0,0,0,0,0,0])\n"
        f"movej([2,0,0,0,0,0])\n{TCP}movej([3,0,0,0,0,0])\n"
    )
    assert [t.tool for t in program.targets] == ["tcp before set_tcp", "tcp", "tcp 2", "tcp"]
    assert program.tools["tcp 2"].translation == (0.0, 0.0, 0.0)
    without = read("def a():\n  movej([0,0,0,0,0,0])\n  movel(p[.1,.2,.3,0,0,0])\nend\n")
    assert ({t.tool for t in without.targets}, without.tools) == ({"tcp"}, {})


def test_the_tool_is_called_as_the_script_calls_it() -> None:
    program = read(
        "probe = p[0,0,.1,0,0,0]\nset_tcp(probe)\nmovej([0,0,0,0,0,0])\nset_tcp(saw)\nmovej([1,0,0,0,0,0])\n"
    )
    assert [t.tool for t in program.targets] == ["probe", "saw"]
    assert list(program.tools) == ["probe"]


def test_routines_begin_with_the_tool_of_their_calls_and_leave_theirs() -> None:
    program = read(
        "def a():\n  set_tcp(p[0,0,.1,0,0,0])\nend\ndef b():\n  set_tcp(p[0,0,.2,0,0,0])\nend\n"
        "def go():\n  movej([0,0,0,0,0,0])\nend\n"
        "def main():\n  a()\n  movej([1,0,0,0,0,0])\n  b()\n  go()\n  movej([2,0,0,0,0,0])\nend\nmain()\n"
    )
    assert [t.tool for t in program.targets] == ["tcp 2", "tcp", "tcp 2"]


def test_routines_that_call_themselves_end() -> None:
    program = read(f"def a():\n  movej([0,0,0,0,0,0])\n  b()\nend\ndef b():\n  a()\nend\n{TCP}a()\n")
    assert [t.tool for t in program.targets] == ["tcp"]
    calls = "".join(f"def f{i}():\n  f{i + 1}()\nend\n" for i in range(3000))
    assert read(f"{calls}{TCP}f0()\nmovej([0,0,0,0,0,0])\n").targets[0].tool == "tcp"


A = "a = p[.1,.2,.3,0,0,0]\n"
HERE = "p[0,0,0,0,0,1]"
NOBODY = "wp is assigned, and no move is known to go there"


def test_what_stays_as_it_is() -> None:
    for script, line, reason in (
        ("movel(Waypoint_9)", 2, "Waypoint_9 is not declared in this program"),
        ("def f(a):\nmovel(a)\nend\nf(p[.1,.2,.3,0,0,0])", 3, "a is an argument of its routine"),
        ("movel(p[d2r(1), 0, 0, 0, 0, 0])", 2, "its numbers are computed"),
        ("movel(p[.1, .2, .3])", 2, "it has 3 numbers, not six"),
        ("a = [p[.1,.2,.3,0,0,0]]\nmovel(a[0])", 3, "it is taken from a list"),
        (f"{A}a[2] = .4\nmovel(a)", 4, "the numbers of a are changed one by one"),
        ("movel(p[.1,.2,.3,0,0,0] + 1)", 2, "it is computed"),
        ("movej(interpolate_pose(a, b, .5))", 2, "it is computed by interpolate_pose"),
        ("movel(pose_trans(get_actual_tcp_pose(), p[0,0,.1,0,0,0]))", 2, "it depends on where the robot is"),
        ("movel(get_inverse_kin(p[.1,.2,.3,0,0,0], tcp=p[0,0,.1,0,0,0]))", 2, "get_inverse_kin has a TCP of its own"),
        ("movel(get_inverse_kin(x))", 2, "x is not declared in this program"),
        ("movel(pose_trans(t))", 2, "it is computed"),
        ("movel(pose_trans(t, [0,0,0,0,0,0]))", 2, "joints stand in no frame"),
        (f"movel(pose_trans(t, get_inverse_kin({HERE})))", 2, "joints stand in no frame"),
        (f"movel(pose_trans(t, pose_trans(u, {HERE})))", 2, "its frame stands in another frame"),
        (f"movel(pose_trans([0,0,0,0,0,1], {HERE}))", 2, "its frame is given by joints"),
        (f"movel(pose_add([0,0,0,0,0,1], {HERE}))", 2, "it is an offset from joints"),
        (f"movel(pose_add({HERE}, [0,0,0,0,0,1]))", 2, "it is an offset by joints"),
        (f"def f(t):\nmovel(pose_trans(t, {HERE}))\nend", 3, "its frame t is an argument of its routine"),
        (f"movel(pose_add(pose_trans(t, {HERE}), {HERE}))", 2, "it is an offset in the axes of the base from a target"),
        (
            f"t = p[1,0,0,0,0,0]\ndef f():\nmovel(pose_trans(t, {HERE}))\nend\nt = p[2,0,0,0,0,0]",
            4,
            "its frame t is assigned more than once, in another routine",
        ),
        (f"{A}while True:\na = pose_trans(a, {HERE})\nmovel(a)\nend", 5, "a is computed from what changes later"),
        (f"movec(p[.1,0,0,0,0,0], {HERE}, mode=1)", 2, "the orientation at its end follows from the circle (mode)"),
        ("movec(p[.1,0,0,0,0,0])", 2, "movec does not say where to"),
        ("movel()", 2, "movel does not say where to"),
        ("movec(p[.1,0,0,0,0,0], [0,0,0,0,0,1])", 2, "a circle passes it in an orientation that the program does not"),
        (f"movec(x, {HERE})", 2, "what the circle passes stays as it is: x is not declared in this program"),
        ("set_tcp(p[0,0,x,0,0,0])\nmovel(p[.1,.2,.3,0,0,0])", 3, "its TCP is computed"),
        (
            f"{A}movej(get_inverse_kin(a, [0,0,0,0,0,0]))\nmovej(get_inverse_kin(a, [1,0,0,0,0,0]))",
            2,
            "moves reach it near to different joints",
        ),
        (f"{A}movel(a)\nset_tcp(p[0,0,0,0,0,0])\nmovel(a)", 2, "moves reach it with several TCPs: tcp, tcp 2"),
        (f"{A}movel(a)\nmovel(pose_trans(t, a))", 2, "it is used in two frames, or as a target and as an offset"),
        (f"{A}movel(pose_trans(t, a))\nmovel(pose_trans(a, {HERE}))", 2, "it is a frame of other targets"),
        (f"wp = {HERE}\nmovel(wp)\nwp = get_actual_tcp_pose()\nwp = p[.2,0,0,0,3,0]", 5, NOBODY),
        (f"wp = {HERE}\nmovel(wp)\nset_tcp({HERE})\nmovej([0,0,0,0,0,0])\nwp = p[.2,0,0,0,3,0]", 6, NOBODY),
    ):
        assert any(at == line and why.startswith(reason) for at, why in reasons(read(TCP + script))), script


def test_an_offset_of_a_target_that_stays_stays_too() -> None:
    text = f"{TCP}a = p[.1,.2,.3,0,0,0]\nmovel(a)\nmovel(pose_trans(a, p[0,0,.1,0,0,0]))\n"
    text += "set_tcp(p[0,0,0,0,0,0])\nmovel(a)\n"
    program = read(text)
    assert program.targets == ()
    assert reasons(program)[1] == (4, "it is an offset from a target that stays as it is")


def test_with_a_computed_offset_the_target_itself_is_corrected() -> None:
    program = read(f"{TCP}a = p[.1,.2,.3,0,0,0]\nmovel(a)\nmovel(pose_trans(a, p[0,0,-h,0,0,0]))\nmovel(a)\n")
    assert len(program.targets) == 1
    assert program.skipped == ()
    assert [m.target for m in program.moves] == [0, 0, 0]
    # Where it really goes is not known: it cannot be split, and what follows has no start.
    assert program.moves[1].target_text == (0, 0)
    assert [m.routine for m in program.moves] == [0, 0, 1]
    beyond = read(f"{TCP}a = p[.1,.2,.3,0,0,0]\nmovel(a)\nmovel(pose_trans(pose_trans(a, x()), p[0,0,.1,0,0,0]))\n")
    assert len(beyond.targets) == 1
    assert [m.target for m in beyond.moves] == [0, 0]


def test_moves_follow_each_other_only_where_nothing_comes_between() -> None:
    one = "movel(p[.1,.2,.3,0,0,1])\n"
    program = read(
        f"def f():\n{TCP}{one}{one}sleep(1)\n{one}if (x):\n{one}{one}else:\n{one}end\n{one}movel(unknown)\n{one}"
        f"g()\n{one}speedl([0,0,0,0,0,0])\n{one}end\ndef g():\n{one}end\n"
    )
    routines = [m.routine for m in program.moves]
    groups = [[m.line for m in program.moves if m.routine == number] for number in dict.fromkeys(routines)]
    assert groups == [[3, 4, 6], [8, 9], [11], [13], [15], [17], [19], [22]]
    assert routines == sorted(routines)


def test_files_are_programs_of_their_own() -> None:
    texts = [
        f"a = p[.1,.2,.3,0,0,0]\n{TCP}movel(a)\n",
        "set_tcp(p[0,0,.2,0,0,0])\nmovel(a)\nmovel(p[.1,.2,.3,0,0,0])\n",
    ]
    program = URSCRIPT.read([Source(Path(f"{i}.script"), text) for i, text in enumerate(texts)])
    assert [(t.source, t.tool) for t in program.targets] == [(0, "tcp"), (1, "tcp 2")]
    assert [(one.source, one.line) for one in program.skipped] == [(1, 2)]
    assert len({m.routine for m in program.moves}) == 2


def test_what_is_refused() -> None:
    for text, line, what in (
        ('def a():\n  textmsg("no end)\nend\n', 2, "string"),
        ("def a():\n  movel(p[.1,.2,.3,0,\n", 2, "not closed"),
        ("def a():\n  while True:\n    movel(p[.1,.2,.3,0,0,0])\nend\n", 1, "this def has no end"),
        ("def a():\n  movel(p[.1,.2,.3,0,0,0]))\nend\n", 2, "closes no bracket"),
        ("def a():\n  movel(p[.1,.2,.3,0,0,0)]\nend\n", 2, "closes no bracket"),
        ("movel(p[.1,2000,.3,0,0,0])", 1, "out of all proportion"),
        ("movel(p[.1,1e999,.3,0,0,0])", 1, "out of all proportion"),
        ("movej([0,0,0,0,0,-1e5])", 1, "out of all proportion"),
        ("\n\nset_tcp(p[0,0,174.25,0,0,0])\na = p[0,0,1742.5,0,0,0]\nmovel(a)", 4, "out of all proportion"),
        ("a = p[0,0,1742.5,0,0,0]\nmovel(pose_trans(a, p[0,0,0,0,0,1]))", 1, "out of all proportion"),
        ("set_tcp(p[0,0,1742.5,0,0,0])", 1, "out of all proportion"),
        ("movej(get_inverse_kin(p[.1,.2,.3,0,0,0],[0,9e9,0,0,0,0]))", 1, "out of all proportion"),
    ):
        with pytest.raises(InputError, match=what) as caught:
            read(text)
        assert caught.value.where == f"a.script, line {line}", text


def test_deep_and_round_texts_are_read() -> None:
    for text in (
        "a = b\nb = a\nmovel(pose_trans(a, p[0,0,0,0,0,1]))",
        "movel(" + "pose_trans(a," * 3000 + "b" + ")" * 3000 + ")",
        "movel(" + "pose_add(" * 3000 + "b" + ",b)" * 3000 + ")",
        "a0 = p[0,0,0,0,0,1]\n" + "".join(f"a{i + 1} = a{i}\n" for i in range(3000)) + "movel(a3000)",
        "movel(p[" + "1" * 20000 + ", 0, 0, 0, 0, x])",
        "end\nend\nmovel",
    ):
        assert read(TCP + text).targets == (), text[:40]


def test_a_line_in_a_frame_is_split_into_calls_with_a_small_blend() -> None:
    program = sample(URSCRIPT, "milling.script")
    points = tuple(((x, 0.182525, 0.021866, 1.688324, -0.808544, -1.688324), None) for x in (0.05, 0.08))
    again = split(URSCRIPT, program, Split(3, points))
    assert again.sources[0].text.split("\r\n")[17] == (
        "    movel(pose_trans(ref_frame,p[0.050000, 0.182525, 0.021866, 1.688324, -0.808544, -1.688324]),"
        "accel_mss,speed_ms,0,0.001000)"
    )
    assert [t.values[0] for t in again.targets] == [2.851030, 0.01, 0.01, 0.05, 0.08, 0.11, 0.145355, 0.16, 2.852339]
    # The radius of a circle is the argument after v.
    turned = (1.688324, -0.808544, -1.688324)
    ends = ((0.145355, 0.19717, 0.021866, *turned), (0.129134, 0.186331, 0.021866, *turned))
    round_ = split(URSCRIPT, program, Split(4, (ends,), (0.156194, 0.213391, 0.021866, *turned)))
    assert round_.sources[0].text.count(",accel_mss,speed_ms,0.001000)") == 1


def test_named_targets_joints_and_offsets_are_split() -> None:
    text = (
        f"def f():\n  {TCP}  a = p[0.1,0.2,0.3,0,3,0]\n  movel([0,0,0,0,0,0], v=0.1)\n  movel(a, # go\n    v=0.1)\n"
        "  movel(pose_trans(a, p[0,0,0.1,0,0,0]), v=0.1)\nend\n"
    )
    program = read(text)
    via = (0.1, 0.2, 0.25, 0.0, -3.0, -0.0)
    made = split(
        URSCRIPT,
        program,
        Split(0, (((1.0, 2.0, 3.0, 0.0, 0.0, 0.0), None),)),
        Split(1, ((via, None),)),
        Split(2, ((via, None),)),
    )
    assert made.sources[0].text == (
        f"def f():\n  {TCP}  a = p[0.1,0.2,0.3,0,3,0]\n"
        "  movel([1.000000, 2.000000, 3.000000, 0.000000, 0.000000, 0.000000], v=0.1, r=0.001000)\n"
        "  movel([0,0,0,0,0,0], v=0.1)\n"
        "  movel(p[0.100000, 0.200000, 0.250000, 0.000000, -3.000000, 0.000000], # go\n    v=0.1, r=0.001000)\n"
        "  movel(a, # go\n    v=0.1)\n"
        "  movel(p[0.100000, 0.200000, 0.250000, 0.000000, -3.000000, 0.000000], v=0.1, r=0.001000)\n"
        "  movel(pose_trans(a, p[0,0,0.1,0,0,0]), v=0.1)\nend\n"
    )


def test_moves_that_cannot_be_split_stay() -> None:
    for move in (
        "movej(p[0.2,0,0.3,0,3,0])",
        "movel(p[0.2,0,0.3,0,3,0], t=2)",
        "movel(p[0.2,0,0.3,0,3,0], 1.2, 0.25, time)",
        "movel(p[0.2,0,0.3,0,3,0], r=0.05)",
        "movel(p[0.2,0,0.3,0,3,0], r=radius())",
        "movep(p[0.2,0,0.3,0,3,0], 1, 1, wide)",
        "a = p[0.1,0,0.3,0,3,0]\nmovel(a)\nmovel(pose_trans(a, p[0,0,h,0,0,0]))",
        "b = pose_trans(table, p[0.2,0,0.3,0,3,0])\nmovel(b)",
        "movec(x, p[0.2,0,0.3,0,3,0])",
        "movep(p[0.1,0,0.3,0,3,0], r=0.05)\nmovel(p[0.2,0,0.3,0,3,0])",
    ):
        program = read(f"{TCP}wide = 0.04\n{move}\n")
        points = tuple(((x, 0.0, 0.3, 0.0, 3.0, 0.0), None) for x in (0.16, 0.18))
        last = len(program.moves) - 1
        assert split(URSCRIPT, program, Split(last, points)).sources == program.sources, move


def test_variables_tell_times_and_radii() -> None:
    program = read(f"{TCP}narrow = 0.004\nnow = 0\nmovel(p[0.2,0,0.3,0,3,0], 1.2, 0.25, now, narrow)\n")
    points = tuple(((x, 0.0, 0.3, 0.0, 3.0, 0.0), None) for x in (0.16, 0.18))
    assert split(URSCRIPT, program, Split(0, points)).sources[0].text.count("now, 0.001000)") == 2
