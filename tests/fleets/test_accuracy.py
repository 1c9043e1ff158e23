"""Quantiles of errors over a series: truth is the distribution that errors are drawn from."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.fleets.drift import quantiles, share_interval


@pytest.mark.parametrize(("robots", "share"), [(20, 0.5), (100, 0.9), (100, 0.95)])
def test_the_interval_of_a_quantile_covers_it_in_95_of_100_series(robots: int, share: float) -> None:
    rng = np.random.default_rng(1)
    truth = -np.log(1.0 - share)  # of the exponential distribution
    covered = 0
    for _ in range(400):
        (found,) = quantiles(rng.exponential(size=robots), (share,))
        assert found.low is not None
        assert found.high is not None
        assert found.value is not None
        assert found.low <= found.value <= found.high
        covered += found.low <= truth <= found.high
    assert covered >= 400 * 0.93


def test_what_few_robots_cannot_tell_is_not_told() -> None:
    median, ninety, *_ = quantiles(np.array([1.0, 2.0, 3.0]))
    assert median.value == 2.0
    assert median.low is None
    assert median.high is None
    assert ninety.value is None
    assert ninety.needed == 36


def test_the_robots_that_are_needed_give_both_ends() -> None:
    for share in (0.5, 0.9, 0.95):
        needed = quantiles(np.arange(3.0), (share,))[0].needed
        for robots, known in ((needed, True), (needed - 1, False)):
            (found,) = quantiles(np.arange(float(robots)), (share,))
            assert (found.low is not None and found.high is not None) == known


@pytest.mark.parametrize(
    ("count", "of", "low", "high"), [(0, 10, 0.0, 0.3085), (10, 10, 0.6915, 1.0), (1, 20, 0.0013, 0.2487)]
)
def test_the_share_of_robots_that_fail(count: int, of: int, low: float, high: float) -> None:
    assert share_interval(count, of) == pytest.approx((low, high), abs=1e-4)  # Clopper and Pearson's tables
