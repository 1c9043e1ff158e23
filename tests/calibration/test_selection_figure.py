"""The picture of a choice: small gains are seen beside a large one."""

from __future__ import annotations

import numpy as np

from truearm.calibration.figures import candidates_figure, choice_sentence
from truearm.engine.choosing.search import Gain
from truearm.engine.choosing.selection import Candidate, Selection
from truearm.engine.fit.models import named_model


def selection() -> Selection:
    """Return a choice in which one effect gains two hundred times as much as another."""
    rows = (
        Candidate("joint-curve", True, Gain(4e-5, 2e-6)),
        Candidate("backlash", True, Gain(2e-7, 1e-7)),
        Candidate("clearance", False, Gain(-6e-7, 3e-7), "it makes held-out errors larger"),
        Candidate("thermal-growth", False, None, "no temperature was recorded"),
    )
    return Selection(named_model("elastic"), "scattered", 0, 1e-4, None, 5e-5, rows)


def test_small_gains_are_seen_beside_a_large_one() -> None:
    drawn = candidates_figure(selection())
    taken, left_out = drawn["data"]
    lengths = dict(zip(taken["y"], taken["x"], strict=True))
    assert 0.1 < lengths["backlash"] / lengths["joint-curve"] < 0.5
    assert left_out["x"][0] < 0.0
    assert left_out["customdata"] == [-0.0006]
    assert [note["text"] for note in drawn["layout"]["annotations"]] == [
        "-0.0006 ± 0.0003",
        "+0.0002 ± 0.0001",
        "+0.0400 ± 0.0020",
    ]


def test_the_marks_of_the_axis_stand_where_gains_are_drawn() -> None:
    layout = candidates_figure(selection())["layout"]["xaxis"]
    places = dict(zip(layout["ticktext"], layout["tickvals"], strict=True))
    assert places["0"] == 0.0
    assert places["0.01"] > places["0.001"] > 0.0
    low, high = layout["range"]
    assert all(low <= place <= high for place in layout["tickvals"])
    assert np.all(np.diff(layout["tickvals"]) > 0.0)


def test_the_report_says_which_error_to_believe() -> None:
    assert choice_sentence(selection()).endswith("believe the held-out one.")
