"""Losses on readings of one number and of three together, and what they do to lengths caught by mistake."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.losses import Loss, norms_of, robust_scale, weights
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin

GEOMETRIC = {m.name: m for m in MODELS}["geometric"]


def test_norms_are_of_whole_readings() -> None:
    residual = np.array([3.0, 4.0, 0.0, -2.0, 1.0, 2.0, 2.0, 0.5])
    norms = norms_of(residual, np.array([3, 1, 3, 1]))
    # the 95th percentile of the norm of three normal components is 2.7955, of one 1.96
    assert norms == pytest.approx([5.0, 2.0 * 2.7955 / 1.96, 3.0, 0.5 * 2.7955 / 1.96])


@pytest.mark.parametrize("components", [1, 3])
def test_the_deviation_of_a_coordinate_is_found_from_readings_of_either_kind(components: int) -> None:
    rng = np.random.default_rng(0)
    residual = 0.7 * rng.standard_normal(30_000)
    every = np.full(30_000 // components, components)
    norms = norms_of(residual, every)
    assert robust_scale(norms, every) == pytest.approx(0.7, rel=0.02)
    assert np.quantile(norms, 0.95) == pytest.approx(0.7 * 2.7955, rel=0.02)


def test_the_deviation_is_found_from_both_kinds_together() -> None:
    components = np.tile([1, 3], 10_000)
    residual = np.random.default_rng(1).standard_normal(int(components.sum()))
    assert robust_scale(norms_of(residual, components), components) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("loss", ["huber", "cauchy", "l1"])
def test_the_further_off_the_less_it_counts(loss: Loss) -> None:
    norms = np.array([0.1, 1.0, 3.0, 10.0, 100.0])
    found = weights(loss, norms, 1.0)
    assert (np.diff(found) <= 0.0).all()
    assert found[-1] < 0.05 * found[0]


@cache
def lengths_of(device: str) -> tuple[Dataset, IntArray, Fit, Fit]:
    """Return lengths that a device read, some caught by mistake, which, and plain fits without and with these."""
    rng, nominal = np.random.default_rng(7), load_robot("irb120")
    twin = truth_twin(nominal, "random", rng)
    data = measured_with(named_device(device), nominal, twin, 100 if device == "ballbar" else 25, rng, 1e-5)
    assert data.distance is not None
    wrong = np.arange(0, 100, 12)
    lengths = data.distance.copy()
    lengths[wrong] += 2e-3 * np.where(np.arange(len(wrong)) % 2, 1.0, -1.0)
    caught = replace(data, distance=lengths)
    return caught, wrong, identify(nominal, data, GEOMETRIC), identify(nominal, caught, GEOMETRIC)


@pytest.mark.parametrize("loss", ["huber", "cauchy", "l1"])
@pytest.mark.parametrize("device", ["ballbar", "strings"])
def test_lengths_caught_by_mistake_are_found(device: str, loss: Loss) -> None:
    data, wrong, clean, plain = lengths_of(device)
    robust = identify(load_robot("irb120"), data, GEOMETRIC, loss=loss)
    assert robust.status is Status.CONVERGED
    right = np.setdiff1d(np.arange(100), wrong)
    assert robust.weight[wrong].max() < 0.1
    assert np.median(robust.weight[right]) > 0.5
    q = load_robot("irb120").random_configurations(50, np.random.default_rng(8))
    by_clean, by_robust, by_plain = (fit.robot.world_poses(q)[0] for fit in (clean, robust, plain))
    assert np.abs(by_robust - by_clean).mean() < 0.3 * np.abs(by_plain - by_clean).mean()
