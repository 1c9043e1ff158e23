"""``truearm studio``: what it refuses, what it says, and that nothing else knows of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm

from truearm.studio.access import listening_socket
from truearm.studio.project import PROJECT_FILE
from truearm.studio.serving import serve


def test_a_port_in_use_is_refused_with_a_free_one_and_no_project_made(truearm: Truearm, tmp_path: Path) -> None:
    with listening_socket("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        run = truearm("studio", tmp_path / "new", "--port", port, "--no-open")
    assert run.code == 2
    assert f"--port: another program listens on this port; got {port}. Give --port " in run.err
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--port", "70000"), "--port: this is no port; got 70000; allowed: 1 to 65535, 0 for any that is free."),
        (("--port", "-1"), "--port: this is no port"),
        (("--port", "x"), "--port"),
        (("--host", "no.such.host.invalid"), "--host: this is no address of this machine"),
        (("--host", ""), "--host: this is no address of this machine"),
        (("--token", "short"), "--token: this is no token that keeps others out; allowed: 16 to 200"),
        (("--token", "a b c d e f g h i j k"), "--token: this is no token"),
        (("--token", "ä" * 20), "--token: this is no token"),
    ],
)
def test_what_cannot_be_served_is_refused(truearm: Truearm, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    run = truearm("studio", tmp_path / "new", "--no-open", *words)
    assert run.code == 2
    assert said in run.err
    assert not (tmp_path / "new").exists()


def test_a_folder_of_other_things_is_refused(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("x")
    for words in ((), ("--demo",)):
        run = truearm("studio", tmp_path, "--port", 0, "--no-open", *words)
        assert run.code == 2
        assert (
            f"{tmp_path}: this folder holds other things and is no project of the studio; got 'thesis.txt'" in run.err
        )
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_demonstration_replaces_no_measurements(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / PROJECT_FILE).write_text("truearm: truearm-studio/1\n")
    (tmp_path / "measurements.csv").write_text("mine")
    run = truearm("studio", tmp_path, "--port", 0, "--no-open", "--demo")
    assert run.code == 2
    assert "this is another file of that name, and it is not overwritten" in run.err
    assert (tmp_path / "measurements.csv").read_text() == "mine"


def test_a_demonstration_that_was_changed_is_opened_as_it_is(tmp_path: Path) -> None:
    (tmp_path / PROJECT_FILE).write_text("truearm: truearm-studio/1\n")
    (tmp_path / "measurements.csv").write_text("mine")
    (tmp_path / "cell.yaml").write_text("mine")
    serve(tmp_path, port=0, demo=True).stop()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cell.yaml", "measurements.csv", PROJECT_FILE]


def test_without_the_extra_it_says_what_to_install(
    truearm: Truearm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["truearm.studio.command"], "find_spec", lambda _: None)
    run = truearm("studio", tmp_path / "new", "--no-open")
    assert run.code == 2
    assert "the studio needs the extra truearm[studio]. Install it: pip install 'truearm[studio]'." in run.err
    assert not (tmp_path / "new").exists()


def test_it_says_where_it_is_and_what_is_exposed_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    words = ["studio", str(tmp_path / "new"), "--port", "0", "--host", "0.0.0.0", "--no-open"]
    begun = subprocess.Popen(
        [sys.executable, "-u", "-m", "truearm", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )
    assert begun.stdout is not None
    line = begun.stdout.readline()
    begun.send_signal(signal.SIGINT)
    _, said = begun.communicate(timeout=20)
    assert line.startswith(f"The studio of {tmp_path / 'new'} is at http://127.0.0.1:")
    assert "/?token=" in line
    assert "Whoever reaches this machine and has the token can read and change the project" in said
    assert "SSH tunnel is the better way" in said
    assert "Traceback" not in said
    assert line.split("?token=")[1].split()[0] not in said
    assert begun.returncode == 130
    assert (tmp_path / "new" / PROJECT_FILE).exists()


@pytest.mark.parametrize("words", [["--help"], ["studio", "--help"], ["robots"], ["show", "irb120"]])
def test_nothing_of_the_studio_is_imported_without_it(words: list[str]) -> None:
    script = (
        f"import sys\nfrom truearm.commands import main\nsys.argv = ['truearm', *{words}]\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "here = {'truearm.studio', 'truearm.studio.command'}\n"
        "print([m for m in {*sys.modules} - here if m.startswith(('viser', 'websockets', 'truearm.studio'))])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
