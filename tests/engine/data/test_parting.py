"""Configurations at which the joints stand alike are in one part of a campaign."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.engine.data.parting import parted, postures_of

SIX = ("revolute",) * 6


def joints(postures: int, times: int, off: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return joint positions of postures that were visited in any order, a little off, and which they are of."""
    rng = np.random.default_rng(seed)
    of = rng.permutation(np.repeat(np.arange(postures), times))
    return rng.uniform(-2.0, 2.0, (postures, 6))[of] + rng.uniform(-off, off, (len(of), 6)), of


@pytest.mark.parametrize("off", [0.0, math.radians(0.004)])
def test_postures_that_were_visited_again_are_known(off: float) -> None:
    q, of = joints(40, 5, off)
    found = postures_of(q, SIX)
    assert np.array_equal(found[:, None] == found, of[:, None] == of)
    assert np.array_equal(found, [of.tolist().index(posture) for posture in of])


def test_what_stands_like_others_stands_like_all_of_these() -> None:
    q = np.zeros((30, 2))
    q[:, 0] = math.radians(0.009) * np.random.default_rng(1).permutation(30)
    assert len(set(postures_of(q, ("revolute", "prismatic")).tolist())) == 1
    q[:, 1] = q[:, 0] * 100.0
    assert len(set(postures_of(q, ("revolute", "prismatic")).tolist())) == 30


def test_many_different_ones_are_found_different() -> None:
    q, _ = joints(20_000, 1, 0.0)
    assert len(np.unique(postures_of(q, SIX))) == 20_000


def test_one_posture_is_in_one_part() -> None:
    q, of = joints(14, 3, math.radians(0.002))
    for seed in range(20):
        training, held_out = parted(q, SIX, 29, seed)
        assert sorted([*training, *held_out]) == [*range(42)]
        assert not {*of[training]} & {*of[held_out]}
        assert len(training) == 30
        assert parted(q, SIX, 1, seed)[0].size == 3
        assert parted(q, SIX, 41, seed)[0].size == 39
        assert parted(q, SIX, 42, seed)[0].size == 42
    data = campaign("irb120", 14, 0.0, 1)[1].of_configurations(np.tile(np.arange(14), 2))
    one, other = data.split(0.5, seed=3)
    assert not {tuple(row) for row in one.joints} & {tuple(row) for row in other.joints}


def test_where_none_was_visited_again_it_is_a_permutation() -> None:
    q, _ = joints(50, 1, 0.0)
    order = np.random.default_rng(4).permutation(50)
    training, held_out = parted(q, SIX, 35, 4)
    assert np.array_equal([*training, *held_out], order)
    assert len(training) == 35
    assert [part.size for part in parted(np.zeros((9, 6)), SIX, 6, 0)] == [6, 3]
