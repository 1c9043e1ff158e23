"""A calibration speaks for itself: residuals as a table, pictures, and its own short text."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from tests.simulated import campaign

import truearm
from truearm.calibration.result import Calibration
from truearm.engine.data.statistics import errors_of


@cache
def run(train: int | None = None) -> Calibration:
    _, data = campaign("irb120", 40, 0.05e-3, 1)
    return truearm.calibrate("irb120", data, train="all" if train is None else train)


def test_residuals_are_the_errors_reading_by_reading() -> None:
    found = run(28).residuals()
    data = run(28).data
    assert len(found) == len(data.target)
    assert np.unique(found.part, return_counts=True)[1].tolist() == [12 * 3, 28 * 3]
    error = errors_of(run(28).fit.robot, data).position_errors
    places = {
        (data.labels[c], data.targets[t]): e for c, t, e in zip(data.configuration, data.target, error, strict=True)
    }
    for row in found:
        np.testing.assert_allclose(row.error, places[row.configuration, row.target], rtol=0, atol=1e-15)
        assert row.norm == pytest.approx(float(np.linalg.norm(row.error)))
    held_out = {data.labels[i] for i in run(28).held_out}
    assert {row.configuration for row in found if row.part == "held out"} == held_out


def test_without_a_held_out_part_all_residuals_are_of_training() -> None:
    assert set(run().residuals().part.tolist()) == {"training"}
    assert "Next (hold-out): Hold configurations out to judge the fit" in "\n".join(run().lines())


def test_residuals_as_a_data_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    pandas = ModuleType("pandas")
    pandas.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    found = run(28).residuals()
    frame: dict[str, Any] = found.to_pandas()
    assert list(frame) == ["configuration", "target", "part", "kind", "ex", "ey", "ez", "norm"]
    np.testing.assert_array_equal(frame["ez"], found.error[:, 2])


def test_the_text_is_what_the_command_prints_and_is_short() -> None:
    text = repr(run(28))
    mark = "SIMULATED: measurements of a virtual instrument, not of a robot.\n"
    assert text.startswith(f"{mark}On 12 configurations the fit has not seen:\n  nominal     mean ")
    assert "Status: converged." in text
    assert run(28)._repr_html_() == f"<pre>{text}</pre>".replace("'", "&#x27;")
    for record in (run(28), run(28).residuals()):
        assert len(repr(record)) <= 2000


def test_pictures() -> None:
    assert type(run(28).plot()).__name__ == "Figure"
    shown = run(28).plot("position-histogram")
    assert len(shown.data) == 2
    with pytest.raises(
        truearm.InputError, match=r"picture: the calibration has no such picture.*Did you mean residuals"
    ):
        run(28).plot("residual")


def test_the_error_to_expect_stands_beside_the_held_out_one() -> None:
    found, shown = run(28).expected, run(28).summary()["expected_mm"]
    overall = found.overall
    assert list(shown) == ["mean", "p95", "interval_90", "lower_bound", "omissions", "targets", "frame", "payload"]
    assert shown["mean"] == pytest.approx(1e3 * overall.mean)
    assert shown["interval_90"] == pytest.approx([1e3 * end for end in overall.interval_90])
    assert shown["interval_90"][0] < shown["mean"] < shown["interval_90"][1] < shown["p95"] * 2
    assert (shown["lower_bound"], shown["omissions"]) == (False, [])
    assert list(shown["targets"]) == ["1", "2", "3"]
    assert list(shown["targets"]["2"]) == ["mean", "p95", "interval_90"]
    assert (shown["frame"], shown["payload"]) == ("the instrument's frame", "no payload")
    (line,) = (
        line
        for line in run(28).lines()
        if line.startswith("Expected over the workspace, without the instrument's noise: mean 0.0")
    )
    assert line.endswith(" mm; targets 1, 2, 3 in the instrument's frame, no payload")
    assert repr(run()).count("Expected over the workspace") == 1


def test_a_lower_bound_is_called_one() -> None:
    bound = replace(run(28), expected=replace(run(28).expected, omissions=("values at a bound count as exact",)))
    assert "  may be larger: values at a bound count as exact" in bound.lines()
    (said,) = [
        line
        for line in bound.lines()
        if line.startswith("Expected over the workspace, without the instrument's noise: mean ")
    ]
    assert " mm (90 %: " in said
    assert " or more), 95 % " in said
    assert "95 % below" not in said
    assert bound.summary()["expected_mm"]["interval_90"][1] is None
    assert bound.summary()["expected_mm"]["lower_bound"] is True


def test_the_map_of_the_error_to_expect() -> None:
    shown = run(28).plot("expected-error")
    assert [trace.type for trace in shown.data] == ["heatmap", "scatter"] * 2
    assert len(shown.data[1].x) == 28 * 3
    errors = [value for row in shown.data[0].z for value in row if value is not None]
    assert 0.2 * run(28).expected.overall.mean * 1e3 < min(errors)
    assert max(errors) < 10 * run(28).expected.overall.p95 * 1e3
