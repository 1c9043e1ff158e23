"""How large groups of parameters are expected to be, held against closed forms and brute force."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from truearm.engine.fit.relevance import NO_SIZES, Moments, Sizes, _climbed, expected_sizes
from truearm.engine.robot.chain import Array

#: Deviations that brute force looks at: the range of those that may be found.
GRID = np.geomspace(1e-3, 3.0, 4001)


def moments_of(columns: Array, right: Array) -> Array:
    """Return products of the columns and the right side of equations whose noise is 1."""
    every = np.column_stack([columns, right])
    return np.asarray(every.T @ every)


def brute_force(columns: Array, right: Array, scale: float) -> float:
    """Return the likeliest deviation of one group: marginal likelihood times 1 / (1 + (s/c)^2), on a grid."""
    size, turned = np.linalg.eigh(columns @ columns.T)
    right = turned.T @ right
    grown = GRID[:, None] ** 2 * size
    heights = -0.5 * (np.log1p(grown) + right**2 / (1.0 + grown)).sum(axis=1) - np.log1p((GRID / scale) ** 2)
    return float(GRID[int(np.argmax(heights))])


def climbed(
    columns: Array, right: Array, groups: list[int], scale: list[float], *, noisy: bool = False
) -> tuple[Array, Array, float, Callable[[NDArray[np.bool_]], float]]:
    """Climb from the scale of every group, all of which move."""
    scales, most, every = np.array(scale), np.full(len(scale), 3.0), np.ones(len(scale), dtype=bool)
    within = (0.0, np.inf) if noisy else (1.0, 1.0)
    moments = moments_of(columns, right)
    return _climbed(moments, float(len(right)), np.array(groups), scales, scales, most, within, every)


@pytest.mark.parametrize(
    ("size", "scale"), [(0.03, 0.01), (0.2, 0.01), (0.03, 0.1), (0.2, 0.1), (0.9, 0.1), (0.03, 1.0), (0.9, 1.0)]
)
def test_the_deviation_of_a_group_is_the_likeliest(size: float, scale: float) -> None:
    rng = np.random.default_rng(4)
    # Orthonormal columns, of which a deviation of `size` makes 12 deviations of the noise.
    columns = np.linalg.qr(rng.normal(size=(60, 8)))[0] * 12.0 / size
    right = columns @ rng.normal(scale=size, size=8) + rng.normal(size=60)
    (deviation,), (told,), noise, _ = climbed(columns, right, [0] * 8, [scale])
    assert deviation == pytest.approx(brute_force(columns, right, scale), rel=0.02)
    assert noise == 1.0
    # The parameters that the data know, of columns of one size: m v a^2 / (1 + v a^2).
    shown = (deviation * 12.0 / size) ** 2
    assert told == pytest.approx(8 * shown / (1.0 + shown), rel=1e-3)


def test_without_a_belief_the_variance_is_what_is_left_after_the_noise() -> None:
    """The closed form of orthonormal columns: v = w'w / m - 1, of the projections w, where the scale is very wide."""
    rng = np.random.default_rng(8)
    columns = np.linalg.qr(rng.normal(size=(400, 200)))[0] * 10.0
    right = columns @ rng.normal(scale=0.5, size=200) + rng.normal(size=400)
    projections = columns.T @ right / 10.0
    likeliest = (float(projections @ projections) / 200 - 1.0) / 10.0**2
    (deviation,), *_ = climbed(columns, right, [0] * 200, [100.0])
    assert deviation**2 == pytest.approx(likeliest, rel=0.02)


def test_what_is_not_there_shrinks_beside_what_is() -> None:
    rng = np.random.default_rng(2)
    columns = 50.0 * np.linalg.qr(rng.normal(size=(120, 24)))[0]
    right = columns[:, :12] @ rng.normal(scale=0.4, size=12) + rng.normal(size=120)
    deviation, told, *_ = climbed(columns, right, [0] * 12 + [1] * 12, [0.2, 0.2])
    assert deviation[0] == pytest.approx(0.4, rel=0.35)
    assert deviation[1] < 0.03  # a deviation of the noise is 0.02
    assert told[0] > 11.5


def test_the_noise_is_found_where_nobody_declared_it() -> None:
    rng = np.random.default_rng(6)
    columns = rng.normal(size=(400, 6))
    right = columns @ rng.normal(size=6) + 3.0 * rng.normal(size=400)
    deviation, told, noise, _ = climbed(columns, right, [0] * 6, [1.0], noisy=True)
    assert noise == pytest.approx(9.0, rel=0.15)
    assert told.sum() < 6.0
    assert 0.3 < deviation[0] < 3.0


def test_the_order_of_groups_and_parameters_makes_no_difference() -> None:
    rng = np.random.default_rng(3)
    columns = 20.0 * rng.normal(size=(90, 9))
    right = columns @ rng.normal(scale=[0.5] * 3 + [0.05] * 3 + [0.0] * 3) + rng.normal(size=90)
    groups, scales = np.repeat([0, 1, 2], 3), np.array([0.3, 0.2, 0.1])
    one = climbed(columns, right, groups.tolist(), scales.tolist())
    order, renamed = rng.permutation(9), np.array([2, 0, 1])
    back = np.argsort(renamed)
    two = climbed(columns[:, order], right, renamed[groups[order]].tolist(), scales[back].tolist())
    assert two[0] == pytest.approx(one[0][back], rel=1e-9)
    assert two[1] == pytest.approx(one[1][back], rel=1e-9)


def test_the_gain_of_groups_is_that_of_the_dense_likelihood() -> None:
    rng = np.random.default_rng(5)
    columns = 3.0 * rng.normal(size=(50, 6))
    right = columns @ rng.normal(scale=[0.5] * 4 + [0.0] * 2) + rng.normal(size=50)
    group, start = np.array([0, 0, 1, 1, 2, 2]), np.array([0.5, 0.4, 0.3])
    stay = np.zeros(3, dtype=bool)
    moments, most = moments_of(columns, right), np.full(3, 3.0)
    deviation, _, noise, gain = _climbed(moments, 50.0, group, start, start, most, (1.0, 1.0), stay)
    assert deviation.tolist() == start.tolist()
    assert noise == 1.0

    def likelihood(deviations: Array) -> float:
        V = np.eye(50) + (columns * deviations[group] ** 2) @ columns.T
        return -0.5 * float(np.linalg.slogdet(V)[1] + right @ np.linalg.solve(V, right))

    for groups in ([0], [2], [0, 1]):
        without = np.isin(np.arange(3), groups)
        expected = likelihood(start) - likelihood(np.where(without, 0.0, start))
        assert gain(without) == pytest.approx(expected, rel=1e-9)


def two_groups() -> Sizes:
    """Return groups of three and of two parameters."""
    groups: dict[tuple[str, ...], tuple[str, ...]] = {
        ("a", "rad", "1"): ("a1", "a2", "a3"),
        ("b", "rad", ""): ("b1", "b2"),
    }
    return Sizes(groups, deviation=np.array([0.2, 0.01]), scale=np.array([0.3, 0.02]))


NAMES = ["geometry", "a1", "b2", "a2", "b1", "a3"]


def equations(columns: Array, right: Array) -> Moments:
    return Moments(moments_of(columns, right), len(right), np.zeros(columns.shape[1]), np.zeros(0))


def test_of_a_group_that_the_data_do_not_show_is_expected_what_was_believed() -> None:
    """The integrals of s and of 1 over d log(s) / (1 + (s/c)^2) from 0.001 to 1 have closed forms."""
    sizes, least, rng = two_groups(), 1e-3, np.random.default_rng(1)
    shown = np.array([name[0] != "b" for name in NAMES])
    columns = rng.normal(size=(40, 6)) * np.where(shown, 30.0, 0.0)
    found = expected_sizes(sizes, equations(columns, columns @ np.ones(6)), NAMES)
    c, now = 0.02, 0.01  # of group b
    whole = -np.log(least) - 0.5 * np.log((1.0 + c**-2) / (1.0 + (least / c) ** 2))
    mean = c * (np.arctan(1.0 / c) - np.arctan(least / c)) / whole
    assert np.sqrt(found[~shown]) * now == pytest.approx(mean, rel=0.1)  # of a few levels
    assert found[0] == 1.0  # what is in no group keeps its prior
    seen = [NAMES.index(name) for name in ("a1", "a2", "a3")]
    assert np.ptp(found[seen]) == 0.0
    assert 0.5 < found[seen[0]] < 30.0  # ones of a deviation of 0.2 make 25
    assert expected_sizes(NO_SIZES, equations(np.eye(6), np.ones(6)), NAMES).tolist() == [1.0] * 6
