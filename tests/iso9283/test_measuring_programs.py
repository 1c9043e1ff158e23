"""Measuring programs of tests by ISO 9283: what every language's own reader finds again, waits, speeds and refusals."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.performance_plan import small_plan

from truearm.compensation.program_correction import commanded
from truearm.engine.base.errors import InputError
from truearm.engine.programs import BY_NAME
from truearm.engine.programs.cell import Cell, read_tools
from truearm.engine.programs.joint_speeds import fastest_point, known_speeds
from truearm.engine.programs.new_program import CircleMove, JointMove, MotionProgram, Remark, StraightMove, Wait
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.urscript.new import FASTEST
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector, rotation_vector
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, Way
from truearm.iso9283.planning.programs import measuring_programs
from truearm.iso9283.planning.routes import Routes

PLAN = small_plan(cycles=dict.fromkeys(TESTS, 2), velocities=(1.0, 0.1))
TIP = 0.1


@pytest.fixture(scope="module")
def programs() -> dict[str, MotionProgram]:
    written = measuring_programs(PLAN, 1.5, "abc")
    return {program.name: program for program in (*written.slow, *written.faster)}


def text_of(name: str, program: MotionProgram) -> str:
    language = BY_NAME[name]
    assert language.motion is not None
    return "\n".join(language.motion(program).values())


def read_again(name: str, program: MotionProgram) -> Program:
    language = BY_NAME[name]
    assert language.motion is not None
    sources = [Source(Path(file), text) for file, text in language.motion(program).items()]
    assert all(source.text.isascii() for source in sources)
    return language.read(sources)


def meant(name: str, program: MotionProgram) -> list[tuple[str, int | None, int]]:
    """Return kind, via and target of every move; of INFORM with the move to where an arc begins."""
    moves: list[tuple[str, int | None, int]] = []
    arc = False
    for step in program.steps:
        if isinstance(step, JointMove):
            moves.append(("joint", None, step.target))
        elif isinstance(step, StraightMove):
            moves.append(("linear", None, step.target))
        elif isinstance(step, CircleMove):
            if name == "inform":  # where arcs meet stands a line as well
                moves += [("linear", None, step.start)] * (1 + arc)
            moves.append(("circular", step.via, step.target))
        arc = isinstance(step, CircleMove)
    return moves


def check_target(read: Program, index: int, program: MotionProgram, row: int) -> None:
    target = read.targets[index]
    form, values = target.form, np.array(target.values)
    if form.kind == "joints":
        assert values * form.angle == pytest.approx(program.joints[row], abs=1e-6)
        return
    assert form.orientation is not None
    assert program.poses is not None
    assert values[:3] * form.length == pytest.approx(program.poses[row, :3, 3], abs=6e-7)
    numbers = values[None, 3:] * (1.0 if form.orientation.count == 4 else form.angle)
    assert form.orientation.matrices(numbers)[0] == pytest.approx(program.poses[row, :3, :3], abs=2e-6)


@pytest.mark.parametrize("name", BY_NAME)
def test_the_own_reader_finds_every_move_again_in_order(name: str, programs: dict[str, MotionProgram]) -> None:
    assert {"AP_10", "AT_10", "AT_100", "REORI_100", "WS_10", "COMPL_10", "VAP_100"} <= set(programs)
    for program in programs.values():
        read = read_again(name, program)
        assert read.skipped == ()
        assert not read.unknown
        wanted = meant(name, program)
        assert [move.kind for move in read.moves] == [kind for kind, _, _ in wanted]
        for move, (_, via, target) in zip(read.moves, wanted, strict=True):
            check_target(read, move.target, program, target)
            assert (move.via is None) == (via is None)
            if move.via is not None and via is not None:
                check_target(read, move.via, program, via)


@pytest.mark.parametrize("name", BY_NAME)
def test_the_controller_takes_the_joint_positions_that_were_checked(
    name: str, programs: dict[str, MotionProgram], tmp_path: Path
) -> None:
    robot = PLAN.robot
    geometry = next(p for p in robot.parameters.values() if p.group == "geometry")
    calibrated = robot.with_values({geometry.name: geometry.value + 1e-4})  # of one that is not, nothing is asked
    file = tmp_path / "cell.yaml"
    file.write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        'tools: {"0": {of: flange, controller: {}}, tcp: {of: flange, controller: {}}}\n'
    )
    cell = Cell(read_tools(calibrated, file), {})
    for key in ("VAP_10", "REORI_10", "CR_10"):
        program = programs[key]
        read = read_again(name, program)
        went = robot.controller.from_model(commanded(calibrated, read, cell))
        rows = [row for _, _, row in meant(name, program)]
        ends = [move.target for move in read.moves]
        apart = went[ends] - program.joints[rows]  # joint 6 stands at 180 deg, where a turn is as good as none
        apart[:, 5] = (apart[:, 5] + np.pi) % (2 * np.pi) - np.pi
        assert apart == pytest.approx(0.0, abs=5e-5)


WAITS = {
    "rapid": (r"WaitTime \\InPos,1\.5;", r",fine,tool0;$"),
    "krl": (r"WAIT SEC 1\.5$", r"(PTP|LIN|CIRC) .*\}$"),
    "fanuc-ls": (r"WAIT   1\.50\(sec\)", r"FINE    ;$"),
    "urscript": (r"sleep\(1\.5\)", r"(movej\(.*|r=0)\)$"),
    "inform": (r"TIMER T=1\.5$", r" PL=0$"),
    "val3": (r"delay\(1\.5\)", r"waitEndMove\(\)$"),
}


@pytest.mark.parametrize("name", BY_NAME)
def test_the_robot_stops_before_each_wait_and_says_where_it_is(name: str, programs: dict[str, MotionProgram]) -> None:
    stops = re.findall(r"To (\S+)", text_of(name, programs["AP_10"]))
    assert stops == ["P1", *["P5", "P4", "P3", "P2", "P1"] * 2, "P1"]
    wait, stopped = WAITS[name]
    for key in ("AP_10", "AT_10", "WS_10", "REORI_10"):
        program = programs[key]
        lines = [line for line in text_of(name, program).splitlines() if not re.search("cycle", line)]
        rows = [row for row, line in enumerate(lines) if re.search(wait, line)]
        assert len(rows) == sum(isinstance(step, Wait) for step in program.steps)
        assert all(re.search(stopped, lines[row - 1]) for row in rows)


SPEEDS = {
    "rapid": ("speeddata s1:=[50,", "speeddata s2:=[500,", "zonedata n1:=[FALSE,2,3,3,0.3,3,0.3]"),
    "krl": ("$VEL_AXIS[6] = 10", "$VEL.CP = 0.5000", "C_DIS"),
    "fanuc-ls": ("10% FINE", "500mm/sec", "CNT100"),
    "urscript": ("v=0.2094)", "v=0.50000", "r=0.002)"),
    "inform": ("VJ=10.00", "V=500.0", "V=500.0\n"),
    "val3": ("mJoint.vel=10", "mStop.tvel=500", "mBlend.leave=2"),
}


@pytest.mark.parametrize("name", BY_NAME)
def test_speeds_and_zones_are_said(name: str, programs: dict[str, MotionProgram]) -> None:
    fast = text_of(name, programs["CR_100"])
    assert all(words in fast for words in SPEEDS[name])
    slow = text_of(name, programs["CR_10"])
    assert SPEEDS[name][1] not in slow
    lines = slow.splitlines()
    for words in ("Not verified, no safety function", "First run: step by step,", "ISO 9283 CR", "Plan abc"):
        assert any(words in line for line in lines)


def test_what_single_languages_ask_for(programs: dict[str, MotionProgram]) -> None:
    # arcs of Yaskawa's are separated by a line and by no tag of newer controllers
    text = text_of("inform", programs["AT_10"])
    assert "FPT" not in text
    moves = [line.split()[0] for line in text.splitlines() if line.startswith(("MOV", "TIMER"))]
    assert "MOVJ TIMER MOVC MOVC MOVC MOVL MOVC MOVC MOVC TIMER" in " ".join(moves)
    assert "To start of line" in text_of("rapid", programs["AT_10"])
    # a speed of Staubli's is left to the one that is said
    assert text_of("val3", programs["REORI_100"]).count('tmax="99999" rmax="99999"') == 3


def test_every_test_begins_and_ends_slowly_in_the_first_pose(programs: dict[str, MotionProgram]) -> None:
    first = PLAN.robot.controller.from_model(PLAN.poses["P1"].joints[None])[0]
    for program in programs.values():
        moves = [step for step in program.steps if isinstance(step, JointMove)]
        for move in (moves[0], moves[-1]):
            assert program.joints[move.target] == pytest.approx(first)
            assert 0.0 < move.share <= 0.1
            assert move.speed == pytest.approx(0.05)
        assert moves[0].share <= min(move.share for move in moves)  # nobody knows from where


@pytest.mark.parametrize("known", [True, False])
def test_joint_motions_keep_to_the_velocity_and_in_the_first_run_to_250_mm_a_second(known: bool) -> None:
    plan = with_tip(small_plan(["AP", "AD"], velocities=(1.0, 0.1)))
    speeds = np.array([10.0, 10.0, 10.0, 20.0, 20.0, 25.0])  # so fast that 10 % is too fast for the tip
    joints = zip(plan.robot.joints, speeds.tolist(), strict=True)
    robot = replace(
        plan.robot, joints=tuple(replace(joint, max_speed=speed if known else None) for joint, speed in joints)
    )
    assert (known_speeds(robot) is not None) == known
    written = measuring_programs(replace(plan, robot=robot), 1.0, "abc", "VAL3")
    fastest = 0.0
    for program in written.slow:
        moves = [step for step in program.steps if isinstance(step, JointMove)]
        for before, move in pairwise(moves):
            ends = robot.controller.to_model(program.joints[[before.target, move.target]])
            seconds = float((np.abs(ends[1] - ends[0]) / speeds).max()) / move.share
            fastest = max(fastest, fastest_point(robot, ends) / max(seconds, 1e-9))
    assert fastest <= 0.25 * (1.0 + 1e-6)
    assert fastest > (0.24 if known else 0.1)
    shares = {step.share for faster in written.faster for step in faster.steps if isinstance(step, JointMove)}
    assert max(shares) == 1.0
    script = measuring_programs(replace(plan, robot=robot), 1.0, "abc", "URScript")
    top = np.array(speeds if known else [FASTEST] * 6)
    for program in script.faster:
        moves = [step for step in program.steps if isinstance(step, JointMove)]
        for before, move in list(pairwise(moves))[1:-1]:
            turned = np.abs(program.joints[move.target] - program.joints[before.target])
            rates = turned * move.share * FASTEST / turned.max()
            assert float((rates / top).max()) == pytest.approx(1.0, abs=1e-3)


def test_cycles_go_where_the_test_asks(programs: dict[str, MotionProgram]) -> None:
    poses = {name: PLAN.robot.controller.from_model(pose.joints[None])[0] for name, pose in PLAN.poses.items()}

    def visited(name: str) -> list[str]:
        program = programs[name]
        moves = [step for step in program.steps if isinstance(step, JointMove)][1:-1]
        return [
            next(key for key, joints in poses.items() if np.allclose(joints, program.joints[move.target]))
            for move in moves
        ]

    assert visited("AP_10") == ["P5", "P4", "P3", "P2", "P1"] * 2
    assert visited("AD_100") == ["P2", "P4"] * 2
    assert visited("DAP_10") == visited("T_100") == ["P2", "P1"] * 2
    assert visited("POSING_10") == ["P1", "D10", "P1", "D50"] * 2
    pushes = [step.text for step in programs["COMPL_10"].steps if isinstance(step, Remark)]
    assert pushes[0] == pushes.pop() == "To P1"
    assert pushes[1:4] == ["+x, cycle 1 of 2", "+x: 0 % of the rated load", "+x: 10 % of the rated load"]
    assert len(pushes) == 1 + 2 * 6 * 12


def test_the_first_run_is_at_a_tenth_and_at_most_250_mm_a_second() -> None:
    fast = measuring_programs(replace(small_plan(["AV"], velocities=(1.0, 0.1)), rated_velocity=5.0), 1.0, "abc")
    assert fast.share == pytest.approx(0.05)
    assert [program.name for program in fast.slow] == ["AV_5"]
    assert [program.name for program in fast.faster] == ["AV_100", "AV_10"]
    assert max(step.speed for program in fast.slow for step in program.steps if isinstance(step, StraightMove)) <= 0.25
    weaving = measuring_programs(small_plan(["WS"], velocities=(0.1,), rated_velocity=2.5), 1.0, "abc")
    assert [program.name for program in weaving.faster] == ["WS_10"]
    assert weaving.slow[0].name == "WS_7p071"  # the tip goes aside as fast as ahead
    assert max(step.speed for step in weaving.slow[0].steps if isinstance(step, StraightMove)) <= 0.25 + 1e-12
    loaded = measuring_programs(small_plan(["AP"], loads=(1.0, 0.1)), 1.0, "abc")
    assert [program.name for program in loaded.slow] == ["AP_10_L100", "AP_10_L10"]
    assert loaded.slow[1].notes[2] == "10 % velocity, load 0.3 kg"


def with_tip(plan: PerformancePlan) -> PerformancePlan:
    """Return the plan for a tip before the flange, its poses and paths moved with it."""
    robot = plan.robot.with_frames(plan.robot.base, {"tip": (0.0, 0.0, TIP)})

    def moved(point: Array, rotation: Array) -> Array:
        return np.asarray(point + TIP * rotation[:, 2])

    poses = {name: replace(pose, position=moved(pose.position, pose.rotation)) for name, pose in plan.poses.items()}
    paths = {name: replace(path, points=moved(path.points, path.rotation)) for name, path in plan.paths.items()}
    return replace(plan, robot=robot, target="tip", poses=poses, paths=paths)


def test_flange_poses_keep_the_tip_on_its_line_while_it_turns() -> None:
    plan = with_tip(small_plan(["AT-reorientation"], cycles={"AT-reorientation": 1}))
    (program,) = measuring_programs(plan, 1.0, "abc").slow
    assert program.poses is not None
    rows = [step.target for step in program.steps if isinstance(step, StraightMove)]
    start = [step.target for step in program.steps if isinstance(step, JointMove)][1]
    way = Way(plan.paths["line"], reoriented=True)
    travelled, off = [], []
    for before, after in zip([start, *rows], rows, strict=False):
        a, b = program.poses[before], program.poses[after]
        turn = rotation_vector((b[:3, :3] @ a[:3, :3].T)[None])
        for share in np.linspace(0.0, 1.0, 5):
            R = rotation_from_vector(share * turn)[0] @ a[:3, :3]
            tip = (1 - share) * a[:3, 3] + share * b[:3, 3] + TIP * R[:, 2]
            along = float((tip - way.position(np.zeros(1))[0]) @ way.direction(np.zeros(1))[0])
            travelled.append(along)
            off.append(np.linalg.norm(tip - way.position(np.array([along]))[0]))
    assert max(off) < 1.1e-5
    assert travelled[-1] == pytest.approx(way.length)
    assert program.poses[rows[-1], :3, :3] == pytest.approx(plan.paths["line"].rotation, abs=1e-9)
    speeds = np.array([step.speed for step in program.steps if isinstance(step, StraightMove)])
    lengths = np.linalg.norm(np.diff(program.poses[[start, *rows], :3, 3], axis=0), axis=1)
    assert (lengths / speeds).sum() == pytest.approx(way.length / 0.05)  # the flange takes the time of the tip


def test_a_tip_has_the_flange_where_it_brings_the_tip_there() -> None:
    for test in ("AT", "CR"):
        plan = with_tip(small_plan([test], cycles={test: 1}))
        (program,) = measuring_programs(plan, 1.0, "abc").slow
        assert program.poses is not None
        tips = program.poses[:, :3, 3] + TIP * program.poses[:, :3, 2]
        for corner in plan.paths["rectangle"].points:
            assert np.linalg.norm(tips - corner, axis=1).min() < 1e-6, test


def test_what_cannot_be_gone_is_refused_with_the_move() -> None:
    plan = small_plan(["AP", "CR"])
    far = replace(plan.poses["P3"], joints=plan.poses["P3"].joints + np.radians([0, 300.0, 0, 0, 0, 0]))
    rectangle = plan.paths["rectangle"]

    def with_corner(corner: Array) -> PerformancePlan:
        points = rectangle.points.copy()
        points[2] = corner
        return replace(plan, paths={**plan.paths, "rectangle": replace(rectangle, points=points)})

    unturned = replace(plan.paths["line"], other=None)
    for wrong, text in (
        (
            replace(plan, poses={**plan.poses, "P3": far}),
            r"AP, P3: a joint would go beyond its limits; got 'axis_2'",
        ),
        (
            with_corner(rectangle.points[2] + [2.0, 0.0, 0.0]),
            r"CR, rectangle, move 2: the robot cannot go this way; got '?unreachable'?",
        ),
        (with_corner(np.array([-0.35, 0.02, 0.35])), r"CR, rectangle, move 2"),
        (
            replace(small_plan(["dAP"]), poses={"P1": plan.poses["P1"]}),
            r"dAP: a pose is not in the plan; got 'P2'",
        ),
        (
            replace(plan, paths={"line": unturned}, tests=small_plan(["AT-reorientation"]).tests),
            "this path has one orientation, and another is needed",
        ),
    ):
        with pytest.raises(InputError, match=text):
            measuring_programs(wrong, 1.0, "abc")


def test_only_straight_moves_need_the_frames_of_the_controller() -> None:
    puma = load_robot("puma560")
    plan = small_plan(["AP"], cycles={"AP": 1})
    joints = np.radians([0.0, -45.0, 20.0, 0.0, 30.0, 0.0])
    poses = {name: replace(pose, joints=joints) for name, pose in plan.poses.items()}
    (program,) = measuring_programs(replace(plan, robot=puma, poses=poses), 1.0, "abc").slow
    assert program.poses is None
    assert len(read_again("val3", program).moves) == 7
    with pytest.raises(InputError, match="it is not known where the controller of puma560 has its frames"):
        Routes(puma, None, joints).of("AT-reorientation", small_plan(["AT-reorientation"]).paths["line"])


def test_robots_that_have_no_such_programs_are_refused() -> None:
    plan = small_plan(["AP"])
    with pytest.raises(InputError, match="arms of six joints; got '7 joints'"):
        measuring_programs(replace(plan, robot=load_robot("fr3")), 1.0, "abc")
    geometry = next(p for p in plan.robot.parameters.values() if p.group == "geometry")
    calibrated = plan.robot.with_values({geometry.name: geometry.value + 1e-4})
    with pytest.raises(InputError, match="this robot is calibrated"):
        measuring_programs(replace(plan, robot=calibrated), 1.0, "abc")
