from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from truearm.commands import main
from truearm.starting.demo import Demonstration
from truearm.starting.jobs import demo


@dataclass(frozen=True)
class Run:
    code: int
    out: str
    err: str


Truearm = Callable[..., Run]


@pytest.fixture
def truearm(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Truearm:
    """The command, run in this process: ``truearm("show", "irb120")``."""

    def run(*words: object) -> Run:
        monkeypatch.setattr(sys, "argv", ["truearm", *map(str, words)])
        capsys.readouterr()
        code: object = 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code
        caught = capsys.readouterr()
        return Run(code if isinstance(code, int) else 0, caught.out, caught.err)

    return run


@pytest.fixture(scope="session")
def demonstrated(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    """The demo, in a folder that stays as it is."""
    return demo(tmp_path_factory.mktemp("demonstrated"))


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``data.csv``, a small simulated campaign of the IRB 120."""
    from tests.simulated import campaign

    from truearm.engine.data.readers.canonical import csv_text

    folder = tmp_path_factory.mktemp("small")
    _, data = campaign("irb120", 40, 0.05e-3, 1)
    (folder / "data.csv").write_text(csv_text(data))
    return folder
