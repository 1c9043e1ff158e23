"""A few seconds of the fuzzer, and that it sees what it looks for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.fuzz import cases, regressions, samples, verdicts
from tests.fuzz.mutations import damaged
from tests.fuzz.readers import READERS

from truearm.engine.base.errors import InputError

ROOT = Path(__file__).parents[2]
unix = pytest.mark.skipif(sys.platform == "win32", reason="processes are not forked there")


def ran(words: list[str]) -> subprocess.CompletedProcess[str]:
    """Run Python at the root of the repository, in a process that threads of this one do not disturb."""
    paths = {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
    return subprocess.run(
        [sys.executable, *words], cwd=ROOT, env={**os.environ, **paths}, capture_output=True, text=True
    )


@unix
def test_damaged_inputs_are_refused_or_read() -> None:
    done = ran(["-m", "tests.fuzz", "--most", "4"])
    assert (done.returncode, done.stderr) == (0, ""), done.stdout


def test_a_case_is_the_same_each_time(tmp_path: Path) -> None:
    texts = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        cases.findings("read-canonical", 7, folder)
        texts.append((folder / "data.csv").read_bytes())
    assert texts[0] == texts[1]


def test_every_sample_is_read_undamaged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "damaged", lambda rng, name, content: content)
    monkeypatch.setattr(verdicts, "of_refusal", lambda error: [str(error)])
    for name in READERS:
        assert cases.findings(f"read-{name}", 0) == []


def test_a_damaged_file_is_another_file() -> None:
    rng = np.random.default_rng(0)
    text = b"a,b\n1,2\n3,4\n"
    assert len({damaged(rng, "data.csv", text) for _ in range(40)}) > 20


#: Commands that break, and how each ends.
BREAKING = """
import sys
from pathlib import Path
from tests.fuzz import commands

for body in ("raise ValueError('x')", "bytearray(2_000_000_000)", "import os, signal; os.kill(os.getpid(), 9)", "1"):
    commands.main = lambda: exec(body)
    ended = commands.run(["check"], Path(sys.argv[1]))
    print(ended.code, ended.err.strip().rpartition("\\n")[2])
"""


@unix
def test_a_command_that_breaks_is_seen(tmp_path: Path) -> None:
    done = ran(["-c", BREAKING, str(tmp_path)])
    assert done.stdout.splitlines() == ["98 ValueError: x", "98 MemoryError", "-9 ", "0 "], done.stderr


def test_verdicts() -> None:
    assert verdicts.of_printed("mean 0.1 mm", "") == []
    assert "no figure" not in str(verdicts.of_printed("target nan", "nan"))
    assert len(verdicts.of_printed("mean nan mm", "data")) == 1
    assert len(verdicts.of_printed("mean \x1b[31m", "")) == 1
    assert len(verdicts.of_refusal(InputError("Input should be a valid integer"))) == 1
    assert verdicts.of_json('{"a": NaN}')
    assert verdicts.not_finite({"a": [1.0, {"b": float("inf")}]})
    assert verdicts.of_files({"a": "1"}, {"a": "1"}, done=False) == []
    assert len(verdicts.of_files({"a": "1", "b": ""}, {"a": "2", "c": "", ".truearm.0": ""}, done=False)) == 4


@pytest.mark.parametrize(("reader", "what"), regressions.CONTENTS)
def test_what_once_went_wrong(reader: str, what: str, tmp_path: Path) -> None:
    files = iter(READERS[reader].files.items())
    first, _ = next(files)
    (tmp_path / first).write_bytes(regressions.CONTENTS[reader, what]())
    for name, sample in files:
        (tmp_path / name).write_bytes(samples.content(sample))
    found = []
    try:
        READERS[reader].read(tmp_path)
    except InputError as error:
        found = verdicts.of_refusal(error)
    assert found == []
