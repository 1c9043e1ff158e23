"""How the command ends when its output goes nowhere, when it is interrupted, and when the machine says no."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Run, Truearm

from truearm.engine.robot import library

LIBRARY = Path(library.__file__).parent
COMMAND = [sys.executable, "-m", "truearm"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_finds_no_room() -> None:
    for words in (["robots"], ["show", "irb120", "--json"], ["--help"], ["--version"]):
        with Path("/dev/full").open("w") as full:
            done = subprocess.run([*COMMAND, *words], stdout=full, stderr=subprocess.PIPE, text=True)
        assert (done.returncode, done.stderr) == (2, "truearm: output: No space left on device.\n"), words


@pytest.mark.skipif(sys.platform == "win32", reason="pipes end, and streams are closed, in another way")
def test_output_that_nobody_reads() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*COMMAND, "show", "irb120", "--json"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")
    told = "truearm: standard output is closed. Send it to a file, or to /dev/null.\n"
    for closed, robot, said in ((1, "irb120", told), (2, "irb121", "")):
        shell = ["sh", "-c", f'exec "$@" {closed}>&-', "sh", *COMMAND, "show", robot]
        done = subprocess.run(shell, capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", said)


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


def test_an_interrupt_while_modules_load() -> None:
    for when, error in (
        ("truearm.robot_files.jobs", "ValueError"),
        ("truearm.engine.robot.robot", "ImportError('half a module')"),
    ):
        script = INTERRUPTED.format(when=when, error=error)
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (130, "", ""), when


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


def test_words_that_cannot_be_shown_or_written(truearm: Truearm) -> None:
    told = "command line: this holds a control character; got "
    for word, said in (
        ("caf\udce9.yaml", r"command line: this is not UTF-8 text; got 'caf\udce9.yaml'"),
        ("--o\x1b[31mut", rf"{told}'--o\x1b[31mut'"),
        ("two\nlines.yaml", rf"{told}'two\nlines.yaml'"),
        ("a\u202eb.yaml", rf"{told}'a\u202eb.yaml'"),
    ):
        run = truearm("show", word)
        assert (run.code, said in run.err, run.err.rstrip("\n").isprintable()) == (2, True, True), run.err


def test_numbers_on_the_command_line(truearm: Truearm, tmp_path: Path) -> None:
    words = ("simulate", "irb120", "--truth", "random", "--poses", 3, "--out", tmp_path / "data.csv")
    for option, text, said in (
        ("seed", "x", "a whole number belongs here; got 'x'; allowed: a whole number"),
        ("seed", "-1", "the number is out of range; got -1; allowed: 0 or more."),
        ("seed", "9" * 5000, "the number is too large; got '999"),
        ("noise", "nan", "the number cannot be used; got 'nan'; allowed: 0 mm or more."),
        ("noise", "inf", "the number cannot be used; got 'inf'; allowed: 0 mm or more."),
        ("noise", "1e-9", ""),
        ("noise", "1e9", ""),
    ):
        run = truearm(*words, f"--{option}={text}")
        assert (run.code, run.err.startswith(f"truearm: --{option}: {said}")) == (2, True), run.err
        assert len(run.err) < 500
    assert not (tmp_path / "data.csv").exists()


def test_what_a_file_says_does_not_steer_the_terminal(truearm: Truearm, tmp_path: Path) -> None:
    text = (LIBRARY / "irb120.yaml").read_text("utf-8")
    (tmp_path / "r.yaml").write_text(text.replace("title: ABB", r'title: "\e[2J\u202e ABB" #'), "utf-8")
    run = truearm("show", tmp_path / "r.yaml")
    assert run.code == 0
    assert run.out.startswith(r"\x1b[2J\u202e ABB (irb120)")
    assert all(line.isprintable() for line in run.out.splitlines())
    (tmp_path / "r.yaml").write_text(text.replace("title: ABB", r'title: "half a character \ud800" #'), "utf-8")
    run = truearm("show", tmp_path / "r.yaml")
    assert run.code == 2
    assert "r.yaml, title: the text holds half a character; got 'half a character \\ud800'" in run.err


def test_what_only_shows_while_running(truearm: Truearm, monkeypatch: pytest.MonkeyPatch) -> None:
    raised: list[BaseException] = []

    def fails(*_: object) -> None:
        raise raised.pop()

    def run(error: BaseException) -> Run:
        raised.append(error)
        return truearm("show", "irb120")

    monkeypatch.setattr("truearm.robot_files.show.robot_argument", fails)
    for error, message in (
        (np.linalg.LinAlgError("SVD did not converge"), "the equations cannot be solved (SVD did not converge)"),
        (OSError(5, "Input/output error", "disk"), "truearm: disk: Input/output error."),
        (MemoryError(), "truearm: there is not enough memory for this."),
        (RecursionError(), "truearm: something in the input is nested too deep."),
    ):
        done = run(error)
        assert (done.code, message in done.err, len(done.err.splitlines())) == (2, True, 1), done.err
    assert run(KeyboardInterrupt()) == Run(130, "", "")
    with pytest.raises(ValueError, match="a fault"):  # a fault of the program is not hidden
        run(ValueError("a fault"))
