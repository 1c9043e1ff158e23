"""`truearm iso9283`: plan, simulate, evaluate, in millimetres, degrees and percent."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commanding import Truearm
from tests.iso9283.campaign_files import CUBE, Arguments


@pytest.fixture
def folder(small: Arguments, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "cube.yaml").write_text(CUBE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_plan_is_made_in_percent_and_millimetres(truearm: Truearm, folder: Path) -> None:
    words = ("iso9283", "plan", "irb120", "--cube", "cube.yaml", "--criteria", "AP,t", "--tip", "0,0,100")
    run = truearm(
        *words, "--velocity", "400", "--velocities", "50,10", "--limit-band", "0.2", "--out", "made", "--json"
    )
    summary = json.loads(run.out)
    assert summary["cube_mm"]["side"] == 200.0
    assert summary["rated_velocity_mm_s"] == 400.0
    assert [test["velocities_percent"] for test in summary["tests"]] == [[50.0, 10.0], [50.0]]
    assert "limit_band: 0.2" in (folder / "made" / "plan.yaml").read_text()
    again = truearm(*words, "--out", "other")
    assert (again.code, "rated-velocity-assumed" in again.out) == (0, True)
    assert "Written to other: plan.yaml, robot.yaml, sheet.html" in again.out


def test_an_evaluation_is_printed_as_a_table_or_as_json(truearm: Truearm, folder: Path) -> None:
    words = ("iso9283", "evaluate", "plan.yaml", "--poses", "poses.csv", "--alignment", "alignment.yaml")
    summary = json.loads(truearm(*words, "--noise", "0.001", "--out", "made", "--json").out)
    assert summary["instrument"]["sigma_mm"] == pytest.approx(0.001)
    assert {entry["id"] for entry in summary["criteria"] if entry["status"] != "not-measured"} == {"AP", "RP"}
    run = truearm(*words, "--out", "made", "--compare", "made/iso9283.json")
    assert run.code == 2
    assert "would be overwritten. Choose another --out" in run.err
    run = truearm(*words, "--out", "second", "--compare", "made/iso9283.json")
    assert run.code == 0
    assert "Written to second: iso9283.json, report.html" in run.out
    assert {path.name for path in (folder / "second").iterdir()} >= {"iso9283.json", "report.html"}


def test_a_campaign_is_simulated_with_an_instrument_in_millimetres(truearm: Truearm, folder: Path) -> None:
    words = ("iso9283", "simulate", "irb120", "--plan", "plan.yaml", "--rate", "100", "--seed", "3", "--noise", "0.02")
    run = truearm(*words, "--out", "read")
    assert (run.code, "25 attained poses" in run.out) == (0, True)
    assert (folder / "read" / "poses.csv").exists()
