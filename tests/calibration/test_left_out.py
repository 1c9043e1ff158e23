"""Configurations are left out by their labels, and the result says which."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.simulated import campaign
from typer.testing import CliRunner

from truearm.calibration.calibrate import calibrate
from truearm.commands import program
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text
from truearm.validation.jobs import validate

DATA = campaign("irb120", 24, 0.05e-3, 4)[1]


@pytest.fixture
def csv(tmp_path: Path) -> Path:
    path = tmp_path / "data.csv"
    path.write_text(csv_text(DATA))
    return path


def test_what_is_left_out_changes_nothing(csv: Path, tmp_path: Path) -> None:
    out = calibrate("irb120", csv, model="offsets", without=["3", "7"])
    kept = [i for i, label in enumerate(DATA.labels) if label not in ("3", "7")]
    alone = calibrate("irb120", DATA.of_configurations(kept), model="offsets")
    for name, value in alone.fit.robot.values.items():
        assert out.fit.robot.values[name] == pytest.approx(value, abs=1e-7)
    assert out.summary()["without"] == ["3", "7"]
    assert "Left out: 2 configurations (3, 7)" in out.lines()
    assert "without=['3', '7']" in out.command
    assert " without 2 configurations (3, 7; " in out.history
    assert "without" not in alone.summary()
    out.save(tmp_path / "result")
    assert json.loads((tmp_path / "result" / "result.json").read_text())["without"] == ["3", "7"]
    assert "Left out" in (tmp_path / "result" / "report.html").read_text()
    (notice,) = [n for n in validate(out.robot, csv).warnings if n.code == "training-data"]
    assert "15 of their 24 configurations" in notice.message
    assert "2 were left out" in notice.message


def test_another_choice_of_what_is_left_out_is_another_split(csv: Path) -> None:
    first = calibrate("irb120", csv, model="offsets", without=["3"])
    again = calibrate(first.robot, csv, model="offsets", without=["3"])
    other = calibrate(first.robot, csv, model="offsets", without=["4"])
    assert "training-data" not in [n.code for n in again.warnings]
    assert "training-data" in [n.code for n in other.warnings]


def test_an_unknown_configuration_is_refused_with_near_names(csv: Path) -> None:
    with pytest.raises(InputError, match="there is no configuration of this name") as told:
        calibrate("irb120", csv, without=["241"])
    assert told.value.parameter == "without"
    assert "Did you mean 24" in str(told.value)


def test_something_must_be_left(csv: Path) -> None:
    with pytest.raises(InputError, match="no configuration would be left"):
        calibrate("irb120", csv, without=DATA.labels)


def test_the_command_takes_lists_and_repeats(csv: Path, tmp_path: Path) -> None:
    words = ["calibrate", "irb120", str(csv), "--model", "offsets", "--without", "3, 7", "--without", "9", "--json"]
    done = CliRunner().invoke(program(), [*words, "--out", str(tmp_path / "r")])
    assert json.loads(done.stdout)["without"] == ["3", "7", "9"]
    refused = CliRunner().invoke(program(), [*words, "--without", "nine", "--out", str(tmp_path / "r")])
    assert "there is no configuration of this name" in str(refused.exception)
    assert "'nine'" in str(refused.exception)


def test_notes_are_in_the_result_and_on_the_report(csv: Path, tmp_path: Path) -> None:
    words = [
        "calibrate",
        "irb120",
        str(csv),
        "--model",
        "offsets",
        "--note",
        "serial=120-<7>",
        "--note",
        "operator=A B",
    ]
    done = CliRunner().invoke(program(), [*words, "--out", str(tmp_path / "r")])
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "r" / "result.json").read_text())["notes"] == {
        "serial": "120-<7>",
        "operator": "A B",
    }
    page = (tmp_path / "r" / "report.html").read_text()
    assert "120-&lt;7&gt;" in page
    assert "A B" in page


@pytest.mark.parametrize(
    ("notes", "what"),
    [
        ({"serial": ""}, "a name and a text of one line"),
        ({"serial": "1\n2"}, "a name and a text of one line"),
        ({"serial": "1" * 201}, "a name and a text of one line"),
        ({"serial": 7}, "a text belongs here"),
        (["serial=1"], "notes by name belong here"),
        ({str(i): "1" for i in range(21)}, "too many notes"),
    ],
)
def test_notes_that_cannot_be_shown_are_refused(notes: object, what: str) -> None:
    with pytest.raises(InputError, match=what) as told:
        calibrate("irb120", DATA, notes=notes)  # type: ignore[arg-type]
    assert told.value.parameter == "notes"


@pytest.mark.parametrize("texts", [["serial"], ["serial=1", "serial=2"]])
def test_notes_of_the_command_are_names_and_texts(csv: Path, tmp_path: Path, texts: list[str]) -> None:
    words = [word for text in texts for word in ("--note", text)]
    done = CliRunner().invoke(program(), ["calibrate", "irb120", str(csv), *words, "--out", str(tmp_path / "r")])
    assert str(done.exception).startswith("--note: a note ")
    assert not (tmp_path / "r").exists()
