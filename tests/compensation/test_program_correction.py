"""Programs at their edges: none but joint targets, arms that slide or are too short, frames that only some have.

And split moves: what the real robot does between targets, as its controller interpolates them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from tests.answered import compensate
from tests.compensation.workplace import cell

from truearm.compensation.program_correction import (
    MOST_SEGMENTS,
    ProgramSplit,
    commanded,
    corrected_programs,
    split_program,
)
from truearm.engine.base.errors import InputError
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.chosen_targets import Choice
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.program import Configuration, Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.program_poses import poses_of
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

JOINTS = "MoveAbsJ [[{},20,-10,0,45,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;"
POSE = "MoveL [[{},0,400],[0.70710678,0,0.70710678,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0{};"
POSITION = "P[{}]{{\n  GP1:\n  UF : 0, UT : 0,\n  {}\n}};\n"
FLANGE = Cell({"": Placed(None, Transform())}, {})
FLANGE_AND_BASE = Cell({"": Placed(None, Transform())}, {"": Placed(None, Transform())})


def rapid(*moves: str) -> Program:
    text = "\n".join(["MODULE m", "PROC main()", *moves, "ENDPROC", "ENDMODULE", ""])
    return RAPID.read([Source(Path("m.mod"), text)])


def ls(*positions: str) -> str:
    lines = "".join(f"{i:4}:J P[{i}] 100% FINE ;\n" for i in range(1, len(positions) + 1))
    taught = "".join(POSITION.format(i, words) for i, words in enumerate(positions, 1))
    return f"/PROG  A\n/ATTR\n/MN\n{lines}/POS\n{taught}/END\n"


def joints(*values: str) -> str:
    return ",\n  ".join(f"J{i} = {value}" for i, value in enumerate(values, 1))


def worn(robot: Robot, size: float = 0.3) -> Robot:
    """Return a robot with errors of its geometry, drawn in a share of what is usual."""
    rng = np.random.default_rng(0)
    inside = [p for p in robot.parameters.values() if p.group in ("geometry", "joint zero")]
    return robot.with_values({p.name: p.value + size * p.prior * float(rng.standard_normal()) for p in inside})


IRB120 = worn(load_robot("irb120"))


EVERY = Choice(joint_targets=True)


def test_joint_targets_alone_keep_to_the_base_that_was_measured() -> None:
    measured = Cell(FLANGE.tools, {"": Placed(None, Transform((0.0, 0.0, 0.001)))})
    result = corrected_programs(IRB120, [rapid(JOINTS.format(10), JOINTS.format(30))], measured, choice=EVERY)
    assert (result.frames.tools, result.frames.frames) == ("identified", "identified")
    np.testing.assert_allclose(result.frames.base, Transform((0.0, 0.0, 0.001)).matrix, atol=1e-12)
    correction = result.corrections[0]
    # Where the nominal robot was meant to be, seen from a base that is 1 mm higher, is where the real one goes.
    position, _ = IRB120.world_poses(correction.joints)
    np.testing.assert_allclose(position, correction.tips[:, :3, 3] + [0, 0, 0.001], atol=1e-9)


def test_programs_given_together_share_the_first_frame_that_was_measured() -> None:
    shift = Transform((0.001, 0.002, -0.001))
    defined = Transform((0.1, 0.0, 0.0))
    frames = {"w": Placed(None, Transform.from_matrix(np.eye(3), (shift.matrix @ defined.matrix)[:3, 3]))}
    poses = rapid(POSE.format(300, "\\WObj:=w"), POSE.format(310, "\\WObj:=w"))
    poses = replace(poses, frames={"w": defined})
    first, second = corrected_programs(
        IRB120, [poses, rapid(JOINTS.format(10))], Cell(FLANGE.tools, frames), choice=EVERY
    ).corrections
    assert first.corrected.all()
    position, _ = IRB120.world_poses(second.joints)
    np.testing.assert_allclose(position, second.tips[:, :3, 3] + shift.translation, atol=1e-9)


def test_nothing_to_correct_is_no_error() -> None:
    result = corrected_programs(IRB120, [rapid("WaitTime 1;"), rapid(POSE.format(9000, ""))], Cell({}, {}))
    assert [len(correction.corrected) for correction in result.corrections] == [0, 1]
    assert not result.corrections[1].corrected.any()
    assert [correction.edits for correction in result.corrections] == [(), ()]


def test_an_arm_of_fewer_than_six_joints_is_refused() -> None:
    for name, count in (("li3", 3), ("katana450", 5)):
        program = FANUC_LS.read([Source(Path("a.ls"), ls(joints(*("10 deg",) * count)))])
        with pytest.raises(InputError, match=f"six joints or more; got '{count} joints'"):
            corrected_programs(worn(load_robot(name)), [program], Cell({}, {}))


def on_a_track() -> Robot:
    plain = load_robot("irb120")
    track = replace(plain.joints[0], name="track", kind="prismatic", limits=(0.0, 5.0), row={"d": 0.0})
    return worn(replace(plain, joints=(track, *plain.joints), masses=(), maker="", effect_names=(), known={}))


def test_a_track_is_reported_in_millimetres(tmp_path: Path) -> None:
    six = ("10 deg", "20 deg", "-30 deg", "5 deg", "45 deg", "0 deg")
    program = tmp_path / "a.ls"
    program.write_text(ls(joints("1000 mm", *six), joints("1500 mm", *six), joints("1200 mm", "40 deg", *six[1:])))
    tools = cell(tmp_path, "tools:\n  flange: {of: flange}\n")
    result = compensate(on_a_track(), [program], tools=tools, joint_targets="correct")
    assert result.result.corrections[0].corrected.all()
    result.save(tmp_path / "out")
    page = (tmp_path / "out" / "compensation.html").read_text()
    row = page.partition("<tr><td>track</td>")[2].partition("</tr>")[0]
    low, high = (float(part.partition("<")[0]) for part in row.split('<td class="n">')[1:])
    assert (low, high) == pytest.approx((1000, 1500), abs=5)
    assert "<td>mm</td>" in row


def test_a_turn_that_a_controller_takes_to_the_letter_is_not_left() -> None:
    """A joint at the end of its turn: some controllers would go round to the other end, others go a little beyond."""
    robot = worn(load_robot("irb120"))
    program = rapid(POSE.format(400, ""))
    (target,) = program.targets
    free = Program("RAPID", program.sources, (replace(target, configuration=Configuration("front", "up", "flip")),))
    meant = commanded(robot, free)[0, 0]
    real = corrected_programs(robot, [free], FLANGE_AND_BASE).corrections[0].joints[0, 0]
    assert 1e-4 < abs(real - meant) < 1e-2
    side = (1, meant, math.inf) if real < meant else (1, -math.inf, meant)
    found = []
    for literal in (True, False):
        bound = Configuration("front", "up", "flip", (side,), literal=literal)
        told = Program("RAPID", program.sources, (replace(target, configuration=bound),))
        found.append(corrected_programs(robot, [told], FLANGE_AND_BASE).corrections[0])
    assert not found[0].corrected[0]
    assert "it would leave the configuration in the program" in found[0].skipped[0].reason
    assert found[1].corrected[0]
    assert found[1].on_edge == (0,)


BADLY_WORN = worn(load_robot("irb120"), 2.0)
FARTHEST = 4e-6
#: Three decimals of a millimetre and seven of a quaternion, at the length of the arm.
ROUNDING = 1e-6


def target(x: float, y: float, z: float) -> str:
    return f"[[{x},{y},{z}],[0.0362264,-0.3291090,-0.8816618,-0.3362252],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


START, END = target(360, 190, 480), target(400, 240, 400)


def split(*moves: str) -> tuple[Program, ProgramSplit]:
    """Return a program whose moves are split, read again, and how they are split."""
    whole = rapid(*moves)
    result = corrected_programs(BADLY_WORN, [whole], FLANGE_AND_BASE)
    assert result.corrections[0].corrected.all()
    cut = split_program(RAPID, result.corrections[0], result.between[0], FARTHEST)
    again = [e for e in result.corrections[0].edits if not any(c.start <= e.start < c.stop for c in cut.edits)]
    text = edited(whole.sources[0].text, [*cut.edits, *again])
    return RAPID.read([Source(Path("m.mod"), text)]), cut


def real_tips(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return where the real flange is when the controller, which knows the nominal robot, goes to poses ``(n, 3)``."""
    nominal = nominal_robot(BADLY_WORN)
    seed = inverse(nominal, position[:1], rotation[:1], branch="front-up-noflip", seed=np.zeros(6)).joints[0]
    solution = inverse(nominal, position, rotation, branch="front-up-noflip", seed=seed)
    assert solution.complete
    return BADLY_WORN.world_poses(solution.joints)[0]


def interpolated(poses: np.ndarray, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a straight way from each pose to the next."""
    places, turns = [], []
    for first, other in pairwise(poses):
        places.append(first[:3, 3] + shares[:, None] * (other[:3, 3] - first[:3, 3]))
        turns.append(Slerp([0, 1], Rotation.from_matrix(np.stack([first[:3, :3], other[:3, :3]])))(shares).as_matrix())
    return np.concatenate(places), np.concatenate(turns)


def beside(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return how far points are from a line."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.asarray(np.linalg.norm(np.cross(points - start, along), axis=1))


def test_a_split_line_is_straight_on_the_real_robot() -> None:
    moves = (f"MoveJ {START},v100,fine,tool0;", f"MoveL {END},v100,fine,tool0;")
    start, end = (pose[:3, 3] for pose in poses_of(rapid(*moves)))
    shares = np.linspace(0, 1, 41)
    whole = corrected_programs(BADLY_WORN, [rapid(*moves)], FLANGE_AND_BASE).corrections[0].after
    assert beside(real_tips(*interpolated(whole, shares)), start, end).max() > 3 * FARTHEST
    again, cut = split(*moves)
    assert cut.moves == 1
    assert len(again.moves) == 2 + cut.added
    poses = poses_of(again)[[move.target for move in again.moves]]
    assert beside(real_tips(*interpolated(poses, shares)), start, end).max() < FARTHEST + ROUNDING


def test_a_split_circle_is_round_on_the_real_robot() -> None:
    centre, radius = np.array([0.37, 0.21, 0.45]), 0.03

    def on_it(angle: float) -> str:
        x, y, z = 1e3 * (centre + radius * np.array([math.cos(angle), math.sin(angle), 0.0]))
        return target(round(x, 3), round(y, 3), round(z, 3))

    first, via, last = (on_it(angle) for angle in (-0.5, 0.5, 1.5))
    again, cut = split(f"MoveJ {first},v100,fine,tool0;", f"MoveC {via},{last},v100,fine,tool0;")
    assert (cut.moves, cut.unsplit) == (1, ())
    poses = poses_of(again)
    angles = [-0.5]
    for move in again.moves[1:]:
        assert move.via is not None
        x, y, _ = real_tips(poses[[move.target], :3, 3], poses[[move.target], :3, :3])[0] - centre
        angles.append(math.atan2(y, x))
        for row in (move.via, move.target):
            tip = real_tips(poses[[row], :3, 3], poses[[row], :3, :3])[0] - centre
            assert math.hypot(tip[0], tip[1]) == pytest.approx(radius, abs=2 * ROUNDING)
            assert abs(tip[2]) < 2 * ROUNDING
    np.testing.assert_allclose(angles, np.linspace(-0.5, 1.5, cut.added + 2), atol=1e-4)


def test_an_arc_without_a_circle_is_no_fault() -> None:
    for via in (START, END):
        again, cut = split(f"MoveJ {START},v100,fine,tool0;", f"MoveC {via},{END},v100,fine,tool0;")
        assert cut.added < MOST_SEGMENTS
        assert np.isfinite(poses_of(again)).all()


def test_a_move_that_its_language_leaves_whole_is_listed_and_not_counted() -> None:
    """A speed in seconds would hold for every segment."""
    poses = (
        f"CONFIG : 'N U T, 0, 0, 0',\n  X = 400.000 mm, Y = {y} mm, Z = {z} mm,\n"
        "  W = 180.000 deg, P = -60.000 deg, R = 180.000 deg"
        for y, z in (("20.000", "20.000"), ("220.000", "0.000"))
    )
    positions = "".join(POSITION.format(i, one) for i, one in enumerate(poses, 1))
    for speed, count, left in (("100mm/sec", 2, ()), ("2sec", 1, (5,))):
        moves = f"   1:J P[1] 20% FINE ;\n   2:L P[2] {speed} FINE ;\n   3:L P[1] 9mm/sec FINE ;\n"
        text = f"/PROG  A\n/ATTR\n/MN\n{moves}/POS\n{positions}/END\n"
        read = FANUC_LS.read([Source(Path("a.ls"), text)])
        result = corrected_programs(worn(load_robot("lrmate200ic"), 2.0), [read], Cell({}, {}))
        assert result.corrections[0].corrected.all()
        cut = split_program(FANUC_LS, result.corrections[0], result.between[0], FARTHEST)
        assert (cut.moves, cut.unsplit) == (count, left)
        again = FANUC_LS.read([Source(Path("a.ls"), edited(read.sources[0].text, cut.edits))])
        assert len(again.moves) == len(read.moves) + cut.added
