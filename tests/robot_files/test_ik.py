"""``truearm ik``: its file, its words, its exit codes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.robot.inverse.branches import BRANCHES
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import quaternion_from_rotation

HEADER = ["pose", "branch", "status", *(f"joint_{n} [deg]" for n in range(1, 7))]
HEADER += ["position_error [mm]", "orientation_error [mrad]"]
Q = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [-70.0, 30.0, 0.0, -20.0, 40.0, 0.0]])


@pytest.fixture
def poses(tmp_path: Path) -> Path:
    """Two poses of the IRB 120 in its base frame."""
    p, R = load_robot("irb120").world_poses(Q)
    return _written(tmp_path / "poses.csv", p, quaternion_from_rotation(R))


def _written(file: Path, p: np.ndarray, quaternion: np.ndarray) -> Path:
    lines = ["pose,x [mm],y [mm],z [mm],qw,qx,qy,qz"]
    for number, row in enumerate(np.hstack([p * 1e3, quaternion]).tolist(), 1):
        lines.append(f"P{number},{','.join(map(repr, row))}")
    file.write_text("\n".join(lines) + "\n")
    return file


def _rows(file: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(file.read_text().splitlines()))


def _joints(row: dict[str, str]) -> list[float]:
    return [float(row[f"joint_{n} [deg]"]) for n in range(1, 7)]


def test_one_branch(truearm: Truearm, poses: Path, tmp_path: Path) -> None:
    out = tmp_path / "joints.csv"
    run = truearm("ik", "irb120", poses, "--branch", "front-up-noflip", "--out", out)
    assert run.code == 0
    assert "2 of 2 poses reached" in run.out
    rows = _rows(out)
    assert list(rows[0]) == HEADER
    for row, q in zip(rows, Q, strict=True):
        assert (row["branch"], row["status"]) == ("front-up-noflip", "reached")
        assert _joints(row) == pytest.approx(np.degrees(q), abs=1e-9)
        assert float(row["position_error [mm]"]) < 1e-9
        assert float(row["orientation_error [mrad]"]) < 1e-9


def test_all_branches_and_json(truearm: Truearm, poses: Path, tmp_path: Path) -> None:
    out = tmp_path / "j.csv"
    summary = json.loads(truearm("ik", "irb120", poses, "--branch", "all", "--out", out, "--json").out)
    assert list(summary) == ["poses", "poses_reached", "rows", "joints_are", "status", "attention", "warnings"]
    assert (summary["poses"], summary["poses_reached"]) == (2, 2)
    rows = _rows(out)
    assert len(rows) == summary["rows"] == sum(summary["status"].values()) == 16
    assert {row["branch"] for row in rows} == set(BRANCHES)
    p, R = load_robot("katana450").world_poses(np.radians([[10, 40, -30, 20, 50.0]]))
    five = _written(tmp_path / "five.csv", p, quaternion_from_rotation(R))
    assert truearm("ik", "katana450", five, "--axis-only", "--out", out).code == 0


def test_a_seed_is_of_the_kind_that_is_written(truearm: Truearm, tmp_path: Path) -> None:
    robot, out = load_robot("lrmate200ic"), tmp_path / "j.csv"
    shown = np.array([10.0, 20.0, 30.0, 40.0, 50.0, -300.0])
    p, R = robot.forward(robot.controller.to_model(np.radians(shown[None])), frame="controller")
    poses_file = _written(tmp_path / "there.csv", p, quaternion_from_rotation(R))
    words = ("ik", "lrmate200ic", poses_file, "--frame", "controller", "--out", out, "--seed-joints")
    run = truearm(*words, ",".join(map(str, shown)))
    assert "Joint positions in the file are those that the robot's controller shows (axis_i)." in run.out
    assert "model-frame" not in run.out
    assert [float(_rows(out)[0][f"axis_{n} [deg]"]) for n in range(1, 7)] == pytest.approx(shown)
    assert truearm(*words, "10,20,-50,-40,-50,300", "--joints", "model").code == 0
    assert _joints(_rows(out)[0]) == pytest.approx([10, 20, -50, -40, -50, 300])


def test_seed_target_frame_and_free_orientation(truearm: Truearm, poses: Path, tmp_path: Path) -> None:
    out = tmp_path / "j.csv"
    seed = "10,20,-30,40,50,100"
    assert truearm("ik", "irb120", poses, "--seed-joints", seed, "--frame", "world", "--out", out).code == 0
    assert _joints(_rows(out)[0]) == pytest.approx(np.degrees(Q[0]), abs=1e-9)
    seed = "10,20,-30,40,50,-250"
    assert truearm("ik", "irb120", poses, "--seed-joints", seed, "--out", out).code == 0
    assert _joints(_rows(out)[0])[5] == pytest.approx(-300, abs=1e-9)
    plain = tmp_path / "plain.csv"
    plain.write_text("pose,x [mm],y [mm],z [mm]\nA,300,100,500\n")
    assert truearm("ik", "irb120", plain, "--position-only", "--out", out).code == 0
    assert _rows(out)[0]["orientation_error [mrad]"] == ""
    assert _rows(out)[0]["branch"] == ""
    assert truearm("ik", "irb120", poses, "--axis-only", "--out", out).code == 0
    run = truearm("ik", "irb120", plain, "--out", out)
    assert run.code == 2
    assert "Add them, or use --position-only." in run.err


def test_what_is_not_reached_is_explained_and_ends_with_3(truearm: Truearm, tmp_path: Path) -> None:
    p, R = load_robot("irb120").world_poses(np.vstack([Q[:1], np.zeros((1, 6)), Q[:1]]))
    p[2] *= 5
    poses, out = _written(tmp_path / "poses.csv", p, quaternion_from_rotation(R)), tmp_path / "j.csv"
    run = truearm("ik", "irb120", poses, "--out", out)
    assert run.code == 3
    assert "2 of 3 poses reached" in run.out
    assert "P2 (" in run.out
    assert "near-singular" in run.out
    assert "P3 (" in run.out
    assert "mm and" in run.out
    assert [row["status"] for row in _rows(out)] == ["reached", "near-singular", "unreachable"]
    attention = json.loads(truearm("ik", "irb120", poses, "--out", out, "--json").out)["attention"]
    assert [entry["pose"] for entry in attention] == ["P2", "P3"]
    assert list(attention[0]) == ["pose", "branch", "status", "advice"]


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ("not as many numbers as joints; got '3 numbers'", ["--seed-joints", "1,2,3"]),
        ("numbers separated by commas", ["--seed-joints", "a,b"]),
        ("there is no target; got 'gripper'", ["--target", "gripper"]),
        ("--seed-joints: NaN and infinity cannot be used here", ["--seed-joints", "nan,0,0,0,0,0"]),
        ("--position-only, --axis-only: only one of them", ["--position-only", "--axis-only"]),
    ],
)
def test_refusals(truearm: Truearm, poses: Path, tmp_path: Path, words: str, options: list[str]) -> None:
    run = truearm("ik", "irb120", poses, *options, "--out", tmp_path / "j.csv")
    assert (run.code, words in run.err) == (2, True)
    assert not (tmp_path / "j.csv").exists()
