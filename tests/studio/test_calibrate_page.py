"""The page Calibrate: a click does not cost a sound result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, below

from truearm.engine.data.readers.canonical import csv_text
from truearm.studio.pages.calibrate import CalibratePage
from truearm.studio.window import Window

SETTINGS = "truearm: truearm-studio/1\nrobot: irb120\ndata: {}.csv\nmodel: geometric\n"


@pytest.fixture
def window(serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Window:
    """A project with good measurements and with six readings of the same robot."""
    folder = tmp_path / "project"
    folder.mkdir()
    good = campaign("irb120", 40, 2e-5, 3)[1]
    (folder / "good.csv").write_text(csv_text(good))
    (folder / "six.csv").write_text(csv_text(good.of_configurations(np.arange(6))))
    (folder / "truearm-studio.yaml").write_text(SETTINGS.format("good"))
    window = serving(folder).window
    at_once(window, monkeypatch)
    return window


def test_six_readings_do_not_replace_a_sound_result_by_one_click(window: Window) -> None:
    page = next(one for one in window.pages if isinstance(one, CalibratePage))
    result = window.project.folder / "result" / "calibrated.yaml"
    act(page._run)
    assert "Written to result" in page._said.content
    assert below(window, page._run) == ""
    sound = result.read_bytes()
    act(page._data, "six.csv")
    act(page._run)
    assert "a sound result is in this folder, and the new one is not sound" in below(window, page._run)
    assert "Replace a sound result" in below(window, page._run)
    assert result.read_bytes() == sound
    window.refresh()
    assert "Status: rank-loss" in page._said.content
    assert "Not written." in page._said.content
    act(page._replace, True)
    act(page._run)
    assert "Written to result" in page._said.content
    assert result.read_bytes() != sound
    assert page._replace.value is False  # asked for once, not for ever
    act(page._run)  # of a result that is not sound nothing is lost
    assert "Written to result" in page._said.content


def test_the_report_names_the_command_without_replacing(window: Window) -> None:
    page = next(one for one in window.pages if isinstance(one, CalibratePage))
    act(page._data, "six.csv")
    act(page._replace, True)
    act(page._run)
    report = (window.project.folder / "result" / "result.json").read_text()
    assert "truearm calibrate irb120 six.csv --model geometric --out DIR" in report
