"""What a correction is expected to do, against robots drawn from what its calibration leaves uncertain."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.plate import PLATE
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.compensation.program_correction import corrected_programs
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.chosen_targets import ALONE, Choice
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import sealed
from truearm.engine.robot.transform import Transform

DRAWS = 25


def program(*moves: str, points: bool = True) -> Program:
    """Return the plate's program with these moves and, unless it has no points, its circle."""
    lines = [line for line in PLATE.splitlines() if not line.startswith("    Move") or ("Circle" in line and points)]
    lines = [line for line in lines if points or "CONST" not in line]
    at = next(i for i, line in enumerate(lines) if "PROC main" in line)
    jumps = [f"    MoveJ {move},v20,fine,tProbe\\WObj:=wobjPlate;" for move in moves]
    return RAPID.read([Source(Path("plate.mod"), "\n".join([*lines[: at + 1], *jumps, *lines[at + 1 :], ""]))])


#: A tenth of its targets and a posture by joints among them.
SOME = ("pHole1", "pHole6", "pHole8")


@pytest.fixture(scope="module")
def robot() -> Robot:
    """A robot calibrated with so few configurations that half a millimetre is left uncertain."""
    result = calibrate("irb120", campaign("irb120", 7, 5e-5, 4)[1], train="all", model="geometric").robot
    assert result.proof is not None
    return result


def cell_of(robot: Robot, stands: np.ndarray) -> Cell:
    """Return the plate where it stands in the world, and the tool on target 1."""
    in_base = np.linalg.inv(robot.base.matrix) @ stands
    x, y, z = (robot.values[f"target_1_{axis}"] for axis in "xyz")
    return Cell(
        {"tprobe": Placed(None, Transform((x, y, z)))},
        {"wobjplate": Placed(None, Transform.from_matrix(in_base[:3, :3], in_base[:3, 3]))},
    )


@pytest.mark.parametrize("measured", [True, False])
def test_robots_drawn_from_the_covariance_miss_as_expected(robot: Robot, measured: bool) -> None:
    """The right correction of such a robot is where the targets should have gone."""
    proof, read = robot.proof, program(*SOME)
    assert proof is not None
    stands = robot.base.matrix @ read.frames["wobjPlate"].matrix
    result = corrected(robot, read, cell_of(robot, stands) if measured else Cell({}, {}))
    expected = result.expected
    assert expected is not None
    poses = np.array([target.form.kind == "pose" for target in read.targets]) & result.corrected
    rng = np.random.default_rng(1)
    values = {name: robot.values[name] for name in proof.names}
    before, after = [], []
    for _ in range(DRAWS):
        moved = proof.root @ rng.standard_normal(len(values))
        other = robot.with_values({n: v + float(d) for (n, v), d in zip(values.items(), moved, strict=True)})
        right = corrected(other, read, cell_of(other, stands) if measured else Cell({}, {})).after
        before.append(np.linalg.norm((right - result.before)[poses, :3, 3], axis=1))
        after.append(np.linalg.norm((right - result.after)[poses, :3, 3], axis=1))
    assert np.mean(after) == pytest.approx(expected.after[poses].mean(), rel=0.2)
    assert np.mean(before) == pytest.approx(expected.before[poses].mean(), rel=0.2)
    np.testing.assert_allclose(np.mean(after, axis=0), expected.after[poses], rtol=0.5)
    worse = np.mean(np.array(after) > np.array(before))
    assert worse == pytest.approx(expected.worse[poses].mean(), abs=0.05)
    low, high = expected.drawn.interval(result.corrected, poses) or (0.0, 0.0)
    np.testing.assert_allclose(np.percentile(np.mean(after, axis=1), [5, 95]), [low, high], rtol=0.3)


def corrected(robot: Robot, read: Program, cell: Cell) -> Correction:
    return corrected_programs(robot, [read], cell, choice=Choice(every=True)).corrections[0]


def test_the_error_of_the_joints_counts(robot: Robot) -> None:
    proof, read = robot.proof, program(*SOME)
    assert proof is not None
    shaky = sealed(robot, replace(proof, joint_error=(2e-4,) * 6))
    steady = sealed(robot, replace(proof, joint_error=(0.0,) * 6))
    errors = [corrected(result, read, Cell({}, {})).expected for result in (steady, shaky)]
    assert errors[0] is not None
    assert errors[1] is not None
    # Joints that err by 0.2 mrad at arms of some 0.4 m.
    joined = np.sqrt(np.nanmean(errors[1].after ** 2) - np.nanmean(errors[0].after ** 2))
    assert 0.05e-3 < joined < 0.25e-3
    assert (errors[1].worse >= errors[0].worse - 1e-12)[np.isfinite(errors[0].worse)].all()


def test_what_is_not_known_is_not_said(robot: Robot) -> None:
    proof, read = robot.proof, program(*SOME)
    assert proof is not None
    edited = robot.with_values({"a_3": robot.values["a_3"] + 1e-5})
    place = [name for name in proof.names if name.startswith(("base", "target"))]
    placed = replace(
        proof,
        names=tuple(place),
        deviations=(1e-5,) * len(place),
        factor=tuple((0.0,) * i + (1.0,) for i in range(len(place))),
    )
    for other in (replace(robot, proof=None), edited, sealed(robot, placed)):
        result = corrected(other, read, Cell({}, {}))
        assert result.expected is None
        assert result.not_better == ()


def test_one_target_alone_has_no_correction_of_which_something_could_be_promised(robot: Robot) -> None:
    pose = "[[20,20,0],[-0.069237,-0.008501,0.990128,0.121572],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    read = program(pose, points=False)
    result = corrected_programs(robot, [read], Cell({}, {})).corrections[0]
    assert result.expected is not None
    assert np.isnan(result.expected.after[0])
    assert (result.not_better, result.kept, result.edits) == ((), {0: ALONE}, ())
