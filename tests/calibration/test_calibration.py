"""A calibration speaks for itself: residuals, pictures, its short text, its parameters, and what was left out of it."""

from __future__ import annotations

import json
import math
import re
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import known, refused
from tests.simulated import campaign

import truearm as package
from truearm.calibration.result import Calibration
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Status


@cache
def run(train: int | None = None) -> Calibration:
    _, data = campaign("irb120", 40, 0.05e-3, 1)
    return package.calibrate("irb120", data, train="all" if train is None else train, model="geometric")


def test_residuals_are_the_errors_reading_by_reading() -> None:
    result = run(28).residuals()
    data = run(28).data
    assert len(result) == len(data.target)
    assert np.unique(result.part, return_counts=True)[1].tolist() == [12 * 3, 28 * 3]
    errors = errors_of(run(28).fit.robot, data).position_errors
    places = zip(data.configuration, data.target, errors, strict=True)
    expected = {(data.labels[c], data.targets[t]): error for c, t, error in places}
    for row in result:
        np.testing.assert_allclose(row.error, expected[row.configuration, row.target], rtol=0, atol=1e-15)
        assert row.norm == pytest.approx(float(np.linalg.norm(row.error)))
    held_out = {data.labels[i] for i in run(28).held_out}
    assert {row.configuration for row in result if row.part == "held out"} == held_out


def test_without_a_held_out_part_all_residuals_are_of_training() -> None:
    assert set(run().residuals().part.tolist()) == {"training"}
    assert "Next (hold-out): Hold configurations out to judge the fit" in "\n".join(run().lines())
    assert run().summary()["validation"] is None


def test_residuals_as_a_data_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    pandas = ModuleType("pandas")
    pandas.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    result = run(28).residuals()
    frame: dict[str, Any] = result.to_pandas()
    assert list(frame) == ["configuration", "target", "part", "kind", "ex", "ey", "ez", "norm"]
    np.testing.assert_array_equal(frame["ez"], result.error[:, 2])


def test_the_text_is_what_the_command_prints_and_is_short() -> None:
    text = repr(run(28))
    mark = "SIMULATED: measurements of a virtual instrument, not of a robot.\n"
    assert text.startswith(f"{mark}On 12 configurations the fit has not seen:\n  nominal     mean ")
    assert "Status: converged." in text
    assert run(28)._repr_html_() == f"<pre>{text}</pre>".replace("'", "&#x27;")
    assert max(len(text), len(repr(run(28).residuals()))) <= 2000


def test_what_exact_parameters_would_leave_stands_beside_the_held_out_error() -> None:
    result = run(28)
    assert list(result.summary()["least_error"]) == ["position_mm"]
    shown, noise = result.summary()["least_error"]["position_mm"], pytest.approx(math.sqrt(8.0 / math.pi) * 0.05)
    assert shown == {"mean": noise, "evidence": "declared", "declared_noise": noise, "visits": 0, "postures": 0}
    assert result.result()["least_error"] == result.summary()["least_error"]
    (line,) = (line for line in result.lines() if line.endswith(" mm (declared noise: mean 0.080)"))
    assert line.startswith("  calibrated  mean 0.0")
    assert "least_error" not in run().summary()
    left = replace(result, fit=replace(result.fit, excess=2.0))
    assert left.least["position"].evidence == "residuals"
    unsound = replace(result, fit=replace(left.fit, status=Status.NOT_CONVERGED))
    assert unsound.least == result.least


def test_the_report_of_the_fit_has_a_line_for_every_parameter() -> None:
    result = run(28)
    a_3 = result.parameters["a_3"]
    assert 0.0 < known(a_3.deviation) < 1e-4
    assert abs(a_3.value - 0.27) < 5e-4
    text = str(result)
    assert text.startswith("\n".join(result.lines()))
    rows = text.splitlines()[len(result.lines()) + 1 :]
    assert [row.split()[0] for row in rows] == ["parameter", *result.parameters]
    assert re.search(r"^a_3 +270\.000 +2[67]\d\.\d+ +[+-]?\d\.\d+  mm$", text, re.M)
    assert re.search(r"^a_1 .*not told by the data$", text, re.M)


def test_pictures() -> None:
    assert type(run(28).plot()).__name__ == "Figure"
    assert len(run(28).plot("position-histogram").data) == 2
    refused("picture", "the calibration has no such picture.*Did you mean residuals", run(28).plot, "residual")
    shown = run(28).plot("expected-error")
    assert [trace.type for trace in shown.data] == ["heatmap", "scatter"] * 2
    assert len(shown.data[1].x) == 28 * 3
    errors = [value for row in shown.data[0].z for value in row if value is not None]
    assert 0.2 * run(28).expected.overall.mean * 1e3 < min(errors)
    assert max(errors) < 10 * run(28).expected.overall.p95 * 1e3


def test_the_error_to_expect_stands_beside_the_held_out_one() -> None:
    overall, shown = run(28).expected.overall, run(28).summary()["expected_mm"]
    assert list(shown) == ["mean", "p95", "interval_90", "lower_bound", "omissions", "targets", "frame", "payload"]
    assert shown["mean"] == pytest.approx(1e3 * overall.mean)
    assert shown["interval_90"] == pytest.approx([1e3 * end for end in overall.interval_90])
    assert shown["interval_90"][0] < shown["mean"] < shown["interval_90"][1] < shown["p95"] * 2
    assert (shown["lower_bound"], shown["omissions"]) == (False, [])
    assert list(shown["targets"]) == ["1", "2", "3"]
    assert list(shown["targets"]["2"]) == ["mean", "p95", "interval_90"]
    assert (shown["frame"], shown["payload"]) == ("the instrument's frame", "no payload")
    begin = "Expected over the workspace, without the instrument's noise: mean 0.0"
    (line,) = (line for line in run(28).lines() if line.startswith(begin))
    assert line.endswith(" mm; targets 1, 2, 3 in the instrument's frame, no payload")
    assert repr(run()).count("Expected over the workspace") == 1
    bound = replace(run(28), expected=replace(run(28).expected, omissions=("values at a bound count as exact",)))
    assert "  may be larger: values at a bound count as exact" in bound.lines()
    (line,) = (line for line in bound.lines() if line.startswith(begin[:-3]))
    for words, is_shown in ((" mm (90 %: ", True), (" or more), 95 % ", True), ("95 % below", False)):
        assert (words in line) is is_shown, words
    assert bound.summary()["expected_mm"]["interval_90"][1] is None
    assert bound.summary()["expected_mm"]["lower_bound"] is True


def test_a_split_made_apart_finds_the_same() -> None:
    data = campaign("irb120", 40, 0.05e-3, 1)[1]
    training, judging = data.split(0.7, seed=0)
    apart = package.calibrate("irb120", training, train="all", model="geometric")
    assert apart.parameters["a_3"].value == run(28).parameters["a_3"].value
    held_out = known(package.validate(apart.robot, judging).errors.position)
    assert held_out.mean == pytest.approx(known(known(run(28).validation).position).mean, rel=1e-12)
    assert data.split(5, seed=1)[0].configurations == 5
    for train in (0, 1.5, -0.3, 40, float("nan"), "all"):
        refused("train", "", data.split, train)
    for seed in (-1, 1.5, "x", None):
        refused("seed", "", data.split, 0.7, seed=seed)


# -- what is left out, and notes -----------------------------------------------------------------------------------

DATA = campaign("irb120", 24, 0.05e-3, 4)[1]


@pytest.fixture
def csv(tmp_path: Path) -> Path:
    path = tmp_path / "data.csv"
    path.write_text(csv_text(DATA))
    return path


def test_what_is_left_out_changes_nothing(csv: Path, tmp_path: Path) -> None:
    out = package.calibrate("irb120", csv, model="offsets", without=["3", "7"])
    rows = [i for i, label in enumerate(DATA.labels) if label not in ("3", "7")]
    alone = package.calibrate("irb120", DATA.of_configurations(rows), model="offsets")
    for name, value in alone.fit.robot.values.items():
        assert out.fit.robot.values[name] == pytest.approx(value, abs=1e-7)
    assert out.summary()["without"] == ["3", "7"]
    assert "Left out: 2 configurations (3, 7)" in out.lines()
    assert "without=['3', '7']" in out.command
    assert " without 2 configurations (3, 7; " in out.history
    assert "without" not in alone.summary()
    out.save(tmp_path / "result")
    assert "Left out" in (tmp_path / "result" / "report.html").read_text()
    (notice,) = [n for n in package.validate(out.robot, csv).warnings if n.code == "training-data"]
    assert "15 of their 24 configurations" in notice.message
    assert "2 were left out" in notice.message
    for left_out, seen in (("3", False), ("4", True)):  # another choice is another split
        again = package.calibrate(out.robot, csv, model="offsets", without=[left_out, "7"])
        assert ("training-data" in [n.code for n in again.warnings]) is seen


def test_the_command_takes_lists_repeats_and_notes(truearm: Truearm, csv: Path, tmp_path: Path) -> None:
    words = ["calibrate", "irb120", csv, "--model", "offsets", "--out", tmp_path / "r", "--json"]
    outcome = truearm(
        *words, "--without", "3, 7", "--without", "9", "--note", "serial=120-<7>", "--note", "operator=A B"
    )
    assert json.loads(outcome.out)["without"] == ["3", "7", "9"]
    assert json.loads((tmp_path / "r" / "result.json").read_text())["notes"] == {"serial": "120-<7>", "operator": "A B"}
    page = (tmp_path / "r" / "report.html").read_text()
    assert "120-&lt;7&gt;" in page
    assert "A B" in page
    for texts in (["serial"], ["serial=1", "serial=2"]):
        noted = truearm(*words, *(word for text in texts for word in ("--note", text)))
        assert (noted.code, "--note: a note " in noted.err) == (2, True), noted.err


def test_what_cannot_be_left_out_or_noted_is_refused() -> None:
    def calibrate(**given: Any) -> object:
        return package.calibrate("irb120", DATA, **given)

    words = "there is no configuration of this name.*Did you mean 24"
    refused("without", words, calibrate, without=["241"])
    refused(None, "no configuration would be left", calibrate, without=DATA.labels)
    for notes, fault in (
        ({"serial": ""}, "a name and a text of one line"),
        ({"serial": "1\n2"}, "a name and a text of one line"),
        ({"serial": "1" * 201}, "a name and a text of one line"),
        ({"serial": 7}, "a text belongs here"),
        (["serial=1"], "notes by name belong here"),
        ({str(i): "1" for i in range(21)}, "too many notes"),
    ):
        refused("notes", fault, calibrate, notes=notes)
