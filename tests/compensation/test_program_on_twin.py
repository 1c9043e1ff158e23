"""A corrected program on a robot that does what the model does not contain: play, hysteresis, gears, readings' noise."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.compensation.programs.test_rapid import program_of
from truearm.calibration import Calibration, calibrate
from truearm.compensation.cell import Cell, Placed, matrix
from truearm.compensation.gauge import best_agreement
from truearm.compensation.program_correction import commanded, corrected_programs
from truearm.compensation.program_files import edited
from truearm.compensation.programs.program import Program, Source
from truearm.compensation.programs.rapid import RAPID
from truearm.measurement.truths import truth_twin
from truearm.measurement.twin import Twin, measure
from truearm.measurement.twin_joint import PERFECT
from truearm.modeling.transform import Transform
from truearm.robots import load_robot

NOISE = 0.03e-3
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
    from importlib.resources import files

    return (files("truearm.examples") / "plate.mod").read_text()


def missed(twin: Twin, calibration: Calibration, program: Program, meant: np.ndarray) -> np.ndarray:
    """Return how far the tip of the twin is from where it was meant to be, as its controller sends it [m]."""
    poses = [i for i, target in enumerate(program.targets) if target.form.kind == "pose"]
    joints = commanded(calibration.robot, program)[poses]
    tips = twin.frames(joints)["1"][:, :3, 3]
    return np.asarray(np.linalg.norm(tips - meant[poses], axis=1))


def corrected(calibration: Calibration, program: Program, cell: Cell) -> Program:
    found = corrected_programs(calibration.robot, [program], cell).corrections[0]
    assert found.corrected.all()
    return plate(edited(program.sources[0].text, found.edits))


def test_targets_are_reached_within_half_more_than_the_held_out_error(campaign: tuple[Twin, Calibration]) -> None:
    """With tool and plate measured by the same tracker, noise included."""
    twin, calibration = campaign
    assert calibration.validation is not None
    held_out = float(calibration.validation.position_norms.mean())
    program = plate(original())
    stands = matrix(twin.robot.base) @ best_agreement(twin.robot)[0] @ matrix(program.frames["wobjPlate"])
    rng = np.random.default_rng(6)
    seen = stands.copy()
    seen[:3, 3] += NOISE * rng.standard_normal(3)
    in_base = np.linalg.inv(matrix(calibration.robot.base)) @ seen
    target = calibration.robot.values
    tip = Transform(tuple(target[f"target_1_{axis}"] for axis in "xyz"))  # type: ignore[arg-type]
    cell = Cell(
        {"tprobe": Placed(None, tip)},
        {"wobjplate": Placed(None, Transform.from_matrix(in_base[:3, :3], in_base[:3, 3]))},
    )
    found = corrected_programs(calibration.robot, [program], cell).corrections[0]
    meant = (stands @ found.before)[:, :3, 3]
    before = missed(twin, calibration, program, meant).mean()
    after = missed(twin, calibration, corrected(calibration, program, cell), meant).mean()
    assert after < 1.5 * held_out
    assert before > 8 * after


def test_without_frames_targets_are_right_to_each_other(campaign: tuple[Twin, Calibration]) -> None:
    """The program as a whole stays where the original was: what is left is judged after the best fit of a plate."""
    twin, calibration = campaign
    assert calibration.validation is not None
    held_out = float(calibration.validation.position_norms.mean())
    program = plate(original())
    after = corrected(calibration, program, Cell({}, {}))
    shapes = []
    for one in (program, after):
        poses = [i for i, target in enumerate(one.targets) if target.form.kind == "pose"]
        tips = twin.frames(commanded(calibration.robot, one)[poses])["1"][:, :3, 3]
        found = corrected_programs(calibration.robot, [program], Cell({}, {})).corrections[0]
        shapes.append(fitted(tips, found.before[poses, :3, 3]).mean())
    assert shapes[1] < 1.5 * held_out
    assert shapes[1] < 0.4 * shapes[0]


def fitted(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the distances that are left between points and others after the best rigid motion."""
    a, b = points - points.mean(axis=0), others - others.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.asarray(np.linalg.norm(a @ turn - b, axis=1))


def test_the_program_generator_is_a_program() -> None:
    assert len(RAPID.read(program_of(50)).targets) >= 50
