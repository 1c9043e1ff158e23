"""How the command ends when its output goes nowhere, when it is interrupted, and when the machine says no."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.cli.conftest import Truearm

COMMAND = [sys.executable, "-m", "truearm"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("words", [["robots"], ["show", "irb120", "--json"], ["--help"], ["--version"]])
def test_output_that_finds_no_room(words: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*COMMAND, *words], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (2, "truearm: output: No space left on device.\n")


@pytest.mark.skipif(sys.platform == "win32", reason="pipes end in another way")
def test_output_that_nobody_reads() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*COMMAND, "show", "irb120", "--json"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


def test_an_interrupted_run(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("truearm.jobs.load_robot.load_robot", interrupted)
    run = truearm("show", "irb120")
    assert (run.code, run.out, run.err) == (130, "", "")


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (np.linalg.LinAlgError("SVD did not converge"), "the equations cannot be solved (SVD did not converge)"),
        (OSError(5, "Input/output error", "disk"), "truearm: disk: Input/output error."),
    ],
)
def test_what_only_shows_while_running(
    truearm: Truearm, monkeypatch: pytest.MonkeyPatch, error: Exception, message: str
) -> None:
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr("truearm.jobs.load_robot.load_robot", fails)
    run = truearm("show", "irb120")
    assert run.code == 2
    assert message in run.err
    assert len(run.err.splitlines()) == 1


def test_text_that_the_output_cannot_hold(truearm: Truearm, tmp_path: Path) -> None:
    truearm("new-robot", tmp_path / "r.yaml")
    text = (tmp_path / "r.yaml").read_text().replace("title: My six-axis robot", r'title: "half a character \ud800"')
    (tmp_path / "r.yaml").write_text(text)
    run = truearm("show", tmp_path / "r.yaml")
    assert run.code == 2
    assert "a text cannot be written" in run.err


def test_a_fault_of_the_program_is_not_hidden(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ValueError("a fault")

    monkeypatch.setattr("truearm.jobs.load_robot.load_robot", fails)
    with pytest.raises(ValueError, match="a fault"):
        truearm("show", "irb120")
