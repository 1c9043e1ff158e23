"""Pictures of fleets: of few robots every value, of many no more than a picture needs."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.fleets.simulated_series import campaign, rows

from truearm.fleets.analysis import Analysis, analysed
from truearm.fleets.figures import fleet_figures
from truearm.fleets.series import Accuracy

COUNT = len(campaign().own)


def fleet(robots: int, off: float = 12.0, worst: float = 1.0) -> Analysis:
    rng = np.random.default_rng(1)
    truth = rng.standard_normal((robots, COUNT))
    truth[1, campaign().names.index("theta_offset_3")] = off
    errors = rng.uniform(4e-5, 6e-5, robots)
    errors[1] *= worst
    return analysed(
        replace(row, held_out=Accuracy(e, e, 2 * e, 9), nominal=Accuracy(2e-3, 2e-3, 4e-3, 9))
        for row, e in zip(rows(truth, rng), errors.tolist(), strict=True)
    )


@pytest.mark.parametrize("robots", [4, 12, 60])
def test_a_robot_a_thousand_times_off_does_not_hide_the_others(robots: int) -> None:
    figures = fleet_figures(fleet(robots, 1000.0, 1000.0))
    parameters = figures["parameters"]
    marked = next(trace for trace in parameters["data"] if trace.get("name") == "differs")
    far = marked["text"].index("robot-2")
    assert (marked["x"][far], marked["marker"]["symbol"][far]) == ("theta_offset_3", "triangle-up")
    assert marked["customdata"][far] == pytest.approx(1000.0, rel=0.05)
    drawn = [abs(y) for trace in parameters["data"] if trace["type"] == "scatter" for y in trace["y"]]
    assert max(drawn) < 12.0
    assert parameters["layout"]["yaxis"]["title"]["text"].endswith("triangles: beyond (robot-2)")
    assert figures["accuracy"]["layout"]["yaxis"]["type"] == "log"
    if robots > 10:
        histogram = figures["histogram"]
        assert max(histogram["data"][0]["x"]) < 0.07
        assert sum(histogram["data"][0]["y"]) == robots - 1
        assert histogram["layout"]["annotations"][0]["text"].startswith("beyond: robot-2 ")


def test_values_that_lie_together_are_all_drawn_at_their_places() -> None:
    figures = fleet_figures(fleet(12, 3.0))
    assert "beyond" not in figures["parameters"]["layout"]["yaxis"]["title"]["text"]
    assert figures["histogram"]["layout"]["annotations"] == []


def test_of_three_robots_every_value_is_drawn() -> None:
    figures = fleet_figures(fleet(3))
    assert set(figures) == {"accuracy", "parameters"}
    assert [len(trace["x"]) for trace in figures["accuracy"]["data"]] == [3, 3]
    marked = figures["parameters"]["data"][-1]
    assert (marked["name"], marked["x"], marked["text"]) == ("differs", ["theta_offset_3"], ["robot-2"])
    assert marked["y"][0] == pytest.approx(12.0, abs=0.5)


def test_of_many_robots_the_pictures_stay_small() -> None:
    figures = fleet_figures(fleet(2000))
    assert set(figures) == {"accuracy", "histogram", "parameters", "spread"}
    assert len(json.dumps(figures)) < 30_000
    assert sum(figures["histogram"]["data"][0]["y"]) == 2000
    box, marked = figures["parameters"]["data"]
    assert box["type"] == "box"
    assert box["median"][box["x"].index("a_3")] == pytest.approx(0.0, abs=0.1)
    assert box["upperfence"][box["x"].index("a_3")] == pytest.approx(1.96, abs=0.15)
    assert marked["text"] == ["robot-2"]
    spread = dict(zip(figures["spread"]["data"][0]["x"], figures["spread"]["data"][0]["y"], strict=True))
    assert spread["a_3"] == pytest.approx(1.0, abs=0.06)
    assert "d_2" not in spread


def test_changes_are_drawn_in_their_unit() -> None:
    rng = np.random.default_rng(2)
    truth = rng.standard_normal((1, COUNT))
    later = truth.copy()
    later[0, campaign().names.index("theta_offset_4")] += 2.0
    told = [
        *rows(truth, rng, names=["a"], of="<m>", date="2026-01-01"),
        *rows(later, rng, names=["b"], of="<m>", date="2026-07-01"),
    ]
    figures = fleet_figures(analysed(told))
    marks, line = figures["drift-angles"]["data"]
    legend = figures["drift-angles"]["layout"]["legend"]
    assert (legend["yref"], legend["y"]) == ("container", 0)  # the toolbar is at the top
    assert marks["name"] == "&lt;m&gt;, theta_offset_4"
    assert marks["y"][-1] == pytest.approx(0.2, abs=0.01)
    assert marks["error_y"]["array"][0] == 0.0
    assert line["y"][-1] == pytest.approx(0.2, abs=0.01)
    assert all("no more than chance" in t["name"] for t in figures["drift-lengths"]["data"] if "name" in t)
