"""How the command ends when its output goes nowhere, when it is interrupted, and when the machine says no."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.robot import library

LIBRARY = Path(library.__file__).parent
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


@pytest.mark.skipif(sys.platform == "win32", reason="streams are closed in another way")
@pytest.mark.parametrize(
    ("closed", "robot", "ended"),
    [
        (1, "irb120", (2, "", "truearm: standard output is closed. Send it to a file, or to /dev/null.\n")),
        (2, "irb121", (2, "", "")),
    ],
)
def test_streams_that_are_closed(closed: int, robot: str, ended: tuple[int, str, str]) -> None:
    done = subprocess.run(
        ["sh", "-c", f'exec "$@" {closed}>&-', "sh", *COMMAND, "show", robot], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == ended


#: Somebody presses Ctrl-C when a module is about to be loaded; what loads it may make any error of that.
INTERRUPTED = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background of a shell it is ignored
class Pressed:
    def find_spec(self, name, path=None, target=None):
        if name == {when!r}:
            sys.meta_path.remove(self)
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt:
                raise {error}
sys.meta_path.insert(0, Pressed())
sys.argv = "truearm show irb120".split()
from truearm.__main__ import main
main()
"""


@pytest.mark.parametrize(
    ("when", "error"),
    [("truearm.robot_files.jobs", "ValueError"), ("truearm.engine.robot.robot", "ImportError('half a module')")],
)
def test_an_interrupt_while_modules_load(when: str, error: str) -> None:
    script = INTERRUPTED.format(when=when, error=error)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_output_in_an_old_encoding_and_warnings_of_libraries(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(
        (LIBRARY / "irb120.yaml").read_text("utf-8").replace("title: ABB", "title: 日本"), "utf-8"
    )
    script = (
        "import sys, warnings\nfrom truearm.__main__ import main\n"
        f"sys.argv = ['truearm', 'show', {str(tmp_path / 'r.yaml')!r}]\n"
        "import truearm.robot_files.show as job\nright = job.robot_argument\n"
        "def warns(*given):\n    warnings.warn('overflow', RuntimeWarning)\n    return right(*given)\n"
        "job.robot_argument = warns\nmain()"
    )
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(r"\u65e5\u672c IRB 120")


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("caf\udce9.yaml", r"command line: this is not UTF-8 text; got 'caf\udce9.yaml'"),
        ("--o\x1b[31mut", r"command line: this holds a control character; got '--o\x1b[31mut'"),
        ("two\nlines.yaml", r"command line: this holds a control character; got 'two\nlines.yaml'"),
        ("a\u202eb.yaml", r"command line: this holds a control character; got 'a\u202eb.yaml'"),
    ],
)
def test_words_that_cannot_be_shown_or_written(truearm: Truearm, word: str, said: str) -> None:
    run = truearm("show", word)
    assert run.code == 2
    assert said in run.err
    assert run.err.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--poses", "3", "--seed", "x"], "--seed: a whole number belongs here; got 'x'; allowed: a whole number"),
        (["--poses", "3", "--seed", "-1"], "--seed: the number is out of range; got -1; allowed: 0 or more."),
        (["--poses", "3", "--seed", "9" * 5000], "--seed: the number is too large; got '999"),
        (["--poses", "3", "--noise", "nan"], "--noise: the number cannot be used; got 'nan'; allowed: 0 mm or more."),
        (["--poses", "3", "--noise", "inf"], "--noise: the number cannot be used; got 'inf'; allowed: 0 mm or more."),
    ],
)
def test_numbers_on_the_command_line(truearm: Truearm, tmp_path: Path, words: list[str], said: str) -> None:
    run = truearm("simulate", "irb120", "--truth", "random", *words, "--out", tmp_path / "data.csv")
    assert run.code == 2
    assert run.err.startswith(f"truearm: {said}")
    assert len(run.err) < 500


def test_what_a_file_says_does_not_steer_the_terminal(truearm: Truearm, tmp_path: Path) -> None:
    text = (LIBRARY / "irb120.yaml").read_text("utf-8")
    (tmp_path / "r.yaml").write_text(text.replace("title: ABB", r'title: "\e[2J\u202e ABB" #'), "utf-8")
    run = truearm("show", tmp_path / "r.yaml")
    assert run.code == 0
    assert run.out.startswith(r"\x1b[2J\u202e ABB (irb120)")
    assert all(line.isprintable() for line in run.out.splitlines())


def test_an_interrupted_run(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("truearm.robot_files.show.robot_argument", interrupted)
    run = truearm("show", "irb120")
    assert (run.code, run.out, run.err) == (130, "", "")


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (np.linalg.LinAlgError("SVD did not converge"), "the equations cannot be solved (SVD did not converge)"),
        (OSError(5, "Input/output error", "disk"), "truearm: disk: Input/output error."),
        (MemoryError(), "truearm: there is not enough memory for this."),
        (RecursionError(), "truearm: something in the input is nested too deep."),
    ],
)
def test_what_only_shows_while_running(
    truearm: Truearm, monkeypatch: pytest.MonkeyPatch, error: Exception, message: str
) -> None:
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr("truearm.robot_files.show.robot_argument", fails)
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
    assert "r.yaml, title: the text holds half a character; got 'half a character \\ud800'" in run.err


def test_a_fault_of_the_program_is_not_hidden(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ValueError("a fault")

    monkeypatch.setattr("truearm.robot_files.show.robot_argument", fails)
    with pytest.raises(ValueError, match="a fault"):
        truearm("show", "irb120")
