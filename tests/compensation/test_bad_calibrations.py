"""Programs corrected with calibrations that know little where the program is: nothing gets worse without a word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.compensation.test_program_on_twin import plate
from tests.plate import PLATE

import truearm
from truearm import InputError
from truearm.calibration.result import Calibration
from truearm.compensation.program_correction import commanded
from truearm.compensation.result import ProgramCorrection
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

ORIGINAL = PLATE
NOISE = 2e-5


def far_from_the_plate(seed: int) -> tuple[Twin, Calibration]:
    """Return a calibration from postures within 3 deg of one on the other side of the robot."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    middle = np.radians([130, -70, 40, rng.uniform(-120, 120), rng.uniform(-90, 90), 90])
    half = np.radians(3)
    return twin, truearm.calibrate(
        "irb120", measure(twin, rng.uniform(middle - half, middle + half, (60, 6)), NOISE, rng)
    )


def stands(twin: Twin) -> np.ndarray:
    return np.asarray(
        twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ plate(ORIGINAL).frames["wobjPlate"].matrix
    )


def corrected(twin: Twin, calibration: Calibration, folder: Path, **how: object) -> ProgramCorrection:
    """Return the plate's program corrected, with the plate and the probe where they are."""
    program, cell = folder / "plate.mod", folder / "cell.yaml"
    program.write_text(ORIGINAL)
    frame = stands(twin)
    place, quaternion = (
        ", ".join(f"{v:.9f}" for v in values)
        for values in (frame[:3, 3] * 1e3, quaternion_from_rotation(frame[None, :3, :3])[0])
    )
    cell.write_text(
        'truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\ntools:\n  tProbe: {of: flange, target: "1"}\n'
        f"frames:\n  wobjPlate: {{of: world, translation: [{place}], quaternion: [{quaternion}]}}\n"
    )
    return compensate(calibration.robot, [program], tools=cell, frames=cell, joint_targets="correct", **how)  # type: ignore[arg-type]


def missed(twin: Twin, done: ProgramCorrection) -> tuple[float, float]:
    """Return how far the twin is from the poses of the plate on average [m], with the original and the new program."""
    found = done.result.corrections[0]
    rows = [row for row, target in enumerate(found.program.targets) if target.form.kind == "pose"]
    meant = (stands(twin) @ found.before)[rows, :3, 3]
    tips = [
        twin.frames(commanded(done.robot, one)[rows])["1"][:, :3, 3] for one in (found.program, done.as_written()[0])
    ]
    before, after = (float(np.linalg.norm(tip - meant, axis=1).mean()) for tip in tips)
    return before, after


def test_a_program_that_would_get_worse_stays_as_it_was(tmp_path: Path) -> None:
    twin, calibration = far_from_the_plate(34)
    assert calibration.status.value == "converged"
    assert calibration.validation is not None
    assert calibration.validation.position_norms.mean() < 0.05e-3
    everything = corrected(twin, calibration, tmp_path, accept=["not-better-here"])
    before, after = missed(twin, everything)
    assert after > 1.1 * before
    done = corrected(twin, calibration, tmp_path)
    assert missed(twin, done)[1] == pytest.approx(before, rel=0.01)
    assert {"not-better-here", "narrow-data"} <= {notice.code for notice in done.warnings}
    (notice,) = [notice for notice in done.warnings if notice.code == "not-better-here"]
    assert "stay as before" in notice.message
    assert "outside of what was measured" in notice.message


def test_a_program_that_gets_better_is_corrected_all_the_same(tmp_path: Path) -> None:
    twin, calibration = far_from_the_plate(8)
    done = corrected(twin, calibration, tmp_path)
    before, after = missed(twin, done)
    assert after < 0.2 * before
    assert done.files[0].corrected == done.files[0].targets
    assert "not-better-here" not in {notice.code for notice in done.warnings}
    assert done.files[0].expected is not None
    # It knows that it is not known to 0.03 mm here, as the held-out configurations would have it.
    assert 0.3e-3 < done.files[0].expected[1].mean() < 3e-3


def test_three_configurations_correct_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    calibration = truearm.calibrate(
        "irb120", measure(twin, twin.robot.random_configurations(3, rng), NOISE, rng), train="all"
    )
    with pytest.raises(InputError, match="got 'rank-loss'"):
        corrected(twin, calibration, tmp_path)
