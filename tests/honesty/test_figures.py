"""A figure is what its words say: a sum stays a sum, what nobody saw is unknown, and an interval holds the truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.honesty.telling import Told, told, written
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin, measure


def errors_of(folder: Path, true: dict[str, float]) -> Path:
    """Return the joint errors of a KR 5 that circles find [m, rad]."""
    robot = converted(load_robot("kr5"), "joint-errors").with_values(true)
    twin = Twin(robot.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)}))
    posture = np.radians([0.0, -90.0, 90.0, 0.0, 30.0, 0.0])
    joints = np.repeat(posture[None], 6 * 21, axis=0)
    for number in range(6):
        joints[21 * number : 21 * (number + 1), number] = np.radians(np.linspace(-60.0, 60.0, 21))
    data = written(folder, measure(twin, joints, 2e-5, np.random.default_rng(0)))
    assert told("axes", "kr5", data, "--measurement-frame", "robot", "--out", folder / "axes").code == 0
    return folder / "axes" / "joint-errors.yaml"


def test_an_error_that_another_joint_can_have_as_well_is_not_blamed_on_that(tmp_path: Path) -> None:
    answer = told("tolerance", errors_of(tmp_path, {"ez_1": 3e-4}), "--depth", 50)
    rows = {row["is"]: row for row in answer.summary["positions"]}
    assert rows["ey_2 + ez_1"]["joints"] == [1, 2]
    assert rows["ey_2 + ez_1"]["90_mm"][0] < 0.3 < rows["ey_2 + ez_1"]["90_mm"][1]
    unseen = [name for name, row in rows.items() if row["mm"] is None and row["90_mm"] is None]
    assert unseen == [f"ez_{joint}" for joint in range(1, 7)]
    beside = [row for name, row in rows.items() if row["mm"] is not None and name != "ey_2 + ez_1"]
    assert len(beside) == 11
    assert max(abs(row["mm"]) for row in beside) < 0.1
    assert all(row["lean_90_mm"][0] == 0.0 and row["towards_90_deg"] is None for row in answer.summary["leans"])


def test_errors_that_are_all_known_are_no_sums(tmp_path: Path) -> None:
    """The same robot, measured by somebody who knows of each error how large it is."""
    robot = converted(load_robot("kr5"), "joint-errors").with_values({"ez_1": 3e-4})
    errors = [p for p in robot.parameters.values() if p.group == "geometry"]
    robot = robot.with_parameters(replace(p, deviation=1e-5) for p in errors)
    (tmp_path / "robot.yaml").write_text(robot_text(robot))
    answer = told("tolerance", tmp_path / "robot.yaml", "--depth", 50)
    rows = answer.summary["positions"]
    assert [row["is"] for row in rows] == [f"{slide}_{i}" for i in range(1, 7) for slide in ("ex", "ey", "ez")]
    assert [row["joints"] for row in rows] == [[i] for i in range(1, 7) for _ in range(3)]
    assert all(row["mm"] is not None and row["90_mm"] is not None for row in rows)


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Dataset]:
    """Return a calibrated robot, and readings that it was not calibrated with."""
    folder = tmp_path_factory.mktemp("calibrated")
    twin, data = campaign("irb120", 40, 2e-5, 3)
    assert told("calibrate", "irb120", written(folder, data), "--model", "geometric", "--out", folder / "out").code == 0
    joints = twin.robot.random_configurations(12, np.random.default_rng(1))
    return folder / "out" / "calibrated.yaml", measure(twin, joints, 2e-5, np.random.default_rng(2))


def validated(calibrated: tuple[Path, Dataset], folder: Path, joints: Array, position: Array) -> Told:
    robot, data = calibrated
    shape = (len(joints), len(data.targets), 3)
    again = Dataset.of(joints, position.reshape(shape), targets=data.targets, sigma=2e-5, source="check")
    return told("validate", robot, written(folder, again))


def test_rows_that_were_copied_show_no_repeatability(calibrated: tuple[Path, Dataset], tmp_path: Path) -> None:
    _, data = calibrated
    joints, position = np.tile(data.joints, (2, 1)), np.tile(data.position, (2, 1))
    answer = validated(calibrated, tmp_path, joints, position)
    assert answer.says("duplicates", "warning", "Rows were copied")
    assert answer.summary["least_error"]["position_mm"]["evidence"] == "declared"
    # read anew, they do
    anew = position + np.random.default_rng(3).normal(0.0, 2e-5, position.shape)
    answer = validated(calibrated, tmp_path, joints, anew)
    assert "duplicates" not in answer.levels
    assert answer.summary["least_error"]["position_mm"]["evidence"] == "visits"


@pytest.mark.parametrize("wild", [1, 3])
def test_a_few_wild_readings_are_named_before_the_robot_is_doubted(
    wild: int, calibrated: tuple[Path, Dataset], tmp_path: Path
) -> None:
    _, data = calibrated
    off = np.zeros_like(data.position)
    off[4 : 4 + wild] = [0.0, 5e-3, 0.0]
    answer = validated(calibrated, tmp_path, data.joints, data.position + off)
    assert answer.says(
        "beyond-proof", "warning", f"That comes from {wild} reading.*: 2 at 2.*before you doubt the robot"
    )
    assert "The robot changed" not in answer.messages["beyond-proof"]
    # the robot that changed is doubted, and the one that did not is not
    bent = data.joints + 0.002 * np.eye(6)[2]
    changed = validated(calibrated, tmp_path, bent, data.position)
    assert changed.says("beyond-proof", "error", "The robot changed since")
    assert "beyond-proof" not in validated(calibrated, tmp_path, data.joints, data.position).levels
