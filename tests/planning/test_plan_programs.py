"""``truearm plan --program``: options in mm/s, percent and seconds, and where everything is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commanding import Truearm

QUICK = ("plan", "irb120", "--poses", "10", "--candidates", "60", "--clearance", "20")


def test_a_plan_is_written_into_a_folder_with_its_program(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (*QUICK, "--program", "rapid", "--speed", "100,5", "--dwell", "1.5", "--wait", "input 3,60s", "--out", out)
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
    told = json.loads(truearm(*words, "--json").out)["program"]
    assert (told["speed_mm_s"], told["joint_speed_percent"], told["dwell_s"]) == (pytest.approx(100.0), 5.0, 1.5)
    again = {path.name: path.read_bytes() for path in out.iterdir()}
    assert again["MEASURE.mod"] == first["MEASURE.mod"]
    assert again["plan.csv"] == first["plan.csv"]
    assert b"--out PLAN" in again["sheet.html"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("--program", "krl"),
            "irb120: the controllers of ABB do not speak KRL; got 'krl'; allowed: rapid.",
        ),
        (("--program", "krl"), "Take --program rapid"),
        (("--program", "rapidd"), "Did you mean"),
        (("--speed", "250"), "--speed: this is said of a measuring program, and none is asked for"),
        (("--approach",), "--approach: this is said of a measuring program"),
        (("--dwell", "2"), "State --program, or leave it out"),
        (("--wait", "operator"), "--wait: this is said of a measuring program"),
        (("--program", "rapid", "--speed", "fast"), "--speed: numbers separated by commas belong here; got 'fast'"),
        (("--program", "rapid", "--speed", "250,10,1"), "--speed: one or two numbers belong here; got 3; allowed"),
        (("--program", "rapid", "--speed", "0"), "allowed: 1 to 5000 mm/s"),
        (("--program", "rapid", "--speed", "9000"), "got '9000 mm/s'"),
        (("--program", "rapid", "--speed", "250,0.1"), "got '0.1 %'; allowed: 1 to 100 %"),
        (("--program", "rapid", "--dwell", "-1"), "--dwell: the number is out of range; got -1 s"),
        (("--program", "rapid", "--dwell", "301"), "allowed: above 0, up to 300 s"),
        (
            ("--program", "rapid", "--wait", "button"),
            "--wait: there is no such wait; got 'button'; allowed: time; input",
        ),
        (("--clearance", "-5"), "--clearance: the number is out of range; got -5 mm; allowed: 0 mm or"),
    ],
)
def test_refusals_write_nothing(truearm: Truearm, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    run = truearm(*QUICK[:-2], *words, "--out", tmp_path / "out")
    assert run.code == 2
    assert message in run.err
    assert not list(tmp_path.iterdir())


def test_a_file_is_no_place_for_a_program_and_readings_are_kept(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    run = truearm(*QUICK, "--program", "rapid", "--out", tmp_path / "plan.csv")
    assert run.code == 2
    assert "--out: a plan with a program needs a folder" in run.err
    data = tmp_path / "plan.csv"
    data.write_bytes((small / "data.csv").read_bytes())
    words = ("plan", "irb120", "--from", data, "--poses", "10", "--program", "rapid", "--out", tmp_path)
    run = truearm(*words)
    assert run.code == 2
    assert "would be overwritten" in run.err
    assert data.read_bytes() == (small / "data.csv").read_bytes()
