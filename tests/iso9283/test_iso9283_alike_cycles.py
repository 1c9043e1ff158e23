"""Cycles that are like those before them: said where they are, and seldom where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.rows import Cycles, Instrument
from truearm.iso9283.criteria.wild_rows import alike_cycles, unusual_rows
from truearm.iso9283.evaluating.evaluation import Evaluation
from truearm.iso9283.evaluating.table import row_notices


def group(points: Array, pose: str = "P1", test: str = "AP") -> Cycles:
    n = len(points)
    number = np.arange(1, n + 1)
    return Cycles(
        test, "", pose, "", 1.0, 1.0, number, np.full(n, np.nan), 1e-5 * points, None, np.zeros(3), number + 1
    )


def campaign(rng: np.random.Generator, share: float, common: float = 0.0, test: str = "AP") -> list[Cycles]:
    """Return five poses of thirty cycles; each is a share of the one before, and moves with the others by an amount."""
    together = common * rng.standard_normal((30, 3))
    made = []
    for k in range(1, 6):
        points = rng.standard_normal((30, 3)) * [3.0, 1.0, 0.3] + together
        for row in range(1, 30):
            points[row] = share * points[row - 1] + np.sqrt(1 - share**2) * points[row]
        made.append(group(points, f"P{k}", test))
    return made


def test_cycles_that_creep_are_said_with_their_correlation() -> None:
    rng = np.random.default_rng(0)
    unusual = unusual_rows(campaign(rng, 0.8), Instrument(1e-6))
    (one,) = unusual.alike
    assert 0.5 < one.correlation < 0.95
    found = Evaluation((), Alignment.__new__(Alignment), unusual=unusual)
    (notice,) = (notice for notice in row_notices(found) if notice.code == "cycles-alike")
    assert notice.level == "warning"
    assert f"AP, 100 %, load 100 % (correlation {one.correlation:.2f}" in notice.message


def test_independent_cycles_are_seldom_said_even_if_all_poses_move_together() -> None:
    rng = np.random.default_rng(1)
    for common in (0.0, 3.0):
        said = sum(bool(alike_cycles(campaign(rng, 0.0, common))) for _ in range(300))
        assert said <= 8  # 1 %, and what chance adds to it


def test_few_cycles_drift_and_points_without_scatter_are_not_judged() -> None:
    rng = np.random.default_rng(2)
    creeping = campaign(rng, 0.9)
    assert alike_cycles([one.rows(slice(0, 9)) for one in creeping]) == ()
    assert alike_cycles([replace(one, test="dAP") for one in creeping]) == ()
    assert alike_cycles([group(np.ones((30, 3)))]) == ()
    # cycles that only some poses have are left aside
    assert len(alike_cycles([creeping[0].rows(slice(3, None)), *creeping[1:]])) == 1
