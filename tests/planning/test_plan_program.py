"""The program that drives a plan: read back by the own reader, its speeds and waits, and run by the moving twin."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.plan_tours import a_tour

import truearm
from truearm.engine.motion.tour import Tour
from truearm.engine.programs import BY_NAME, joint_speeds
from truearm.engine.programs.joint_speeds import fastest_point, first_shares, joint_rates, known_speeds, speed_notices
from truearm.engine.programs.new_program import LONGEST_COMMENT, JointMove, MotionProgram, Wait, percent
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.urscript.new import FASTEST
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import truth_twin
from truearm.iso9283.simulating.moving_arm import DRIVES, MovingArm, joint_move, last_moves
from truearm.planning.plan_program import LONGEST_LABEL, Driving, plan_program, shown_speed

ROBOTS = {"rapid": "irb1600", "krl": "kr5", "fanuc-ls": "lrmate200ic"}
ROBOTS |= {"urscript": "ur5e", "inform": "gp7", "val3": "tx2_60"}
WAITS = ("time", "input", "operator")


@cache
def toured(name: str, approach: bool) -> tuple[Robot, Tour]:
    return a_tour(load_robot(ROBOTS[name]), approach=approach)


@cache
def driven_by(name: str, driving: Driving | None = None, *, approach: bool = True) -> tuple[Robot, Tour, MotionProgram]:
    robot, tour = toured(name, approach)
    driving = driving or Driving(wait="input", input="3")
    return robot, tour, plan_program(tour, robot, BY_NAME[name].name, driving, "0123456789ab")[0]


def text_of(name: str, program: MotionProgram) -> str:
    motion = BY_NAME[name].motion
    assert motion is not None
    return "\n".join(motion(program).values())


def read_again(name: str, program: MotionProgram) -> Program:
    motion = BY_NAME[name].motion
    assert motion is not None
    sources = [Source(Path(file), text) for file, text in motion(program).items()]
    assert all(source.text.isascii() for source in sources)
    return BY_NAME[name].read(sources)


def commanded(program: Program, count: int) -> Array:
    """Return the joint positions of all moves as the controller takes them ``(moves, count)`` [rad or m]."""
    targets = [program.targets[move.target] for move in program.moves]
    assert {target.form.kind for target in targets} == {"joints"}
    return np.array([target.values[:count] for target in targets]) * targets[0].form.angle


def visited(program: Program) -> list[str]:
    """Return the comment above each move."""
    called = []
    for move in program.moves:
        lines = program.sources[move.source].text.splitlines()[: move.line - 1]
        called.append(
            next(m[1] for line in reversed(lines) if (m := re.search(r"(Measure \S+|Home|On the way|Approach)", line)))
        )
    return called


@pytest.mark.parametrize("name", BY_NAME)
def test_the_own_reader_finds_the_planned_joint_positions_under_their_labels(name: str) -> None:
    digit = 0.5e-6 if name == "urscript" else np.radians(0.5e-4)
    expected = {"home": "Home", "via": "On the way", "approach": "Approach"}
    for wait in WAITS:
        robot, tour, program = driven_by(name, Driving(wait=wait, input="3"))  # type: ignore[arg-type]
        read = read_again(name, program)
        assert read.skipped == ()
        assert not read.unknown
        assert {move.kind for move in read.moves} == {"joint"}
        at = commanded(read, len(robot.joints))
        assert np.abs(at - robot.controller.from_model(tour.joints)).max() <= digit * (1 + 1e-9), wait
        assert np.abs(robot.controller.to_model(at) - tour.joints).max() <= 2.1 * digit, wait  # one may count another
        assert visited(read) == [expected.get(stop.kind, f"Measure {stop.label}") for stop in tour.stops], wait


@pytest.mark.parametrize("name", BY_NAME)
def test_no_output_is_set_and_no_mode_changed(name: str) -> None:
    outputs = r"\bSetDO\b|\bSet\s|\bReset\s|\bPulse|\$OUT|\bDO\[|\bRO\[|\bDOUT\b|_out|dioSet"
    modes = r"ConfL|CirPathMode|VelSet|AccSet|\$OV_PRO|OVERRIDE|SPEED_SLIDER|setMonitorSpeed|workingMode"
    for wait in WAITS:
        text = text_of(name, driven_by(name, Driving(wait=wait, input="3"))[2])  # type: ignore[arg-type]
        assert re.findall(outputs, text) == re.findall(modes, text) == [], wait


STOPS = {
    "rapid": r"MoveAbsJ j\d+,s\d+(\\T:=[\d.]+)?,fine,tMeasure;",
    "krl": r"  PTP \{[^}]*\}",
    "fanuc-ls": r"J P\[\d+\] \d+% FINE    ;",
    "urscript": r"  movej\(\[[^]]*\], v=0\.\d{4}\)",
    "inform": r"MOVJ C\d{5} VJ=\d+\.\d\d PL=0",
    "val3": r"  movej\(jPath\[\d+\],flange,mJoint\)",
}
#: How long it stands, and how it waits for the operator.
STANDS = {
    "rapid": (r"WaitTime \\InPos,2;", r'TPWrite "P\d+: measure, then start again";\n    Stop;'),
    "krl": (r"WAIT SEC 2\n", r"; P\d+: measure, then start again\n  HALT"),
    "fanuc-ls": (r"WAIT   2\.00\(sec\)", r"!Measure, then start again    ;\n.*PAUSE    ;"),
    "urscript": (r"sleep\(2\)", r'popup\("P\d+: measure, then go on", blocking=True\)'),
    "inform": (r"TIMER T=2\n", r"'Measure, then start again\nPAUSE\n"),
    "val3": (
        r"waitEndMove\(\)\n  delay\(2\)",
        r'userPage\(\)\n  putln\("P\d+: measure, press a key"\)\n  nKey=get\(\)',
    ),
}
#: How it waits for input 3 in P001: until it is off, then until it is on; lines without their numbers and blanks.
INPUTS = {
    "rapid": """
WaitDI di3,0\\MaxTime:=300\\TimeFlag:=late;
IF NOT late WaitDI di3,1\\MaxTime:=300\\TimeFlag:=late;
IF late THEN
TPWrite "P001: no signal";
Stop;
ENDIF""",
    "krl": """
$TIMER_STOP[20] = TRUE
$TIMER[20] = -300000
$TIMER_STOP[20] = FALSE
WAIT FOR (NOT $IN[3]) OR $TIMER_FLAG[20]
WAIT FOR $IN[3] OR $TIMER_FLAG[20]
IF $TIMER_FLAG[20] THEN
; P001: no signal
HALT
ENDIF""",
    "fanuc-ls": """
$WAITTMOUT=30000    ;
WAIT DI[3]=OFF TIMEOUT,LBL[1]    ;
WAIT DI[3]=ON TIMEOUT,LBL[1]    ;
JMP LBL[2]    ;
LBL[1]    ;
!P001: no signal    ;
PAUSE    ;
LBL[2]    ;""",
    "urscript": """
looks = 15000
while (looks > 0 and get_standard_digital_in(3) == True):
sleep(0.02)
looks = looks - 1
end
while (looks > 0 and get_standard_digital_in(3) == False):
sleep(0.02)
looks = looks - 1
end
if (looks <= 0):
popup("P001: no signal", blocking=True)
end""",
    "inform": """
WAIT IN#(3)=OFF T=300.00
'P001: no signal
PAUSE IF IN#(3)=ON
WAIT IN#(3)=ON T=300.00
'P001: no signal
PAUSE IF IN#(3)=OFF""",
    "val3": """
if watch(diMeasure==false,300)==false
userPage()
putln("P001: no signal, press a key")
nKey=get()
endIf
if watch(diMeasure==true,300)==false
userPage()
putln("P001: no signal, press a key")
nKey=get()
endIf""",
}


@pytest.mark.parametrize("name", BY_NAME)
def test_the_robot_stops_stands_and_waits_in_every_configuration(name: str) -> None:
    stands, operator = STANDS[name]
    for wait in WAITS:
        _, tour, program = driven_by(name, Driving(wait=wait, input="3"))  # type: ignore[arg-type]
        text = text_of(name, program)
        plain = re.sub(r"^ *(\d+:)? *", "", text, flags=re.M)
        count = len(tour.measured)
        assert len(re.findall(STOPS[name], text)) == len(tour.stops)
        assert sum(isinstance(step, Wait) for step in program.steps) == count
        assert len(re.findall(stands, text)) == count
        assert len(re.findall(operator, text)) == (count if wait == "operator" else 0)
        assert plain.count(INPUTS[name]) == (1 if wait == "input" else 0)
        assert text.count("no signal") == (INPUTS[name].count("no signal") * count if wait == "input" else 0)
    assert ("BasicIO-1\\%I3" in text_of(name, driven_by(name)[2])) == (name == "val3")


@pytest.mark.parametrize("name", ["fanuc-ls", "inform"])
def test_comments_are_no_longer_than_controllers_take_them(name: str) -> None:
    robot, tour = a_tour(load_robot(ROBOTS[name]), labels=tuple(f"{k}" * LONGEST_LABEL for k in range(4)))
    for wait in WAITS:
        driving = Driving(wait=wait, input="12345")  # type: ignore[arg-type]
        text = text_of(name, plan_program(tour, robot, BY_NAME[name].name, driving, "0123456789ab")[0])
        comments = re.findall(r"^ *\d+:  !(.*)    ;$|^'(.*)$", text, re.M)
        assert len(comments) > 15
        assert max(len(fanuc + inform) for fanuc, inform in comments) <= LONGEST_COMMENT


@pytest.mark.parametrize("name", BY_NAME)
def test_the_head_says_what_the_program_is(name: str) -> None:
    robot, _, program = driven_by(name)
    text = text_of(name, program)
    own = {
        "krl": ("of the joints' deg/s:", "154 154 228 343 384 721"),
        "inform": ("375 315 410 550 550 1002",),
    }.get(name, ())
    head = ("Plan 0123456789ab", "At most 250 mm/s and 10 %", "Dwell 2 s, wait: input 3, 300 s")
    warned = ("Not verified, no safety function", "First run: step by step,", "Go to Home by hand before it")
    for words in (f"Robot {robot.name}", *head, *own, *warned):
        assert len(words) <= 32
        assert words in text
    assert text == text_of(name, driven_by(name)[2])


def test_the_controller_is_told_of_the_tool_in_its_own_axes() -> None:
    turned = Transform.from_matrix(
        np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.0, 0.0, 0.01])
    )
    for name, words in {
        "rapid": "PERS tooldata tMeasure:=[TRUE,[[20,-30,90],[1,0,0,0]],[1.5,[2,-1,30],[1,0,0,0],0,0,0]];",
        "krl": "$LOAD = {M 1.5,CM {X 2,Y -1,Z 30,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}",
        "fanuc-ls": "!PAYLOAD[1] must hold this load    ;",
        "urscript": "set_tcp(p[0.02, -0.03, 0.09, 0, 0, 0])\n  set_payload(1.5, [0.002, -0.001, 0.03])",
        "inform": "'Tool file 0 must hold this load",
        "val3": "// The controller must hold this load",
    }.items():
        stated = load_robot(ROBOTS[name])
        stated = stated.with_frames(stated.base, {"near": (0.0, 0.0, 0.02), "far": (0.03, 0.02, 0.1)})
        stated = replace(
            stated, controller=replace(stated.controller, flange=turned), payload=Payload(1.5, (0.001, 0.002, 0.04))
        )
        robot, tour = a_tour(stated)
        program, _ = plan_program(tour, robot, BY_NAME[name].name, Driving(), "abc")
        text = text_of(name, program)
        assert words in text
        assert "Tip: target far at" in text
        assert "Load 1.5 kg at" in text
        read = read_again(name, program)
        if name in ("rapid", "urscript"):
            (load,) = read.loads.values()
            assert load.mass == 1.5
            assert load.cog == pytest.approx((0.002, -0.001, 0.03))


def test_nothing_on_the_flange_weighs_as_little_as_a_tool_may() -> None:
    bare = load_robot("irb120")
    robot, tour = a_tour(bare.with_frames(bare.base, {"tip": (0.0, 0.0, 0.1)}))
    text = text_of("rapid", plan_program(tour, robot, "RAPID", Driving(), "abc")[0])
    assert "[0.001,[0,0,0.001],[1,0,0,0],0,0,0]" in text


def durations(name: str, text: str, shown: Array, rates: Array) -> list[float]:
    """Return how long the moves take at least that the text says, of joints with these rates at 100 %."""
    turned = np.abs(np.diff(shown, axis=0))
    if name == "rapid":
        return [float(time) - 0.5 for time in re.findall(r"\\T:=([\d.]+)", text)]
    if name == "urscript":
        speeds = [float(v) for v in re.findall(r"v=([\d.]+)", text)][1:]
        return [float(way.max()) / v for way, v in zip(turned, speeds, strict=True)]
    pattern = {
        "krl": r"VEL_AXIS\[1\] = (\d+)|PTP",
        "fanuc-ls": r"J P\[\d+\] (\d+)%",
        "inform": r"VJ=([\d.]+)",
        "val3": r"mJoint\.vel=([\d.]+)|movej",
    }
    shares, last = [], 0.0
    for match in re.finditer(pattern[name], text):
        last = float(match[1]) / 100 if match[1] else last
        if not match[1] or name in ("fanuc-ls", "inform"):
            shares.append(last)
    return [float((way / rates).max()) / share for way, share in zip(turned, shares[1:], strict=True)]


@cache
def driven(name: str, driving: Driving, *, other: bool) -> tuple[Robot, MotionProgram, float]:
    """Return an arm, the program of its tour and the highest speed that is told of it.

    The other arm has speeds of the joints where they are not known, and else none.
    """
    robot, tour = toured(name, approach=True)
    if other:
        known = known_speeds(robot) is not None
        robot = with_speeds(
            robot, [None] * 6 if known else np.radians([150.0, 160.0, 170.0, 320.0, 400.0, 460.0]).tolist()
        )
    return robot, *plan_program(tour, robot, BY_NAME[name].name, driving, "abc")


@cache
def fastest_ways(name: str) -> Array:
    """Return of each move of a tour the highest speed of the flange and all targets, where it lasts a second [m/s]."""
    robot, tour = toured(name, approach=True)
    ways = tour.joints[:-1] + np.linspace(0.0, 1.0, 400)[:, None, None] * np.diff(tour.joints, axis=0)
    places = [
        robot.forward(ways.reshape(-1, ways.shape[-1]), target=target)[0].reshape(*ways.shape[:2], 3)
        for target in (None, *(target.name for target in robot.targets))
    ]
    return np.asarray(399.0 * np.linalg.norm(np.diff(places, axis=1), axis=-1).max(axis=(0, 1)))


def with_speeds(robot: Robot, speeds: Sequence[float | None]) -> Robot:
    pairs = zip(robot.joints, speeds, strict=True)
    return replace(robot, joints=tuple(replace(joint, max_speed=speed) for joint, speed in pairs))


@pytest.mark.parametrize("name", BY_NAME)
@pytest.mark.parametrize("driving", [Driving(), Driving(speed=0.1, share=0.3), Driving(speed=2.0, share=0.05)])
def test_neither_tip_nor_joints_are_faster_than_was_said(name: str, driving: Driving) -> None:
    tour = toured(name, approach=True)[1]
    for other in (False, True):
        robot, program, said_speed = driven(name, driving, other=other)
        shown = robot.controller.from_model(tour.joints)
        slow, fast = joint_rates(robot)
        rates = np.full(len(slow), FASTEST) if name == "urscript" else fast
        seconds = durations(name, text_of(name, program), shown, rates)
        assert len(seconds) == len(tour.stops) - 1
        fastest = float((fastest_ways(name) / seconds).max())
        shares = [step.share for step in program.steps if isinstance(step, JointMove)]
        assert max(shares) <= driving.share + 1e-12 or name == "urscript"
        assert min(shares) > 0.0
        assert f"At most {1e3 * said_speed:.4g}"[:10] in text_of(name, program)
        assert said_speed == driving.speed or name in ("krl", "fanuc-ls")
        assert 0.05 * driving.speed < fastest <= (1.0 + 1e-5) * said_speed, other
        joints = np.abs(np.diff(shown, axis=0)) / np.array(seconds)[:, None]
        top = slow if name == "rapid" else rates if known_speeds(robot) is None else fast
        least = 0.01 if name in ("krl", "fanuc-ls") else 0.0  # the finest share that the language says
        assert (joints <= max(driving.share, least) * top * (1 + 1e-6)).all(), other


@pytest.mark.parametrize("name", ["ur10e", "li3", "scara"])
def test_the_highest_speed_on_a_way_is_bounded_and_hardly_more_than_it_is(name: str) -> None:
    robot = load_robot("ur10e" if name == "scara" else name)
    if name == "scara":
        robot = replace(
            robot, joints=(*robot.joints[:2], replace(robot.joints[2], kind="prismatic"), *robot.joints[3:])
        )
    robot = robot.with_frames(robot.base, {"far": (0.1, 0.05, 0.2)})
    rng = np.random.default_rng(1)
    for size in np.radians([0.01, 2.0, 2.0, 30.0, 170.0]):
        start = rng.uniform(-1.5, 1.5, len(robot.joints))
        end = start + size * rng.uniform(-1.0, 1.0, len(start))
        along = start + np.linspace(0.0, 1.0, 3000)[:, None] * (end - start)
        places = [robot.forward(along, target=target)[0] for target in (None, "far")]
        highest = max(float(np.linalg.norm(np.diff(at, axis=0), axis=1).max()) * 2999 for at in places)
        bound = fastest_point(robot, np.array([start, end]))
        assert highest * (1 - 1e-5) <= bound <= 1.01 * highest
    assert fastest_point(robot, np.array([start, start])) == 0.0


def test_shares_of_whole_percent_are_rounded_down() -> None:
    shares = (0.0, 0.01, 0.0199, 0.019999999999, 0.055, 0.29, 1.0)
    assert [percent(share) for share in shares] == [1, 1, 1, 2, 5, 29, 100]


def test_a_first_move_that_may_be_faster_than_was_asked_is_counted() -> None:
    robot, tour = toured("fanuc-ls", approach=False)
    slow, exact = first_shares(robot, "FANUC LS", 0.1, 0.25), first_shares(robot, "INFORM", 0.1, 0.05)
    assert exact[0] == pytest.approx(np.floor(exact[0] * 1e4) * 1e-4)
    assert exact[1] <= 0.05
    share, highest = first_shares(robot, "FANUC LS", 0.1, 0.05)
    assert share == slow[0] == 0.01
    assert highest > 0.05
    # All joints as fast as one share lets them be: counted by the model, joint 3 then goes as fast as 2 and 3 together.
    rates = share * np.array(known_speeds(robot))
    q = robot.random_configurations(300, np.random.default_rng(0))
    for sign in (1.0, -1.0):
        moved = robot.controller.to_model(robot.controller.from_model(q) + 1e-4 * rates * [1, 1, sign, 1, sign, 1])
        steps = robot.forward(moved, target="1")[0] - robot.forward(q, target="1")[0]
        assert np.linalg.norm(steps, axis=1).max() / 1e-4 <= highest
    _, said_speed = plan_program(tour, robot, "FANUC LS", Driving(speed=0.05), "abc")
    assert said_speed >= highest


def test_where_the_speeds_of_joints_are_known_programs_are_faster_and_keep_to_them() -> None:
    for name in ("krl", "fanuc-ls", "inform"):
        assert known_speeds(driven(name, Driving(), other=True)[0]) is None
        taken = []
        for other in (False, True):
            program = driven(name, Driving(), other=other)[1]
            taken.append(np.mean([step.share for step in program.steps if isinstance(step, JointMove)][1:]))
        assert taken[0] > 1.5 * taken[1], name


def test_a_joint_that_is_counted_with_another_keeps_to_both_counts() -> None:
    robot, tour = toured("fanuc-ls", approach=False)
    assert robot.controller.couplings is not None
    program, fastest = plan_program(tour, robot, "FANUC LS", Driving(), "abc")
    shares = [step.share for step in program.steps if isinstance(step, JointMove)][1:]
    speeds = np.array(known_speeds(robot))
    for counted in (tour.joints, robot.controller.from_model(tour.joints)):
        for k, share in enumerate(shares):
            seconds = float((np.abs(counted[k + 1] - counted[k]) / speeds).max()) / share
            along = tour.joints[k] + np.linspace(0.0, 1.0, 200)[:, None] * (tour.joints[k + 1] - tour.joints[k])
            steps = np.linalg.norm(np.diff(robot.forward(along)[0], axis=0), axis=1)
            assert float(steps.max()) * 199 / seconds <= (1.0 + 1e-5) * fastest


def test_the_rates_of_the_library_lie_within_the_bounds_of_unknown_arms() -> None:
    arms = {name: robot for name in library() if known_speeds(robot := load_robot(name))}
    assert len(arms) >= 50
    for name, robot in arms.items():
        slow, fast = joint_rates(with_speeds(robot, [None] * len(robot.joints)))
        rates = np.array(known_speeds(robot))
        assert (fast > rates).all(), name
        assert (slow < rates).all() or name in ("gen3", "lbr_iiwa_7", "lbr_iiwa_14"), name
        same, again = joint_rates(robot)
        assert (same == rates).all()
        assert (again == rates).all()


def test_of_joints_whose_speed_is_known_and_of_others_both_count() -> None:
    robot = with_speeds(load_robot("irb120"), [4.0, None, 4.0, None, None, 6.0])
    slow, fast = joint_rates(robot)
    assert slow[[0, 2, 5]].tolist() == fast[[0, 2, 5]].tolist() == [4.0, 4.0, 6.0]
    assert (slow[[1, 3, 4]] < fast[[1, 3, 4]]).all()
    (notice,) = speed_notices(robot, "this was taken")
    assert (notice.code, notice.level) == ("joint-speed-assumed", "note")
    assert "How fast axis_2, axis_4, axis_5 go at 100 % is not known: this was taken." in notice.message


def test_velocities_of_a_urdf_are_not_relied_on() -> None:
    robot = load_robot("kr5")
    urdf = replace(robot, convention_name="urdf")
    assert known_speeds(urdf) is None
    without = with_speeds(robot, [None] * 6)
    for rate, other in zip(joint_rates(urdf), joint_rates(without), strict=True):
        assert rate == pytest.approx(other)
    assert speed_notices(robot, "") == []
    (notice,) = speed_notices(urdf, "this was taken")
    assert (notice.code, notice.level) == ("joint-speed-assumed", "note")
    assert "this was taken. The velocities of the URDF are not relied on" in notice.message
    assert "URDF" not in speed_notices(without, "this was taken")[0].message


def test_speeds_are_said_in_the_units_of_joints() -> None:
    robot = load_robot("irb120")
    slides = replace(robot, joints=(*robot.joints[:2], replace(robot.joints[2], kind="prismatic")))
    assert joint_speeds.speed_words([1.0, 2.0, 0.5], slides) == "57 deg/s, 115 deg/s, 500 mm/s"


def test_a_language_of_whole_percent_says_how_fast_that_is() -> None:
    robot, tour = toured("krl", approach=True)
    program, fastest = plan_program(tour, robot, "KRL", Driving(speed=0.02), "abc")
    assert {step.share for step in program.steps if isinstance(step, JointMove)} == {0.01}
    assert 0.05 < fastest < 0.3
    assert f"At most {shown_speed(fastest)} mm/s" in text_of("krl", program)
    finer, exact = plan_program(tour, robot, "INFORM", Driving(speed=0.02), "abc")
    assert exact == 0.02
    assert "VJ=0." in text_of("inform", finer)


def test_the_first_move_is_slow_wherever_it_begins() -> None:
    for name in BY_NAME:
        _, _, program = driven_by(name)
        first, *others = (step for step in program.steps if isinstance(step, JointMove))
        assert first.seconds is None
        assert first.share <= min(step.share for step in others) + 1e-12 or name == "urscript"
        assert first.turning < np.radians(20.0)


def test_the_twin_driven_by_the_program_stands_in_all_configurations_in_order() -> None:
    planned = truearm.plan("irb120", poses=8, candidates=60, clearance=0.02, program="rapid", approach=True, seed=1)
    assert planned.program is not None
    assert planned.tour is not None
    robot, tour = planned.made.robot, planned.tour
    program = BY_NAME["rapid"].read([Source(Path(file), text) for file, text in planned.program.files.items()])
    text = program.sources[0].text
    times = [float(v) for v in re.findall(r"\\T:=([\d.]+)", text)]
    went = robot.controller.to_model(commanded(program, 6))
    step = 4e-3
    pieces, ends, row = [went[:1]], [], 1
    for start, end, seconds in zip(went[:-1], went[1:], times, strict=True):
        moved = joint_move(start, end, np.abs(end - start).max() / (seconds - 0.5), DRIVES.acceleration, step)
        stood = np.repeat(end[None], round(1.0 / step), axis=0)
        pieces += [moved, stood]
        row += len(moved) + len(stood)
        ends.append(row - 1)
    command = np.concatenate(pieces)
    position, velocity = DRIVES.servo.follow(command, step)
    labels = {stop.label: stop.joints for stop in tour.measured}
    seen = [
        next((label for label, joints in labels.items() if np.abs(joints - position[k]).max() < 1e-5), None)
        for k in ends
    ]
    assert [label for label in seen if label] == [stop.label for stop in tour.measured]
    assert np.abs(velocity[ends]).max() < 1e-6
    twin = truth_twin(robot, "tracker-triangular", np.random.default_rng(0))
    arm = MovingArm(robot, None, twin, Transform((0.05, 0.02, 0.1)), robot.payload)
    rows = [k for k, label in zip(ends, seen, strict=True) if label]
    approach = last_moves(command)[rows]
    assert (approach == 1.0).all()  # every joint comes from below
    stood_at = arm.at_rest(position[rows], approach, np.full(len(rows), np.inf))[:, :3, 3]
    place, turned = robot.forward(position[rows])
    tips = place + turned @ np.array(arm.tip.translation)
    apart = np.linalg.norm(np.diff(stood_at, axis=0), axis=1) - np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert (np.abs(apart) < 5e-3).all()
    assert np.abs(apart).max() > 1e-5  # the true arm is not quite the nominal one
