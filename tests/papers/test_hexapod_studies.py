"""The studies of the hexapod device with small settings: what they must show."""

from __future__ import annotations

import pytest
from tests.papers.small import medians, small


def test_the_device() -> None:
    study = small("hexapod-device")
    counts, uncertainty, accuracy, drift, changer, repeated, fourth = study.tables
    assert {row.verdict for row in counts.rows[:5]} == {"agrees"}
    # Poses are numbered by the printed pairs, which then are no evidence.
    groups = [row for row in counts.rows if row.what.endswith("pairs as printed")]
    assert [(row.median, row.verdict) for row in groups] == [(6, "by construction")] * 3
    assert {row.verdict for row in counts.rows[-2:]} == {"same order", "not worse"}
    # The document's way gives its figures; only t3 differs, where it leaves correlations out.
    differing = {row.what for row in uncertainty.rows if row.verdict == "differs"}
    assert differing == {f"solution {solution}, t3" for solution in (1, 2, 3, 4)}
    assert all(row.verdict == "differs" for row in accuracy.rows if row.published is not None)
    assert next(row.median for row in accuracy.rows if row.what == "at 95 %") == pytest.approx(3.024, abs=5e-4)
    found = medians(study, "Drift of the bar")
    assert found["put on its calibrator before each pose: mean"] < 1.3 * found["a bar that does not drift: mean"]
    assert found["never put on its calibrator: mean"] > 1.5 * found["a bar that does not drift: mean"]
    assert max(row.highest for row in drift.rows) < 10.0  # um
    anew = medians(study, "The tool changer")["attached anew before every pose: mean error of the cups"]
    assert 1e3 * anew > 5 * found["never put on its calibrator: mean"]
    assert any(row.verdict == "by construction" for row in changer.rows)
    assert max(row.highest for row in repeated.rows) < 10.0
    assert [row.median for row in fourth.rows] == [4]
    assert len(study.pictures) == 2


def test_the_irb120() -> None:
    study = small("irb120-hexapod")
    assert {row.verdict for row in study.tables[0].rows if row.published is not None} == {"by construction"}
    session = medians(study, "Errors in 39")
    # A turn about axis 6 moves what is far from it, and the flange not at all.
    assert session["T1: mean"] < session["T2: mean"] < session["T3: mean"]
    assert session["flange, orientation: mean"] == pytest.approx(0.333, abs=0.08)
    one_side, either = "flange, all joints from below", "flange, joints come from either side"
    repeatability = medians(study, "Repeatability")
    assert repeatability[one_side] == pytest.approx(0.010, abs=0.006)
    assert repeatability[either] > 2 * repeatability[one_side]
    printed = (0.036, 0.041, 0.043)
    whole, two, fifth, from_before = (
        [repeatability[f"T{cup}, {way}"] for cup in (1, 2, 3)]
        for way in (
            "joints come from either side",
            "joints 4 and 6 come from either side",
            "a fifth of the backlash, joints come from either side",
            "each pose always from the one before",
        )
    )
    assert two == pytest.approx(whole, rel=0.25)  # what makes our figure
    assert fifth == pytest.approx(printed, rel=0.5)  # and what would make the document's
    assert all(ours > 2 * theirs for ours, theirs in zip(whole, printed, strict=True))
    assert all(ours < 0.6 * theirs for ours, theirs in zip(from_before, printed, strict=True))
    spheres = [row for row in study.tables[6].rows if row.what.endswith("standard deviation")]
    assert len(spheres) == 6
    assert all(0.04 < row.median < 0.30 for row in spheres)
    about_fitted = medians(study, "The same about the centre")
    for row in spheres:
        assert about_fitted[row.what] <= row.median
    everywhere = {row.what.split(" (")[0]: row.median for row in study.tables[8].rows if row.what.endswith("mean")}
    assert everywhere["four cups"] < everywhere["one place, joints come from either side"]
    in_turn, once = "three places, frames by touches, in turn", "three places, frames by touches"
    assert everywhere[in_turn] > everywhere[once] > everywhere["three places"]
    assert len(study.pictures) == 3
