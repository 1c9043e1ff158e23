"""Intervals hold the truth about as often as they say; those of the full size are in benchmarks/iso9283_coverage.py."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.intervals import (
    Interval,
    largest_difference,
    mean_interval,
    norm_interval,
    repeatability_interval,
    spread_interval,
)

CYCLES, CAMPAIGNS = 30, 200
#: 95 % less two and a half times what 200 campaigns leave open.
LEAST = 0.91


def ball(rng: np.random.Generator, *size: int) -> Array:
    way = rng.standard_normal((*size, 3))
    return np.asarray(way / np.linalg.norm(way, axis=-1, keepdims=True) * rng.random((*size, 1)) ** (1 / 3))


def scatter(kind: str, rng: np.random.Generator, *size: int) -> Array:
    deviations = {"isotropic": (1.0, 1.0, 1.0), "anisotropic": (10.0, 1.0, 1.0)}
    return ball(rng, *size) if kind == "ball" else rng.standard_normal((*size, 3)) * deviations[kind]


def share(intervals: list[Interval | None], truth: float) -> float:
    low, high = np.array(intervals, float).T
    return float(np.mean((low <= truth) & (truth <= high)))


@pytest.mark.parametrize("kind", ["isotropic", "anisotropic", "ball"])
@pytest.mark.parametrize("size", [0.0, 0.5, 20.0])
def test_pose_accuracy(kind: str, size: float) -> None:
    rng = np.random.default_rng(1)
    true = size * np.array([1.0, 1.0, 1.0])
    points = scatter(kind, rng, CAMPAIGNS, CYCLES) + true
    intervals = [norm_interval(p.mean(axis=0), np.cov(p.T), CYCLES, np.zeros((3, 3))) for p in points]
    assert share(intervals, float(np.linalg.norm(true))) >= LEAST
    if size == 20.0:
        widths = np.diff(np.array(intervals, float), axis=1).mean()
        deviation = np.sqrt(scatter(kind, rng, 100_000).sum(axis=1).var() / 3 / CYCLES)
        assert widths < 1.2 * 2 * 1.96 * deviation


@pytest.mark.parametrize("kind", ["isotropic", "anisotropic", "ball"])
def test_repeatability(kind: str) -> None:
    rng = np.random.default_rng(2)
    length = np.linalg.norm(scatter(kind, rng, 300_000), axis=1)
    truth = float(length.mean() + 3 * length.std())
    intervals = [repeatability_interval(points) for points in scatter(kind, rng, CAMPAIGNS, CYCLES)]
    assert share(intervals, truth) >= LEAST
    campaigns = scatter(kind, rng, 4000, CYCLES)
    distance = np.linalg.norm(campaigns - campaigns.mean(axis=1, keepdims=True), axis=2)
    own = np.quantile(distance.mean(axis=1) + 3 * distance.std(axis=1, ddof=1), (0.025, 0.975))
    assert np.mean(np.diff(np.array(intervals, float), axis=1)) < 1.5 * np.diff(own)[0]


def test_means_and_spreads() -> None:
    rng = np.random.default_rng(3)
    numbers = rng.standard_normal((CAMPAIGNS, CYCLES)) + 2.0
    assert share([mean_interval(row) for row in numbers], 2.0) >= LEAST
    assert share([spread_interval(float(row.std(ddof=1)), CYCLES) for row in numbers], 3.0) >= LEAST
    off = numbers + 0.5 * rng.standard_normal((CAMPAIGNS, 1))
    assert share([mean_interval(row) for row in off], 2.0) < 0.7
    assert share([mean_interval(row, 0.25) for row in off], 2.0) >= LEAST


@pytest.mark.parametrize("apart", [0.0, 2.0])
def test_largest_differences(apart: float) -> None:
    rng = np.random.default_rng(4)
    places = np.array([[0.0, 0, 0], [0, 0, 0], [apart, 0, 0]])
    points = rng.standard_normal((100, 3, CYCLES, 3)) + places[:, None]
    intervals = [largest_difference(list(p), [(0, 1), (0, 2), (1, 2)])[1] for p in points]
    assert share(intervals, apart) >= LEAST
    assert np.mean(np.diff(np.array(intervals, float), axis=1)) < 1.5


def test_what_does_not_scatter_or_is_too_little_has_no_interval() -> None:
    same = np.ones((30, 3))
    assert repeatability_interval(same) is None
    assert repeatability_interval(np.eye(3)) is None
    assert spread_interval(0.0, 30) is None
    assert mean_interval(np.arange(4.0)) is None
    assert norm_interval(np.ones(3), np.zeros((3, 3)), 30, np.zeros((3, 3))) is None
    assert largest_difference([same, same], [(0, 1)]) == (0.0, None)


def test_intervals_have_the_unit_of_the_values() -> None:
    points = np.random.default_rng(5).standard_normal((30, 3)) + 1.0

    def of_norm(p: Array) -> Interval | None:
        return norm_interval(p.mean(axis=0), np.cov(p.T), 30, np.zeros((3, 3)))

    for interval_of in (repeatability_interval, of_norm):
        metres, millimetres = interval_of(points), interval_of(1e3 * points)
        assert metres is not None
        assert millimetres is not None
        assert np.array(millimetres) == pytest.approx(1e3 * np.array(metres), rel=1e-6)
