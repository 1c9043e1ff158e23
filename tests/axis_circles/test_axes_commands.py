"""``truearm axes``, ``tolerance`` and ``lines``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.axis_circles.test_axes import runs
from tests.commanding import Truearm

from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure


@pytest.fixture(scope="module")
def kr5(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Axis by axis on the KR5 of Table 3, in its own frame."""
    rng = np.random.default_rng(0)
    twin = truth_twin(load_robot("kr5"), "axis-tests", rng)
    robot = twin.robot.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})
    joints = runs(10.0, (0, -90, 90, 0, 30, 0))
    path = tmp_path_factory.mktemp("kr5") / "axes.csv"
    path.write_text(csv_text(measure(type(twin)(robot), joints, 2e-5, rng)))
    return path


def test_axes_tolerance_and_lines(truearm: Truearm, kr5: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run = truearm("axes", "kr5", kr5, "--measurement-frame", "robot", "--out", out, "--json")
    assert run.code == 0, run.err
    said = json.loads(run.out)
    assert said == json.loads((out / "axes.json").read_text())
    assert [c["joint"] for c in said["circles"]] == [1, 2, 3, 4, 5, 6]
    assert len(said["joint_errors"]["found"]) == 24
    assert [e["name"] for e in said["joint_errors"]["unseen"] if e["moves_flange"]] == ["ez_6"]
    found = {e["name"]: e for e in said["joint_errors"]["found"]}
    assert found["ebeta_2"]["value"] == pytest.approx(0.1813, abs=0.005)
    assert found["ebeta_2"]["interval"][0] < found["ebeta_2"]["value"] < found["ebeta_2"]["interval"][1]
    plain = truearm("axes", "kr5", kr5, "--measurement-frame", "robot", "--details", "--out", out)
    assert "ez_6 (moves the flange)" in plain.out
    errors = out / "joint-errors.yaml"

    tolerances = json.loads(truearm("tolerance", errors, "--depth", "50", "--json").out)
    assert tolerances["joints"][1]["lean_mm"] == pytest.approx(50 * np.tan(np.radians(0.1814)), abs=0.01)
    allowed = json.loads(truearm("tolerance", "kr5", "--depth", "50", "--lean", "0.02", "--json").out)
    assert allowed["together"]["worst_mm"] > allowed["together"]["root_of_squares_mm"] > 0.3

    words = ("lines", "kr5", "--centre", "850,0,600", "--joint-errors", errors, "--truth", "axis-tests")
    lines = json.loads(truearm(*words, "--out", tmp_path / "plan.csv", "--json").out)["lines"]
    assert len(lines) == 7
    assert min(line["reduction_percent"] for line in lines) > 95.0
    assert len((tmp_path / "plan.csv").read_text().splitlines()) == 78
    assert "xyz" in truearm(*words).out


def test_measured_lines_are_judged(truearm: Truearm, kr5: Path, tmp_path: Path) -> None:
    truearm("axes", "kr5", kr5, "--measurement-frame", "robot", "--out", tmp_path)
    truearm("lines", "kr5", "--centre", "850,0,600", "--out", tmp_path / "plan.csv")
    rows = [line.split(",") for line in (tmp_path / "plan.csv").read_text().splitlines()[1:]]
    rng = np.random.default_rng(1)
    true = truth_twin(load_robot("kr5"), "axis-tests", rng).robot.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})
    joints = np.radians([[float(cell) for cell in row[1:]] for row in rows])
    position = true.world_poses(joints, "smr")[0] * 1e3
    text = "configuration," + ",".join(f"joint_{i} [deg]" for i in range(1, 7)) + ",target,x [mm],y [mm],z [mm]\n"
    for row, place in zip(rows, position.tolist(), strict=True):
        text += ",".join([*row, "smr", *map(repr, place)]) + "\n"
    (tmp_path / "measured.csv").write_text(text)
    words = ("lines", "kr5", "--centre", "850,0,600", "--data", tmp_path / "measured.csv", "--json")
    known = json.loads(truearm(*words, "--joint-errors", tmp_path / "joint-errors.yaml").out)["lines"]
    assert max(line["before_mm"]["max"] for line in known) == pytest.approx(3.7, abs=0.6)
    placed = json.loads(truearm(*words).out)["lines"]  # base and target fitted to the lines themselves
    assert max(line["before_mm"]["max"] for line in placed) < max(line["before_mm"]["max"] for line in known)


def test_refusals(truearm: Truearm, kr5: Path, small: Path, tmp_path: Path) -> None:
    for words, part in (
        (("axes", "irb120", small / "data.csv", "--out", tmp_path), "one joint moves alone"),
        (("axes", "kr5", kr5, "--measurement-frame", "table", "--out", tmp_path), "there is no frame of this name"),
        (("tolerance", "kr5", "--depth", "50"), "not described by joint errors"),
        (("tolerance", "kr5", "--depth", "0", "--lean", "1"), "--depth: a hole needs a depth"),
        (("tolerance", "kr5", "--depth", "50", "--lean", "-1"), "--lean: the length is out of range; got '-1 mm'"),
        (("tolerance", "kr5", "--depth", "50,40"), "6 lengths, or one for all"),
        (("lines", "kr5", "--centre", "850,0"), "3 lengths"),
        (("lines", "kr5", "--centre", "2850,0,600"), "cannot go to a pose"),
        (("lines", "kr5", "--centre", "850,0,600", "--truth", "random", "--data", "x.csv"), "only one of them"),
        (("lines", "kr5", "--centre", "850,0,600", "--joint-errors", "kr5"), "not described by joint errors"),
    ):
        run = truearm(*words)
        assert run.code == 2
        assert part in run.err, run.err
    truearm("convert", "irb120", "--convention", "joint-errors", "--out", tmp_path / "other.yaml")
    other = truearm("lines", "kr5", "--centre", "850,0,600", "--joint-errors", tmp_path / "other.yaml")
    assert "--joint-errors: these joint errors belong to another robot than kr5" in other.err
