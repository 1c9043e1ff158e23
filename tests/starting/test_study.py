"""The command ``truearm study``: what it lists, writes, prints and refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from tests.commanding import Truearm

import papers
from papers import STUDIES, irb120_simulation
from papers.study import Study
from truearm.engine.base.manifest import MANIFEST

WHOLE = irb120_simulation.study


@cache
def fewer(seeds: int) -> Study:
    return WHOLE(seeds, lambda _: None, unseen=20)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that is done in a second, and once."""
    monkeypatch.setattr(irb120_simulation, "study", lambda seeds, _: fewer(seeds))


def test_help_lists_every_study(truearm: Truearm) -> None:
    shown = truearm("study", "--help").out
    assert all(entry.name in shown for entry in STUDIES)


def test_it_writes_its_files_and_compares(truearm: Truearm, quick: None, tmp_path: Path) -> None:
    run = truearm("study", "irb120-simulation", "--seeds", "1", "--details", "--out", tmp_path / "new")
    assert run.code == 0
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["report.html", "study.json", MANIFEST]
    page = (tmp_path / "new" / "report.html").read_text()
    assert "<pre>truearm study irb120-simulation --seeds 1 --out DIR</pre>" in page
    assert "  not worse       after, drawn errors:" in run.out
    assert run.out.count("Verdicts: agrees ") == 1
    assert "published 0.004 mm" in run.out


def test_json_is_what_the_file_holds(truearm: Truearm, quick: None, tmp_path: Path) -> None:
    run = truearm("study", "irb120-simulation", "--seeds", "1", "--out", tmp_path, "--json")
    assert json.loads(run.out) == json.loads((tmp_path / "study.json").read_text())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("irb120-sim",), "NAME: there is no study of this name"),
        (("irb120-simulation",), "--data: this study needs measured data"),
        (("irb120-simulation", "--data", "nowhere"), "a file of the measured data is missing"),
        (("li-table", "--data", "nowhere"), "--data: this study simulates its data; got 'nowhere'. Leave --data"),
    ],
)
def test_refusals(
    truearm: Truearm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], message: str
) -> None:
    needy = [replace(e, files=("joints.txt",)) if e.name == "irb120-simulation" else e for e in STUDIES]
    monkeypatch.setattr(papers, "STUDIES", needy)
    run = truearm("study", *words, "--out", tmp_path)
    assert run.code == 2
    assert run.out == ""
    assert message in run.err
    assert not list(tmp_path.iterdir())


def test_no_seed_is_refused(truearm: Truearm, tmp_path: Path) -> None:
    assert truearm("study", "li-table", "--seeds", "0", "--out", tmp_path).code == 2
