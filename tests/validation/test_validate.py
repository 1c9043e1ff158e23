"""Validation says when its readings are those of the training, and when targets were renamed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.simulated import campaign, more_of
from typer.testing import CliRunner

from truearm.calibration.calibrate import calibrate
from truearm.commands import program
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.validation.jobs import validate
from truearm.validation.report import validation_html


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Dataset]:
    """A folder with a campaign, its calibration, and a new campaign of the same twin."""
    folder = tmp_path_factory.mktemp("validated")
    twin, data = campaign("irb120", 30, 0.05e-3, 1)
    (folder / "first.csv").write_text(csv_text(data))
    calibrate("irb120", folder / "first.csv", out=folder / "result", train=20, model="geometric")
    return folder, more_of(twin, 12, 0.05e-3, 2)


def test_training_readings_are_noticed(calibrated: tuple[Path, Dataset]) -> None:
    folder, _ = calibrated
    result = validate(folder / "result" / "calibrated.yaml", folder / "first.csv")
    (notice,) = result.warnings
    assert (notice.code, notice.level) == ("training-data", "warning")
    assert "20 of their 30 configurations are those it was trained on; the rest was held out" in notice.message
    assert result.lines()[-1].startswith("Warning (training-data): ")
    assert result.summary()["warnings"] == [notice.summary()]


def test_new_readings_are_left_alone(calibrated: tuple[Path, Dataset]) -> None:
    folder, new = calibrated
    (folder / "new.csv").write_text(csv_text(new))
    assert validate(folder / "result" / "calibrated.yaml", folder / "new.csv").warnings == ()
    result = validate(folder / "result" / "calibrated.yaml", new)
    assert result.warnings == ()
    assert result.summary()["least_error"]["position_mm"]["mean"] == pytest.approx(0.0798, rel=1e-3)
    said = "The declared noise alone makes a mean of 0.080 mm"
    assert said in "\n".join(result.lines())
    assert said in validation_html(result)
    assert validate(folder / "result" / "calibrated.yaml", replace(new, sigma=None)).summary()["least_error"] == {}


def test_renamed_targets_are_told(calibrated: tuple[Path, Dataset]) -> None:
    folder, new = calibrated
    renamed = replace(new, targets=("2", "3", "1"))
    (notice,) = validate(folder / "result" / "calibrated.yaml", renamed).warnings
    assert (notice.code, notice.level) == ("targets-renamed", "error")
    assert "2 is 1, 3 is 2, 1 is 3" in notice.message
    (folder / "renamed.csv").write_text(csv_text(renamed))
    outcome = CliRunner().invoke(
        program(), ["validate", str(folder / "result" / "calibrated.yaml"), str(folder / "renamed.csv"), "--json"]
    )
    assert outcome.exit_code == 3
    assert json.loads(outcome.stdout)["warnings"][0]["code"] == "targets-renamed"


def test_a_page_and_its_figures_are_written(calibrated: tuple[Path, Dataset], tmp_path: Path) -> None:
    folder, new = calibrated
    result = validate(folder / "result" / "calibrated.yaml", new, out=tmp_path / "out", notes={"serial": "4711"})
    content = json.loads((tmp_path / "out" / "result.json").read_text())
    assert content["truearm"] == "truearm-validation/1"
    assert {name: content[name] for name in result.summary()} == result.summary()
    assert sum(span["readings"] for span in content["distance_from_training"]["tip_mm"]) == 36
    page = (tmp_path / "out" / "report.html").read_text()
    for place in ("error-over-tip", "error-over-joints", "error-over-middle", "residuals"):
        assert f'id="{place}"' in page
    assert "orientation-parts" not in page
    assert "4711" in page
    assert "truearm.validate(" in content["command"]
    assert "From the nearest of 20 training configurations: tips " in "\n".join(result.lines())
    words = ["validate", folder / "result" / "calibrated.yaml", folder / "first.csv", "--out", tmp_path / "x"]
    outcome = CliRunner().invoke(program(), list(map(str, words)))
    assert outcome.exit_code == 0
    assert outcome.stdout.splitlines()[-1] == f"Written to {tmp_path / 'x'}: result.json, report.html"


def test_the_folder_of_a_calibration_is_not_written_over(calibrated: tuple[Path, Dataset], tmp_path: Path) -> None:
    folder, new = calibrated
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(InputError, match="was not written here by truearm"):
        validate(folder / "result" / "calibrated.yaml", new, out=tmp_path)
    with pytest.raises(InputError, match="belong to another result"):
        validate(folder / "result" / "calibrated.yaml", new, out=folder / "result")
