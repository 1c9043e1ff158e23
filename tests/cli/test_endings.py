"""How the command ends when its output goes nowhere, when it is interrupted, and when the machine says no."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

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
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.skipif(sys.platform == "win32", reason="signals are others")
def test_an_interrupted_run(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "data.csv")  # nobody writes into it: the command waits until it is interrupted
    script = (
        "import signal, sys, threading; from truearm.cli import main\n"
        "threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()\n"
        f"sys.argv = ['truearm', 'check', {str(tmp_path / 'data.csv')!r}]; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize(
    ("error", "message"),
    [
        ("numpy.linalg.LinAlgError('SVD did not converge')", "the equations cannot be solved (SVD did not converge)"),
        ("OSError(5, 'Input/output error', 'disk')", "truearm: disk: Input/output error."),
        ("OSError('odd')", "truearm: output: odd."),
    ],
)
def test_what_only_shows_while_running(
    truearm: Truearm, monkeypatch: pytest.MonkeyPatch, error: str, message: str
) -> None:
    import numpy

    def fails(*_: object) -> None:
        raise eval(error, {"numpy": numpy})

    monkeypatch.setattr("truearm.robots.load_robot", fails)
    run = truearm("show", "irb120")
    assert run.code == 2
    assert message in run.err
    assert len(run.err.splitlines()) == 1


def test_text_that_the_output_cannot_hold() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    script = (
        "import truearm.cli, truearm.robots; from dataclasses import replace; import sys\n"
        "robot = truearm.robots.load_robot('irb120')\n"
        "truearm.robots.load_robot = lambda _: replace(robot, title='Träger')\n"
        "sys.argv = ['truearm', 'show', 'x']; truearm.cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert done.returncode == 2
    assert "a text cannot be written" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_fault_of_the_program_is_not_hidden(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ValueError("a fault")

    monkeypatch.setattr("truearm.robots.load_robot", fails)
    with pytest.raises(ValueError, match="a fault"):
        truearm("show", "irb120")
