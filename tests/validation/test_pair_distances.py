"""Pair distances against SciPy's, and how much memory they take."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.validation.distances import pair_distances


def points(n: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    measured = rng.uniform(-0.6, 0.6, (n, 3))
    return measured * 1.0003 + rng.normal(0, 2e-4, (n, 3)) + [0.1, 0.2, -0.1], measured


@pytest.mark.parametrize("n", [2, 3, 257, 900])
def test_as_by_all_pairs_at_once(n: int) -> None:
    predicted, measured = points(n, n)
    result = pair_distances(predicted, measured)
    errors = pdist(predicted) - pdist(measured)
    assert result.pairs == len(errors) == result.counts.sum()
    assert (result.mean, result.deviation) == pytest.approx((np.abs(errors).mean(), np.abs(errors).std()), rel=1e-9)
    assert result.maximum == pytest.approx(np.abs(errors).max(), rel=1e-12)
    assert result.positive == pytest.approx((errors > 0).mean(), abs=1e-12)
    assert np.abs(result.counts - np.histogram(errors, result.edges)[0]).sum() <= 2  # at an edge, by rounding
    assert result.counts[0] > 0
    assert result.counts[-1] > 0


def test_pairs_within_a_configuration_do_not_count_and_order_does_not_matter() -> None:
    predicted, measured = points(300, 1)
    of = np.random.default_rng(2).integers(0, 40, 300)
    result = pair_distances(predicted, measured, of)
    i, j = np.triu_indices(300, 1)
    apart = of[i] != of[j]
    errors = (pdist(predicted) - pdist(measured))[apart]
    assert result.pairs == apart.sum()
    assert (result.mean, result.maximum) == pytest.approx((np.abs(errors).mean(), np.abs(errors).max()), rel=1e-9)


def test_a_rigid_motion_and_nothing_wrong() -> None:
    _, measured = points(50, 3)
    result = pair_distances(measured, measured)
    assert (result.mean, result.maximum, result.positive) == (0.0, 0.0, 0.0)
    turned = measured @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]) + [1, 2, 3]
    assert pair_distances(turned, measured).maximum < 1e-14


@pytest.mark.parametrize("size", [1e-6, 0.3])
def test_close_points_and_large_errors_are_as_right_as_others(size: float) -> None:
    """Hundreds of visits to four places, and a robot that is off by as much as its points lie apart."""
    rng = np.random.default_rng(6)
    measured = rng.uniform(-0.6, 0.6, (4, 3))[rng.integers(0, 4, 700)] + rng.normal(0, 2e-5, (700, 3))
    predicted = measured + rng.normal(0, size, (700, 3))
    result, errors = pair_distances(predicted, measured), pdist(predicted) - pdist(measured)
    assert (result.mean, result.deviation) == pytest.approx((np.abs(errors).mean(), np.abs(errors).std()), rel=1e-9)
    assert result.maximum == pytest.approx(np.abs(errors).max(), rel=1e-12)
    assert result.positive == pytest.approx((errors > 0).mean(), abs=1e-12)


def test_memory_is_bounded() -> None:
    predicted, measured = points(4000, 4)
    tracemalloc.start()
    pair_distances(predicted, measured)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 12e6  # all eight million pairs would be 64 MB


def test_refusals() -> None:
    predicted, measured = points(5, 5)
    with pytest.raises(InputError, match="different shapes"):
        pair_distances(predicted[:4], measured)
    with pytest.raises(InputError, match="two configurations"):
        pair_distances(predicted, measured, np.zeros(5))
    with pytest.raises(InputError, match="two configurations"):
        pair_distances(predicted[:1], measured[:1])
    measured[2, 1] = np.nan
    with pytest.raises(InputError, match="no position"):
        pair_distances(predicted, measured)
