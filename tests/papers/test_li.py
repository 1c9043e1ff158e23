from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.papers.small import small, table

from papers.li_table import METHODS, SURFACES, THEIRS, gain
from papers.li_table.arm import (
    BEYOND,
    PLACE,
    arm,
    at_bounds,
    board,
    fit,
    following_errors,
    tables,
    touched_by_hand,
    truth,
    verification,
)
from papers.study import Row, Study, Table
from truearm.calibration.calibrate import calibrate
from truearm.validation.jobs import validate

BOUNDED, UNBOUNDED = METHODS[THEIRS], METHODS["squares", False]
TOGETHER = SURFACES["together"]


@pytest.fixture(scope="module")
def found() -> Study:
    return small("li-table")


def row(of: Table, what: str) -> Row:
    return next(row for row in of.rows if row.what == what)


def test_the_board_has_a_circle_and_a_straight_path() -> None:
    points = board()
    assert points.shape == (33, 3)
    np.testing.assert_allclose(np.hypot(points[:24, 0], points[:24, 1]), 0.08, atol=1e-15)
    assert not points[24:, 0].any()
    roll = tables(points)["roll"].in_world - np.array(PLACE.translation)
    np.testing.assert_allclose(roll[:, 2], points[:, 1] * np.sin(np.radians(11.7)), atol=1e-12)


def test_the_documents_bounds_hold() -> None:
    rng, nominal = np.random.default_rng(0), arm()
    twin = truth(nominal, rng, BEYOND)
    data = touched_by_hand(
        tables(board())["normal"], twin, rng
    )  # in the table's frame: nothing fits, so bounds must hold
    fitted = fit(nominal, data, "distances", True)
    for p in fitted.parameters.values():
        if p.group in ("joint zero", "geometry"):
            width = {"m": 5e-3, "rad": np.radians(2.0)}[p.unit]
            assert abs(p.value - nominal.values[p.name]) <= width * (1 + 1e-9)
    assert at_bounds(nominal, fitted) > 0
    assert at_bounds(nominal, nominal) == 0


def test_a_robot_that_knows_itself_follows() -> None:
    twin = truth(arm(), np.random.default_rng(1))
    assert following_errors(twin.robot, twin, verification()).max() < 1e-6
    assert 20.0 < following_errors(arm(), twin, verification()).mean() < 22.0


def test_gains_are_those_of_the_mean_errors() -> None:
    assert gain(np.array([1.0, 3.0]), np.array([0.5, 0.5])) == pytest.approx(75.0)


def test_with_play(found: Study) -> None:
    points, path, ways = found.tables[0], found.tables[1], table(found, "With play")
    assert row(points, "before").verdict == "same order"
    assert row(points, "after, normal table").verdict == "by construction"
    assert all(row.published is None for row in path.rows if row.what.startswith("mean"))
    for tilt in ("normal", "roll", "pitch", TOGETHER):
        assert row(ways, f"{tilt}: {BOUNDED}").median < row(ways, "before").median
        assert row(ways, f"{tilt}: {BOUNDED}").highest < row(ways, f"{tilt}: {UNBOUNDED}").lowest


def test_without_play(found: Study) -> None:
    ways = table(found, "Without play")
    bounded, unbounded = row(ways, f"normal: {BOUNDED}"), row(ways, f"normal: {UNBOUNDED}")
    assert all(2 * a < b for a, b in zip(bounded.values, unbounded.values, strict=True))
    assert all(row(ways, f"{TOGETHER}: {method}").highest < 0.3 for method in METHODS.values())


def test_geometry_beyond_the_bounds_is_still_mostly_taken_away(found: Study) -> None:
    geometry = table(found, "Geometry alone")
    assert [r.verdict for r in geometry.rows] == ["by construction", "same order", "differs", "differs", "differs"]
    assert max(r.highest for r in geometry.rows[2:]) < 8.0


def test_each_reading_of_the_objective_is_best_by_itself(found: Study) -> None:
    distances, distances_other, components_other, components = (r.values for r in table(found, "Two readings").rows)
    assert all(a < b for a, b in zip(distances, distances_other, strict=True))
    assert all(a < b for a, b in zip(components, components_other, strict=True))


def test_the_table_alone(found: Study) -> None:
    rows = table(found, "The table alone").rows
    before, after = rows[0::6], rows[3::6]
    for old, new in zip(before, after, strict=True):
        assert "other points of the table" in old.what
        assert new.highest < 0.2 < old.highest


def test_absolute_values_do_not_notice_mistakes(found: Study) -> None:
    distances, components, squares, unbounded = (r.median for r in table(found, "Three holes").rows)
    assert max(distances, components) < 0.4 < 0.8 < min(squares, unbounded)


def test_the_documents_fit_is_one_command(found: Study, tmp_path: Path) -> None:
    """On the study's readings it leaves what the study's own code leaves."""
    for name, text in found.files.items():
        (tmp_path / name).write_text(text)
    ways = table(found, "Without play")
    for surface in ("normal", "roll", "pitch"):
        calibrated = calibrate(
            tmp_path / "robot.yaml",
            tmp_path / f"{surface}.csv",
            train="all",
            loss="l1",
            redundancy="none",
            hold=["base", "targets"],
            frames=tmp_path / "frames.yaml",
            bounds=tmp_path / "bounds.yaml",
        )
        left = validate(calibrated.robot, tmp_path / "unseen.csv").errors.position
        assert left is not None
        assert 1e3 * left.mean == pytest.approx(row(ways, f"{surface}: {BOUNDED}").values[0], rel=1e-3)
        assert "hold-contradicts" not in {notice.code for notice in calibrated.warnings}
