"""Pictures of joint curves: their band, where was measured, and their place in the report and in result.json."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest

from truearm.calibration.figures import curve_figure, curves_table
from truearm.calibration.report import Report, report_html
from truearm.calibration.result import Calibration
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.curves import FoundCurve
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.document.drawing import DARK
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure


def curve(places: Array, deviation: float = 1.0) -> FoundCurve:
    """Return a curve of 10 mdeg, 7 periods in a turn, of a joint from -120 to 150 deg; deviation of terms in mdeg."""
    amounts = np.zeros(120)
    amounts[12] = math.radians(0.010)
    shown = math.radians(-120), math.radians(150)
    return FoundCurve(3, "J3", amounts, np.eye(120) * math.radians(deviation * 1e-3) ** 2, shown, np.radians(places))


@cache
def calibrated() -> Calibration:
    nominal, rng = load_robot("li3"), np.random.default_rng(2)
    twin = truth_twin(nominal, "gear-errors", np.random.default_rng(1))
    data = measure(twin, nominal.random_configurations(80, rng), 1e-5, rng)
    training, held_out = np.arange(60), np.arange(60, 80)
    first, judged = data.of_configurations(training), data.of_configurations(held_out)
    fit = identify(nominal, first, named_model("geometric").also(["joint-curve"]))
    return Calibration(
        fit=fit,
        data=data,
        training=training,
        held_out=held_out,
        nominal=errors_of(place(nominal, first), judged),
        train=errors_of(fit.robot, first),
        validation=errors_of(fit.robot, judged),
        expected=expected_error(fit),
        warnings=(),
        command="truearm calibrate",
        history="calibrated by truearm",
    )


def test_a_picture_has_the_curve_its_band_and_where_was_measured() -> None:
    drawn = curve_figure(curve(np.linspace(-60, 150, 60)))
    low, high, line, marks = drawn["data"]
    x = np.radians(line["x"])
    assert np.array(line["y"]) == pytest.approx(10 * np.sin(7 * x), abs=0.02)
    half = 1.959964 * math.sqrt(60)
    assert np.array(high["y"]) - np.array(line["y"]) == pytest.approx(half, abs=2e-3)
    assert np.array(line["y"]) - np.array(low["y"]) == pytest.approx(half, abs=2e-3)
    assert high["fill"] == "tonexty"
    assert len(marks["x"]) == 60
    assert drawn["layout"]["xaxis"]["range"] == [-120, 150]
    (grey,) = drawn["layout"]["shapes"]
    assert (grey["x0"], grey["x1"]) == (-120, -60)
    bottom, top = drawn["layout"]["yaxis"]["range"]
    assert bottom < min(low["y"])
    assert top > max(high["y"])
    assert {grey["fillcolor"], high["fillcolor"], line["line"]["color"], marks["marker"]["color"]} <= set(DARK)


def test_a_wide_band_outside_the_measured_range_does_not_flatten_the_curve() -> None:
    found = curve(np.linspace(-60, 150, 60))
    amounts = np.zeros((120, 120))
    amounts[0, 0] = math.radians(1.0) ** 2  # the sine of one period: a degree, which no picture of 10 mdeg can hold
    wide = FoundCurve(found.number, found.name, found.amounts, amounts, found.shown, np.radians([-5.0, 0.0, 5.0]))
    bottom, top = curve_figure(wide)["layout"]["yaxis"]["range"]
    assert 100 < top - bottom < 2000  # the band has 170 mdeg to either side at 5 deg, 2000 at 90 deg


def test_nothing_measured_is_grey_all_over() -> None:
    drawn = curve_figure(curve(np.zeros(0)))
    (grey,) = drawn["layout"]["shapes"]
    assert (grey["x0"], grey["x1"]) == (-120, 150)
    ((_, _, band, _, measured),) = curves_table([curve(np.zeros(0))]).rows
    assert (measured, band) == ("nowhere", "–")


def test_rows_say_size_band_periods_and_range() -> None:
    (row,) = curves_table([curve(np.linspace(-60, 150, 60), deviation=0.1)]).rows
    assert tuple(row) == ("3, J3", "7.1", "1.5", "7 (10 mdeg)", "-60 to 150")


def test_the_report_shows_each_curve_and_not_its_hundreds_of_numbers() -> None:
    run = calibrated()
    names = [f"joint-curve-{one.number}" for one in run.curves]
    assert names
    drawn = Report(run).figures()
    assert [name for name in drawn if name.startswith("joint-curve")] == names
    page = report_html(run)
    for name in names:
        assert f'id="{name}"' in page
    assert page.count("<h2>Curves of the joints</h2>") == 1
    tables = page.split('<script type="application/json"')[0]
    assert "curve_sin1_" not in tables
    assert not [name for name in drawn["correlations"]["data"][0]["x"] if name.startswith("curve_")]


def test_result_json_sums_curves_up() -> None:
    run = calibrated()
    result = json.loads(json.dumps(run.result()))
    assert [one["joint"] for one in result["curves"]] == [one.number for one in run.curves]
    assert not [row for row in result["parameters"] if row["name"].startswith("curve_")]
    assert [line for line in run.lines() if line.startswith("Joint 1: curve of ")]


def test_a_picture_of_a_curve_can_be_asked_for() -> None:
    run = calibrated()
    assert len(run.plot(f"joint-curve-{run.curves[0].number}").data) == 4
