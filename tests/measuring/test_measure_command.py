"""The command that measures: what it prints, its JSON, its exit codes, and what a kill leaves."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.commanding import Truearm
from tests.house.examples import MEASURED_PLAN

MAPPING = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: mm
readings: [{target: a, x: X, y: Y, z: Z}]
joints: {file: plan.csv}
"""


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "plan.csv"
    path.write_text(MEASURED_PLAN)
    return path


def test_one_line_a_reading_then_what_came_of_it(truearm: Truearm, plan: Path, tmp_path: Path) -> None:
    words = ("measure", plan, "irb120", "--device", "measurement-arm", "--out", tmp_path / "out")
    run = truearm(*words, "--most-deviation", "0.5")
    assert run.code == 0
    first, *_, last = run.out.splitlines()
    assert first.startswith("   1  P1 nest  ")
    assert " mm  deviation 0.0" in first
    assert last == f"Written to {tmp_path / 'out'}: measurements.csv, measure.html, and the log readings.csv"
    again = truearm(*words, "--most-deviation", "0.5", "--json")
    summary = json.loads(again.out)
    assert list(summary)[2:6] == ["finished", "configurations", "targets", "kept"]
    assert (summary["finished"], summary["kept"]) == (True, {"targets": 3, "nests": 0})
    assert "Going on after 3 entries" in again.err
    other = truearm(*words)
    assert other.code == 2
    assert "limit of what is kept" in other.err


def test_the_token_that_is_given_stands_in_no_file_and_no_line(truearm: Truearm, plan: Path, tmp_path: Path) -> None:
    token = "this-is-the-secret-of-the-test"
    given = ("--listen", 0, "--token", token, "--target", "a", "--timeout", 0)
    run = truearm("measure", plan, "irb120", *given, "--out", tmp_path / "out")
    assert run.code == 0
    assert "Listening on 127.0.0.1 port" in run.out
    assert token not in run.out + run.err
    assert all(token.encode() not in path.read_bytes() for path in (tmp_path / "out").iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="another kind of signals")
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGKILL])
def test_a_process_that_is_stopped_leaves_its_log_and_goes_on(
    truearm: Truearm, plan: Path, tmp_path: Path, stop: signal.Signals
) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "map.yaml").write_text(MAPPING)
    (tmp_path / "in" / "a.csv").write_text("Pose,X,Y,Z\nP1,1,2,3\nP2,1,2,4\n")
    words = ["measure", str(plan), "irb120", "--watch", str(tmp_path / "in"), "--map", str(tmp_path / "map.yaml")]
    words += ["--out", str(tmp_path / "out"), "--target", "a"]
    log = tmp_path / "out" / "readings.csv"
    process = subprocess.Popen(
        [sys.executable, "-m", "truearm", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not (log.exists() and log.read_text().count("\n") == 3):
        time.sleep(0.05)
    os.kill(process.pid, stop)
    out, _ = process.communicate(timeout=60.0)
    assert log.read_text().count("\n") == 3
    if stop == signal.SIGINT:
        assert process.returncode == 0
        assert "Warning (unfinished)" in out
        assert (tmp_path / "out" / "measurements.csv").exists()
    (tmp_path / "in" / "b.csv").write_text("Pose,X,Y,Z\nP3,1,2,5\n")
    run = truearm(*words)
    assert run.code == 0
    assert "3 of 3 configurations measured" in run.out
