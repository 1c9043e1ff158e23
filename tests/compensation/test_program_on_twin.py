"""A corrected program on a robot that does what the model does not contain: play, hysteresis, gears, noise."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.plate import PLATE

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.compensation.program_correction import commanded, corrected_programs
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.chosen_targets import Choice
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

NOISE = 0.03e-3
EVERY = Choice(joint_targets=True)
LOW, HIGH = np.radians([[-90, 0, -80, -150, -90, -180], [90, 110, 70, 150, 90, 180]])


def worn_twin(rng: np.random.Generator) -> Twin:
    """Return the IRB 120 of the thesis with hysteresis in every joint and a gear that errs."""
    twin = truth_twin(load_robot("irb120"), "tracker-triangular", rng)
    joints = {
        number: replace(twin.joints.get(number, PERFECT), hysteresis=math.radians(0.004), backlash=math.radians(0.004))
        for number in range(1, 7)
    }
    joints[2] = replace(joints[2], gear=((240, math.radians(0.006), 0.4),))
    return replace(twin, joints=joints)


@pytest.fixture(scope="module")
def campaign() -> tuple[Twin, Calibration]:
    rng = np.random.default_rng(5)
    twin = worn_twin(rng)
    data = measure(twin, rng.uniform(LOW, HIGH, (200, 6)), NOISE, rng)
    return twin, calibrate("irb120", data, model="elastic", payload=twin.robot.payload)


def plate(text: str) -> Program:
    return RAPID.read([Source(Path("plate.mod"), text)])


def original() -> str:
    return PLATE


def missed(twin: Twin, calibration: Calibration, program: Program, meant: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return how far the tip of the twin is from where it was meant to be, as its controller sends it [m]."""
    tips = twin.frames(commanded(calibration.robot, program)[rows])["1"][:, :3, 3]
    return np.asarray(np.linalg.norm(tips - meant[rows], axis=1))


def poses_corrected(found: Correction) -> np.ndarray:
    """Return the corrected targets that are poses."""
    return np.array([i for i, t in enumerate(found.program.targets) if t.form.kind == "pose" and found.corrected[i]])


def corrected(calibration: Calibration, program: Program, cell: Cell) -> Program:
    found = corrected_programs(calibration.robot, [program], cell, choice=EVERY).corrections[0]
    assert found.corrected.all()
    return plate(edited(program.sources[0].text, found.edits))


def all_over_the_workspace(count: int, rng: np.random.Generator) -> str:
    """Return a program that goes to poses all over the workspace, in the work object of the plate."""
    nominal = load_robot("irb120")
    tool, frame = np.eye(4), np.eye(4)
    tool[2, 3], frame[:3, 3] = 0.125, (0.31, -0.11, 0.06)
    joints = rng.uniform(LOW, HIGH, (count, 6))
    poses = np.linalg.inv(frame) @ matrices(nominal, joints) @ tool
    quadrants = np.floor(np.degrees(joints[:, [0, 3, 5]]) / 90).astype(int)
    elbows = branch_rule(nominal).numbers(nominal.forward_kinematics(joints)) & 2  # type: ignore[union-attr]
    lines = [
        f"    MoveJ [[{x:.2f},{y:.2f},{z:.2f}],[{','.join(f'{v:.7f}' for v in q)}],[{a},{b},{c},{elbow}],"
        "[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tProbe\\WObj:=wobjPlate;"
        for (x, y, z), q, (a, b, c), elbow in zip(
            poses[:, :3, 3] * 1e3, quaternion_from_rotation(poses[:, :3, :3]), quadrants, elbows, strict=True
        )
    ]
    head, rest = original().split("  PROC main()")
    return f"{head}  PROC main()\n" + "\n".join(lines) + f"\n  ENDPROC\n  PROC rest(){rest}"


def given(twin: Twin, calibration: Calibration, program: Program) -> tuple[np.ndarray, Cell]:
    """Return where the plate truly is in the world, and tool and plate as a tracker finds them from nine points."""
    stands = twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ program.frames["wobjPlate"].matrix
    seen = stands.copy()
    seen[:3, 3] += NOISE / 3.0 * np.random.default_rng(6).standard_normal(3)
    in_base = np.linalg.inv(calibration.robot.base.matrix) @ seen
    x, y, z = (calibration.robot.values[f"target_1_{axis}"] for axis in "xyz")
    return stands, Cell(
        {"tprobe": Placed(None, Transform((x, y, z)))},
        {"wobjplate": Placed(None, Transform.from_matrix(in_base[:3, :3], in_base[:3, 3]))},
    )


def test_targets_are_reached_within_half_more_than_the_held_out_error(campaign: tuple[Twin, Calibration]) -> None:
    """All over the workspace, as the held-out configurations are; the plate alone may lie better or worse."""
    twin, calibration = campaign
    assert calibration.validation is not None
    held_out = float(calibration.validation.position_norms.mean())
    program = plate(all_over_the_workspace(150, np.random.default_rng(7)))
    stands, cell = given(twin, calibration, program)
    found = corrected_programs(calibration.robot, [program], cell, choice=EVERY).corrections[0]
    after = plate(edited(program.sources[0].text, found.edits))
    meant = (stands @ found.before)[:, :3, 3]
    rows = poses_corrected(found)
    assert len(rows) > 170
    errors = [missed(twin, calibration, one, meant, rows).mean() for one in (program, after)]
    assert errors[1] < 1.5 * held_out
    assert errors[0] > 8 * errors[1]


def test_a_plate_is_reached(campaign: tuple[Twin, Calibration]) -> None:
    twin, calibration = campaign
    assert calibration.validation is not None
    program = plate(original())
    stands, cell = given(twin, calibration, program)
    found = corrected_programs(calibration.robot, [program], cell, choice=EVERY).corrections[0]
    meant = (stands @ found.before)[:, :3, 3]
    rows = poses_corrected(found)
    before = missed(twin, calibration, program, meant, rows).mean()
    after = missed(twin, calibration, corrected(calibration, program, cell), meant, rows).mean()
    assert after < 1.5 * float(calibration.validation.position_norms.mean())
    assert before > 8 * after


def test_without_frames_targets_are_right_to_each_other(campaign: tuple[Twin, Calibration]) -> None:
    """The program as a whole stays where the original was: what is left is judged after the best fit of a plate."""
    twin, calibration = campaign
    assert calibration.validation is not None
    held_out = float(calibration.validation.position_norms.mean())
    program = plate(original())
    after = corrected(calibration, program, Cell({}, {}))
    shapes = []
    found = corrected_programs(calibration.robot, [program], Cell({}, {}), choice=EVERY).corrections[0]
    rows = poses_corrected(found)
    for one in (program, after):
        tips = twin.frames(commanded(calibration.robot, one)[rows])["1"][:, :3, 3]
        shapes.append(fitted(tips, found.before[rows, :3, 3]).mean())
    assert shapes[1] < 1.5 * held_out
    assert shapes[1] < 0.4 * shapes[0]


def fitted(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the distances that are left between points and others after the best rigid motion."""
    a, b = points - points.mean(axis=0), others - others.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.asarray(np.linalg.norm(a @ turn - b, axis=1))
