"""Split moves: what the real robot does between targets, as its controller interpolates them."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from tests.compensation.test_program_correction import FLANGE, worn

from truearm.compensation.program_correction import MOST_SEGMENTS, ProgramSplit, corrected_programs, split_program
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.program_poses import poses_of
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform

IRB120 = worn(load_robot("irb120"), 2.0)
AT_BASE = Cell(FLANGE.tools, {"": Placed(None, Transform())})
FARTHEST = 4e-6
#: Three decimals of a millimetre and seven of a quaternion, at the length of the arm.
ROUNDING = 1e-6


def target(x: float, y: float, z: float) -> str:
    return f"[[{x},{y},{z}],[0.0362264,-0.3291090,-0.8816618,-0.3362252],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


START, END = target(360, 190, 480), target(400, 240, 400)


def program(*moves: str) -> Program:
    text = "\n".join(["MODULE m", "PROC main()", *moves, "ENDPROC", "ENDMODULE", ""])
    return RAPID.read([Source(Path("m.mod"), text)])


def split(*moves: str) -> tuple[Program, ProgramSplit]:
    """Return a program whose moves are split, read again, and how they are split."""
    whole = program(*moves)
    done = corrected_programs(IRB120, [whole], AT_BASE)
    assert done.corrections[0].corrected.all()
    cut = split_program(RAPID, done.corrections[0], done.between[0], FARTHEST)
    again = [e for e in done.corrections[0].edits if not any(c.start <= e.start < c.stop for c in cut.edits)]
    text = edited(whole.sources[0].text, [*cut.edits, *again])
    return RAPID.read([Source(Path("m.mod"), text)]), cut


def real_tips(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return where the real flange is when the controller, which knows the nominal robot, goes to poses ``(n, 3)``."""
    nominal = nominal_robot(IRB120)
    seed = inverse(nominal, position[:1], rotation[:1], branch="front-up-noflip", seed=np.zeros(6)).joints[0]
    found = inverse(nominal, position, rotation, branch="front-up-noflip", seed=seed)
    assert found.complete
    return IRB120.world_poses(found.joints)[0]


def interpolated(poses: np.ndarray, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a straight way from each pose to the next."""
    places, turns = [], []
    for one, other in pairwise(poses):
        places.append(one[:3, 3] + shares[:, None] * (other[:3, 3] - one[:3, 3]))
        turns.append(Slerp([0, 1], Rotation.from_matrix(np.stack([one[:3, :3], other[:3, :3]])))(shares).as_matrix())
    return np.concatenate(places), np.concatenate(turns)


def beside(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return how far points are from a line."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.asarray(np.linalg.norm(np.cross(points - start, along), axis=1))


def test_a_split_line_is_straight_on_the_real_robot() -> None:
    moves = (f"MoveJ {START},v100,fine,tool0;", f"MoveL {END},v100,fine,tool0;")
    start, end = (pose[:3, 3] for pose in poses_of(program(*moves)))
    shares = np.linspace(0, 1, 41)
    whole = corrected_programs(IRB120, [program(*moves)], AT_BASE).corrections[0].after
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


@pytest.mark.parametrize("via", [START, END])
def test_an_arc_without_a_circle_is_no_fault(via: str) -> None:
    again, cut = split(f"MoveJ {START},v100,fine,tool0;", f"MoveC {via},{END},v100,fine,tool0;")
    assert cut.added < MOST_SEGMENTS
    assert np.isfinite(poses_of(again)).all()


TIMED = """\
/PROG  A
/ATTR
/MN
   1:J P[1] 20% FINE    ;
   2:L P[2] {speed} FINE    ;
   3:L P[1] 100mm/sec FINE    ;
/POS
P[1]{{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   400.000  mm,\tY =    20.000  mm,\tZ =    20.000  mm,
\tW =   180.000 deg,\tP =   -60.000 deg,\tR =   180.000 deg
}};
P[2]{{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   400.000  mm,\tY =   220.000  mm,\tZ =     0.000  mm,
\tW =   180.000 deg,\tP =   -60.000 deg,\tR =   180.000 deg
}};
/END
"""


@pytest.mark.parametrize(("speed", "moves", "left"), [("100mm/sec", 2, ()), ("2sec", 1, (5,))])
def test_a_move_that_its_language_leaves_whole_is_listed_and_not_counted(
    speed: str, moves: int, left: tuple[int, ...]
) -> None:
    """A speed in seconds would hold for every segment."""
    robot = worn(load_robot("lrmate200ic"), 2.0)
    read = FANUC_LS.read([Source(Path("a.ls"), TIMED.format(speed=speed))])
    done = corrected_programs(robot, [read], Cell({}, {}))
    assert done.corrections[0].corrected.all()
    cut = split_program(FANUC_LS, done.corrections[0], done.between[0], FARTHEST)
    assert (cut.moves, cut.unsplit) == (moves, left)
    again = FANUC_LS.read([Source(Path("a.ls"), edited(read.sources[0].text, cut.edits))])
    assert len(again.moves) == len(read.moves) + cut.added
