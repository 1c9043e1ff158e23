"""Whether a calibrated robot is better than the nominal one, by pairs of errors at unseen configurations."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.stats import wilcoxon
from tests.simulated import campaign

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.gain import check_gain, signed_rank_probability
from truearm.engine.robot.chain import Array


def test_the_probability_is_that_of_all_ways_to_choose_signs() -> None:
    for seed in range(4):
        d = np.random.default_rng(seed).integers(-4, 6, 10).astype(float)  # with zeros, and equal sizes
        d = d[d != 0.0]
        ranks = np.array([(np.abs(d) < size).sum() + ((np.abs(d) == size).sum() + 1) / 2 for size in np.abs(d)])
        reached = ranks[d > 0.0].sum()
        sums = [ranks[np.array(signs)].sum() for signs in product([False, True], repeat=len(d))]
        assert signed_rank_probability(d) == pytest.approx(np.mean(np.array(sums) >= reached - 1e-9)), seed
    for n in (100, 101, 300):
        d = np.random.default_rng(n).normal(0.15, 1.0, n)
        exact = wilcoxon(d, alternative="greater", method="exact").pvalue
        assert signed_rank_probability(d) == pytest.approx(exact, rel=0.05)
    assert signed_rank_probability(np.zeros(20)) == 1.0


def judged(old: Array, new: Array, joints: Array | None = None) -> list[tuple[str, str]]:
    """Return what is said of errors along x [mm], one at each configuration."""
    n = len(old)
    data = Dataset.of(np.arange(n)[:, None] if joints is None else joints, np.zeros((n, 3)))
    before, after = (Errors(n, size[:, None] * np.array([1e-3, 0.0, 0.0]), None) for size in (old, new))
    return [(notice.code, notice.level) for notice in check_gain(before, after, data)]


def test_pairs_tell_gain_loss_and_neither() -> None:
    old = np.linspace(0.5, 1.5, 20)
    assert judged(old, 0.9 * old) == []  # of unpaired errors nothing could be told
    assert judged(old, old) == [("no-gain", "warning")]
    assert judged(old, 1.05 * old) == [("no-gain", "warning")]
    assert judged(old, 1.2 * old) == [("worse-than-nominal", "error")]
    mixed = old * np.where(np.arange(20) % 2 == 0, 0.8, 1.2)
    assert judged(old, mixed) == [("no-gain", "warning")]
    # a few wrong readings, which both miss, do not decide
    old, wrong = np.linspace(0.5, 1.5, 30), np.where(np.arange(30) < 2, 100.0, 0.0)
    assert judged(old + wrong, 0.8 * old + 1.01 * wrong) == []
    assert judged(old + wrong, 1.5 * old + 0.99 * wrong) == [("worse-than-nominal", "error")]


def test_nothing_is_claimed_of_few_pairs() -> None:
    for factor in (0.01, 100.0):
        assert judged(np.ones(6), np.full(6, factor)) == [("few-held-out", "note")]
    assert judged(np.ones(7), np.full(7, 0.01)) == []
    assert judged(np.ones(7), np.full(7, 100.0)) == [("worse-than-nominal", "error")]
    again = np.repeat(np.arange(6.0), 5)[:, None]  # visits of one posture share its errors
    assert judged(np.ones(30), np.full(30, 0.01), again) == [("few-held-out", "note")]


def test_a_robot_that_is_accurate_already_is_no_error() -> None:
    for seed in (5, 3):
        accurate = campaign("irb120", 40, 2e-5, seed, "nominal")[1]
        found = truearm.calibrate("irb120", accurate)
        assert [(n.code, n.level) for n in found.warnings] == [("no-gain", "warning")], seed
        assert (found.finished, found.faults) == (True, ("no-gain",)), seed
        assert truearm.calibrate("irb120", campaign("irb120", 40, 2e-5, seed)[1]).faults == (), seed
    # without a held-out part or another robot nothing is compared
    codes = {notice.code for notice in truearm.calibrate("irb120", accurate, train="all").warnings}
    assert codes == {"nothing-held-out"}
    assert truearm.calibrate("irb120", accurate, model="frames").warnings == ()


def test_no_gain_is_told_of_a_robot_that_was_calibrated_before() -> None:
    twin_data = campaign("irb120", 80, 2e-5, 3)[1]
    first, second = twin_data.of_configurations(np.arange(40)), twin_data.of_configurations(np.arange(40, 80))
    before = truearm.calibrate("irb120", first)
    assert before.faults == ()
    assert truearm.calibrate(before.robot, second).faults == ("no-gain",)
    assert truearm.calibrate("irb120", second).faults == ()
