"""A calibration speaks for itself: residuals as a table, pictures, and its own short text."""

from __future__ import annotations

import sys
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from tests.simulated import campaign

import truearm
from truearm.measurement.statistics import errors_of
from truearm.results.calibration import Calibration


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
    assert "Status: converged. Hold configurations out to judge the fit." in repr(run())


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
    assert text.startswith("On 12 configurations the fit has not seen:\n  nominal     mean ")
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
