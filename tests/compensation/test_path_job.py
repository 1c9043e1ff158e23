"""Paths as a job and a command: what they write, and what they refuse."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import refused
from tests.house.examples import EXAMPLES, PATH

import truearm as package
from truearm.engine.base.errors import InputError


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    robot = EXAMPLES["path"](tmp_path_factory.mktemp("path"))["robot"]
    assert isinstance(robot, Path)
    return robot


def test_a_path_is_written_with_its_correction_and_programs(truearm: Truearm, calibrated: Path, tmp_path: Path) -> None:
    (tmp_path / "path.yaml").write_text(PATH)
    out = tmp_path / "out"
    words = ("--program", "rapid", "--program", "val3", "--spacing", 0.3, "--seed-joints", "0,11,23,0,52,0")
    run = truearm("path", calibrated, tmp_path / "path.yaml", *words, "--out", out)
    assert run.code == 0, run.err
    names = ["motion.csv", "corrected.csv", "loads.csv", "report.html", "truearm_path.mod"]
    names += [f"truearm_path/{name}" for name in ("truearm_path.dtx", "start.pgx", "truearm_path.pjx")]
    assert all((out / name).is_file() for name in names)
    assert "without correction" in run.out
    assert "geometry corrected" in run.out
    header, *rows = (line.split(",") for line in (out / "corrected.csv").read_text().splitlines())
    assert header == [
        *("time [s]", "section"),
        *(f"joint_{i} [deg]" for i in range(1, 7)),
        *("tip_x [mm]", "tip_y [mm]", "tip_z [mm]", "error_before [mm]", "error_after [mm]"),
    ]
    table = np.array(rows, float)
    result = package.path(calibrated, tmp_path / "path.yaml", seed_joints=np.radians([0, 11, 23, 0, 52, 0]))
    assert np.radians(table[:, 2:8]) == pytest.approx(result.joints, abs=1e-12)
    assert table[:, 8:11] == pytest.approx(1e3 * result.path.planned.trajectory.position, abs=1e-5)
    assert table[:, 12].max() < 1e-5 < table[:, 11].mean()
    loads = (out / "loads.csv").read_text().splitlines()
    assert loads[0].startswith("time [s],force_x_1 [N],force_y_1 [N],force_z_1 [N],moment_x_1 [N m]")
    assert len(loads) == len(rows) + 1
    codes = {
        notice.code: notice.level
        for notice in package.path(calibrated, tmp_path / "path.yaml", languages=["krl"]).warnings
    }
    assert codes["maker"] == "warning"
    assert codes["untimed-moves"] == "note"
    poses = partial(package.path, calibrated, tmp_path / "path.yaml", languages=["rapid"], move_to="poses", spacing=0.5)
    with pytest.raises(InputError, match="Absolute Accuracy"):
        poses()
    far = poses(controller_kinematics="nominal")
    assert {notice.code: notice.level for notice in far.warnings}["between-targets"] == "warning"


def test_a_nominal_robot_follows_the_path_and_is_not_corrected(tmp_path: Path) -> None:
    (tmp_path / "path.yaml").write_text(PATH)
    result = package.path(
        "irb120", tmp_path / "path.yaml", languages=["urscript"], move_to="poses", out=tmp_path / "out"
    )
    assert not (tmp_path / "out" / "corrected.csv").exists()
    assert "nothing to correct" in result.lines()[1]
    assert "corrected by truearm" not in result.programs["truearm_path.script"]
    assert result.summary()["error_mm"] == {}


def test_poses_for_a_controller_with_kinematics_of_its_own_are_refused(tmp_path: Path) -> None:
    robot = package.load_robot("ur5")
    robot = robot.with_values({"a_2": robot.values["a_2"] + 1e-3})
    file, seed = tmp_path / "path.yaml", np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
    file.write_text(PATH.replace("joint_speeds: [250, 250, 250, 320, 320, 420]\n", ""))
    follow = partial(package.path, robot, file, languages=["urscript"], seed_joints=seed)
    assert follow().programs
    refused("controller_kinematics", "what the factory measured", follow, move_to="poses")
    words = follow(move_to="poses", controller_kinematics="nominal")
    assert "controller-nominal" in {notice.code for notice in words.warnings}


def test_what_cannot_be_followed_is_refused(calibrated: Path, tmp_path: Path) -> None:
    file = tmp_path / "path.yaml"
    file.write_text(PATH)
    for parameter, value, words in (
        ("name", {"languages": ["rapid"], "name": "2nd"}, "cannot be called so in every language"),
        ("move_to", {"languages": ["rapid"], "move_to": "pulses"}, "no kind of targets of this name"),
        ("seed_joints", {"seed_joints": (0.0, 0.0)}, "seed_joints"),
        ("accept", {"accept": ["anything"]}, "anything"),
    ):
        refused(parameter, words, package.path, calibrated, file, **value)
    refused("file", "no such file", package.path, calibrated, "way.yaml")
    file.write_text(PATH.replace("- line: [350, 60, 250]", "- line: [350, 60, 250]\n  - line: [900, 60, 250]"))
    refused("file", r"mm along the path, at .* s \(sample \d+\)", package.path, calibrated, file)
