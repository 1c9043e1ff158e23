"""Folds of scattered configurations and of those on grids and paths."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from truearm.engine.choosing.cross_validation import FOLDS, draws_of, folds_of, layout_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot


def dataset(joints: Array, *, ordered: bool = True) -> Dataset:
    order = np.arange(len(joints)) if ordered else None
    made = Dataset.of(joints, np.zeros((len(joints), 3)), order=order)
    assert (made.number is not None) == ordered
    return made


def path(count: int) -> Array:
    along = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(np.sin(along * np.array([3.0, 2.0, 4.0, 1.0, 2.5, 1.5])))


def grid() -> Array:
    return np.array(list(product([0.0, 0.3, 0.6, 0.9], [0.0, 0.4, 0.8], [-0.2, 0.1, 0.4], [0.0], [0.5, 1.0], [0.0])))


@pytest.mark.parametrize("name", ["irb120", "li3", "ur10"])
@pytest.mark.parametrize("count", [20, 40, 200])
def test_random_configurations_are_scattered(name: str, count: int) -> None:
    for seed in range(3):
        data = dataset(load_robot(name).random_configurations(count, np.random.default_rng(seed)))
        folds = folds_of(data, seed)
        assert folds.layout == "scattered"
        assert folds.blocks == 0
        assert sorted(np.bincount(folds.of).tolist())[0] >= count // FOLDS
        assert list(folds.group) == list(range(count))


@pytest.mark.parametrize(
    ("joints", "ordered", "layout"), [(path(120), True, "path"), (path(120), False, "close"), (grid(), False, "grid")]
)
def test_grids_and_paths_are_held_out_in_blocks_of_neighbours(joints: Array, ordered: bool, layout: str) -> None:
    data = dataset(joints, ordered=ordered)
    folds = folds_of(data, 1)
    assert folds.layout == layout
    assert folds.blocks >= 2 * FOLDS
    assert len(np.unique(folds.of)) == FOLDS
    for block in range(folds.blocks):
        assert len(np.unique(folds.of[folds.group == block])) == 1
    q = data.joints
    apart = np.linalg.norm(q[:, None] - q, axis=2)
    np.fill_diagonal(apart, np.inf)
    together = folds.of[apart.argmin(axis=1)] == folds.of
    assert together.mean() > 0.45  # one by one it would be a fifth


def test_a_robot_that_stands_still_is_no_grid() -> None:
    assert layout_of(dataset(np.zeros((30, 6)))) == "scattered"


def test_folds_follow_from_the_seed() -> None:
    data = dataset(path(120))
    assert np.array_equal(folds_of(data, 4).of, folds_of(data, 4).of)
    assert not np.array_equal(folds_of(data, 4).of, folds_of(data, 5).of)


def test_few_configurations_are_held_out_several_times() -> None:
    rng = np.random.default_rng(3)
    counts = {}
    for count in (20, 40, 100):
        data = dataset(rng.uniform(-1.0, 1.0, (count, 6)))
        draws = draws_of(data, 7)
        counts[count] = len(draws)
        assert np.array_equal(draws[0].of, folds_of(data, 7).of)
        assert len({tuple(folds.of.tolist()) for folds in draws}) == len(draws)
    assert counts == {20: 4, 40: 3, 100: 1}
