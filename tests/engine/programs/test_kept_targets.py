"""Which targets are kept: those that would rather get worse, without tearing paths apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from truearm.engine.programs.correction import kept_targets, paths_of
from truearm.engine.programs.expected_errors import DrawnErrors, ExpectedErrors
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.rapid import RAPID

POSE = "[[{},0,400],[0.7071068,0,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def rapid(*moves: str) -> Program:
    """Return moves; what follows J, L or C is x of its poses."""
    lines = [f"Move{m[0]} {','.join(POSE.format(x) for x in m[1:].split())},v100,fine,tool0;" for m in moves]
    return RAPID.read(
        [Source(Path("m.mod"), "\n".join(["MODULE m", "PROC main()", *lines, "ENDPROC", "ENDMODULE", ""]))]
    )


def expected(worse: list[float], path: float = 0.0) -> ExpectedErrors:
    size = np.full(len(worse), 1e-3)
    nothing = DrawnErrors(np.zeros(0, dtype=np.intp), np.zeros((0, 1)), np.zeros((0, 1)))
    return ExpectedErrors(size, size, np.array(worse), np.full(len(worse), path), nothing)


def kept(program: Program, worse: list[float], moved: list[float], path: float = 0.0) -> list[bool]:
    found: list[bool] = kept_targets(program, np.array(moved) * 1e-3, expected(worse, path)).tolist()
    return found


def test_straight_moves_and_circles_join_their_targets() -> None:
    assert paths_of(rapid("J1", "L2", "L3", "J4", "J5", "L6")).tolist() == [0, 0, 0, 1, 2, 2]
    assert paths_of(rapid("J1", "C2 3", "J4")).tolist() == [0, 0, 0, 1]


def test_offsets_belong_together() -> None:
    one = rapid("J1", "J2", "J3")
    offset = replace(one, targets=(*one.targets[:2], replace(one.targets[2], parent=0)))
    assert paths_of(offset).tolist() == [0, 1, 0]
    assert kept(offset, [0.0, 0.0, 0.2], [0.01, 0.01, 0.01], path=0.2) == [True, False, True]
    assert kept(offset, [0.0, 0.0, 0.2], [0.01, 0.01, 0.01], path=0.0) == [False, False, False]


def test_targets_that_joint_moves_go_to_are_kept_one_by_one() -> None:
    assert kept(rapid("J1", "J2", "J3"), [0.2, 0.05, 0.11], [1.0, 2.0, 0.5]) == [True, False, True]
    assert kept(rapid(), [], []) == []


def test_a_step_as_small_as_a_tenth_of_a_millimetre_is_left_in_a_path_and_a_larger_one_is_not() -> None:
    path = rapid("L1", "L2", "L3")
    assert kept(path, [0.0, 0.2, 0.0], [0.3, 0.09, 0.2]) == [False, True, False]
    assert kept(path, [0.0, 0.2, 0.0], [0.3, 0.11, 0.2], path=0.05) == [False] * 3
    assert kept(path, [0.0, 0.2, 0.0], [0.3, 0.11, 0.2], path=0.15) == [True] * 3
    assert kept(path, [0.2, 0.2, 0.2], [0.3, 0.11, 0.2], path=0.05) == [True] * 3
    # What is not known is left alone.
    assert kept(path, [np.nan, 0.2, 0.0], [0.0, 0.3, 0.2], path=0.15) == [False, True, True]
