from __future__ import annotations

import pytest
from tests.papers.small import small


def test_kr5() -> None:
    found = small("kr5-gdt")
    errors, coverage, ranks, tolerances, before, reductions, models = found.tables
    assert {row.claim for row in errors.rows} == {"construction"}
    assert sum(row.verdict == "by construction" for row in errors.rows) >= 20
    assert sum(row.median for row in coverage.rows) / len(coverage.rows) > 90.0
    assert [row.median for row in ranks.rows] == [25.0, 23.0, 24.0]
    assert not tolerances.compares  # Table 4 beside Table 3 would be circular
    assert before.rows[0].median == pytest.approx(3.98, rel=0.15)
    percent = [row for row in reductions.rows if row.unit == "%"]
    assert min(row.lowest for row in percent) > 95.0
    assert {row.verdict for row in (*percent, *models.rows)} == {"differs"}
    assert len(found.pictures) == 3
