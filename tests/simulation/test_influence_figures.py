from __future__ import annotations

import json

import numpy as np
from tests.katana import katana

from papers.katana.robot import NAMES, PERTURBATIONS
from truearm.simulation.influence_report import influence_figure
from truearm.simulation.influences import Influence, influence


def test_the_picture_shows_average_and_range_in_mm() -> None:
    robot = katana()
    q = robot.random_configurations(30, np.random.default_rng(1))
    result = influence(robot, q, NAMES, "tip", PERTURBATIONS)
    shown = influence_figure(result)
    (bars,) = shown["data"]
    assert bars["x"] == list(NAMES)
    np.testing.assert_allclose(bars["y"], 1e3 * result.size.mean(axis=1), rtol=1e-3)
    error = bars["error_y"]
    high, low = np.add(bars["y"], error["array"]), np.subtract(bars["y"], error["arrayminus"])
    np.testing.assert_allclose(high, 1e3 * result.size.max(axis=1), rtol=2e-3)
    np.testing.assert_allclose(low, 1e3 * result.size.min(axis=1), rtol=0, atol=1e-3)
    assert min(error["array"] + error["arrayminus"]) >= 0
    assert "[mm]" in shown["layout"]["yaxis"]["title"]["text"]
    json.dumps(shown, allow_nan=False)


def test_names_cannot_be_markup() -> None:
    shown = influence_figure(Influence(("target_<b>_x",), np.ones(1), np.ones((1, 2))))
    assert shown["data"][0]["x"] == ["target_&lt;b&gt;_x"]
