"""What others rely on of ``truearm plan``."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.data.readers.canonical import read_csv

RULES = """\
truearm: truearm-constraints/1
units: {length: mm, angle: deg}
moments: {2: positive}
floor: 50
"""


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_plan_in_json_and_in_its_files(truearm: Truearm, tmp_path: Path) -> None:
    rules, out = tmp_path / "rules.yaml", tmp_path / "plan.csv"
    rules.write_text(RULES)
    words = ("plan", "irb120", "--poses", 15, "--candidates", 400, "--constraints", rules, "--out", out, "--json")
    summary = json.loads(truearm(*words).out)
    assert {"poses", "indices", "candidates", "rejected", "seconds"} <= set(summary)
    assert (summary["poses"], summary["candidates"]) == (15, 400)
    assert list(summary["indices"]) == ["O1", "O2", "O3", "O4", "O5"]
    assert set(summary["rejected"]) == {"limits", "moment_2", "floor"}
    assert summary["prediction"]["floor_mm"] < summary["prediction"]["planned_mm"]
    rows = rows_of(out)
    assert [row["configuration"] for row in rows] == [str(k + 1) for k in range(15)]
    assert (list(rows[0])[1], list(rows[0])[-1]) == ("joint_1 [deg]", "approach_6 [deg]")
    page = (tmp_path / "plan.html").read_text()
    assert "Where the robot will be accurate" in page
    assert "<script src" not in page
    first = out.read_bytes()
    assert truearm(*words).code == 0
    assert out.read_bytes() == first


def test_inputs_are_not_overwritten_and_refusals_write_nothing(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    data, out = tmp_path / "plan.csv", tmp_path / "other.csv"
    data.write_bytes((small / "data.csv").read_bytes())
    for words, message in (
        (("--from", data, "--poses", 12, "--out", data), "would be overwritten"),
        (("--from", data, "--poses", 10, "--program", "rapid", "--out", tmp_path), "would be overwritten"),
        (("--poses", "many", "--out", out), "a number of poses belongs here"),
        (("--poses", 8, "--floor", -100, "--no-floor", "--out", out), "--floor, --no-floor: a floor is given and"),
        (("--poses", 8, "--speed", "250", "--out", out), "--speed: this is said of a measuring program"),
        (("--poses", 8, "--dwell", "2", "--out", out), "State --program, or leave it out"),
        (("--poses", 8, "--program", "krl", "--out", out.with_suffix("")), "Take --program rapid"),
    ):
        run = truearm("plan", "irb120", *words)
        assert (run.code, message in run.err) == (2, True), words
        assert [path.name for path in tmp_path.iterdir()] == ["plan.csv"], words
    assert data.read_bytes() == (small / "data.csv").read_bytes()


def test_a_choice_among_measured_configurations_keeps_their_names(
    truearm: Truearm, small: Path, tmp_path: Path
) -> None:
    out = tmp_path / "plan.csv"
    run = truearm("plan", "irb120", "--from", small / "data.csv", "--poses", 12, "--model", "elastic", "--out", out)
    assert run.code == 0
    assert "12 of 40 usable configurations" in run.out
    assert "poses are enough" in run.out or "More poses" in run.out
    data = read_csv(small / "data.csv")
    for row in rows_of(out):
        joints = [float(row[f"joint_{k} [deg]"]) for k in range(1, 7)]
        assert np.deg2rad(joints) == pytest.approx(data.joints[data.labels.index(row["configuration"])])


def test_auto_and_a_calibrated_robot(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    assert truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path / "done", "--model=geometric").code == 0
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES.replace("floor: 50", "visibility: {within: 90, targets: {'1': [0, 0, 1]}}"))
    calibrated = tmp_path / "done" / "calibrated.yaml"
    words = ("--poses", "auto", "--candidates", 300, "--constraints", rules, "--out", tmp_path / "plan.csv", "--json")
    run = truearm("plan", calibrated, *words)
    assert run.code == 0
    assert json.loads(run.out)["poses"] >= 11
    run = truearm("plan", "irb120", *words)
    assert run.code == 2
    assert "the position of the instrument is not known" in run.err


def test_floor_room_and_home_of_the_command_line(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    words = ("plan", "irb120", "--poses", 8, "--candidates", 40, "--out", out)
    run = truearm(*words, "--floor", -300, "--clearance", 30, "--home", "0,-20,20,0,30,0", "--json")
    assert run.code == 0
    ways = json.loads(run.out)["ways"]
    assert ways["home"] == pytest.approx([0, -20, 20, 0, 30, 0])
    assert (ways["floor_mm"], ways["clearance_mm"]) == pytest.approx((-300, 30))
    assert ways["room_mm"] >= 30
    rows = rows_of(tmp_path / "plan-ways.csv")
    assert len(rows) == ways["moves"] + 1
    assert "back in" in (tmp_path / "plan.html").read_text()
    run = truearm(*words, "--no-floor", "--details")
    assert run.code == 0
    assert "mm or more from its own links (but for up to 520 mm of the arm where two are connected)." in run.out
    assert f"Written: {out}, {out.with_suffix('.html')}, {tmp_path / 'plan-ways.csv'}" in run.out


def test_a_plan_is_written_into_a_folder_with_its_program(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "out"
    driven = ("--program", "rapid", "--speed", "100,5", "--dwell", "1.5", "--wait", "input 3,60s")
    words = ("plan", "irb120", "--poses", 10, "--candidates", 60, "--clearance", 20, *driven, "--out", out)
    run = truearm(*words, "--details")
    assert (run.code, run.err) == (0, "")
    assert "At most 100 mm/s and 5 % of the joints' speed (250, 250, 250, 320, 320, 420 deg/s); it stands" in run.out
    assert "it stands for 1.5 s, then for input 3 up to 60 s." in run.out
    assert f"Written to {out}: plan.csv, plan.html, plan-ways.csv, sheet.html, MEASURE.mod" in run.out
    assert "state --payload. State the targets" in run.out
    text = (out / "MEASURE.mod").read_text()
    assert "[100," in text
    assert "WaitTime \\InPos,1.5;" in text
    assert "WaitDI di3,1\\MaxTime:=60\\TimeFlag:=late;" in text
    assert "Approach" not in text
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    program_summary = json.loads(truearm(*words, "--json").out)["program"]
    assert (program_summary["speed_mm_s"], program_summary["joint_speed_percent"], program_summary["dwell_s"]) == (
        pytest.approx(100.0),
        5.0,
        1.5,
    )
    again = {path.name: path.read_bytes() for path in out.iterdir()}
    assert again["MEASURE.mod"] == first["MEASURE.mod"]
    assert again["plan.csv"] == first["plan.csv"]
    assert b"--out PLAN" in again["sheet.html"]
