"""Losses on readings of one number and of three, lengths caught by mistake, and the sum of absolute components."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.losses import Loss, norms_of, robust_scale, weights
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import least_absolute, solve
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

GEOMETRIC = {m.name: m for m in MODELS}["geometric"]
ROBUST: tuple[Loss, ...] = ("huber", "cauchy", "l1")


def test_norms_are_of_whole_readings() -> None:
    residual = np.array([3.0, 4.0, 0.0, -2.0, 1.0, 2.0, 2.0, 0.5])
    norms = norms_of(residual, np.array([3, 1, 3, 1]))
    # the 95th percentile of the norm of three normal components is 2.7955, of one 1.96
    assert norms == pytest.approx([5.0, 2.0 * 2.7955 / 1.96, 3.0, 0.5 * 2.7955 / 1.96])


def test_the_deviation_of_a_coordinate_is_found_from_readings_of_either_kind_and_of_both() -> None:
    rng = np.random.default_rng(0)
    residual = 0.7 * rng.standard_normal(30_000)
    for components in (1, 3):
        every = np.full(30_000 // components, components)
        norms = norms_of(residual, every)
        assert robust_scale(norms, every) == pytest.approx(0.7, rel=0.02), components
        assert np.quantile(norms, 0.95) == pytest.approx(0.7 * 2.7955, rel=0.02), components
    both = np.tile([1, 3], 7500)
    assert robust_scale(norms_of(residual, both), both) == pytest.approx(0.7, rel=0.02)


def test_the_further_off_the_less_it_counts() -> None:
    for loss in ROBUST:
        values = weights(loss, np.array([0.1, 1.0, 3.0, 10.0, 100.0]), 1.0)
        assert (np.diff(values) <= 0.0).all(), loss
        assert values[-1] < 0.05 * values[0], loss


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


@pytest.mark.parametrize("loss", ROBUST)
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


# -- the sum of absolute components


def arm() -> Robot:
    return load_robot("li3").with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.0)})


def problem_of(robot: Robot, data: Dataset, *names: str) -> Problem:
    free = FreeParameters(tuple(robot.parameters[name] for name in names))
    return Problem(robot, data, free, {"position": 1e-3}, priors=False)


def read(robot: Robot, count: int, seed: int) -> Dataset:
    rng = np.random.default_rng(seed)
    return measure(Twin(robot), robot.random_configurations(count, rng), 0.0, rng)


def test_a_shift_is_the_median_of_every_coordinate() -> None:
    rng = np.random.default_rng(0)
    data = read(arm(), 15, 0)
    scatter = rng.standard_normal(data.position.shape) ** 3 * 1e-3
    shifted = replace(data, position=data.position + scatter)
    problem = problem_of(arm(), shifted, "base_x", "base_y", "base_z")
    np.testing.assert_allclose(least_absolute(problem)[0].vector, np.median(scatter, axis=0), atol=1e-12)
    assert np.abs(solve(problem, "l1").vector - np.median(scatter, axis=0)).max() > 1e-5  # distances: another answer


def test_a_bound_holds_where_the_median_is_beyond_it() -> None:
    data = read(arm(), 9, 1)
    shifted = replace(data, position=data.position + np.array([3e-3, -1e-3, 0.5e-3]))
    problem = problem_of(arm(), shifted, "base_x", "base_y", "base_z")
    limits = (np.full(3, -2e-3), np.full(3, 2e-3))
    np.testing.assert_allclose(least_absolute(problem, limits)[0].vector, [2e-3, -1e-3, 0.5e-3], atol=1e-12)


def test_true_parameters_come_back_though_a_quarter_of_the_readings_is_mistaken() -> None:
    names = ("theta_offset_1", "alpha_1", "theta_offset_2", "a_2", "theta_offset_3", "a_3")
    rng = np.random.default_rng(2)
    truth = {n: arm().values[n] + (0.05 if "theta" in n or "alpha" in n else 0.01) * rng.uniform(-1, 1) for n in names}
    data = read(arm().with_values(truth), 24, 3)
    position = data.position.copy()
    position[::4] += rng.normal(0.0, 0.05, position[::4].shape)
    problem = problem_of(arm(), replace(data, position=position), *names)
    nominal = problem.free.nominal
    for limits in (None, (nominal - 0.1, nominal + 0.1)):
        np.testing.assert_allclose(least_absolute(problem, limits)[0].vector, list(truth.values()), atol=1e-9)
    assert math.dist(solve(problem).vector, list(truth.values())) > 1e-3


def test_each_sum_is_least_for_its_own_fit() -> None:
    names = ("theta_offset_1", "theta_offset_2", "a_2", "theta_offset_3", "a_3")
    data = read(arm(), 12, 4)
    noisy = replace(data, position=data.position + np.random.default_rng(4).normal(0.0, 5e-3, data.position.shape))
    problem = problem_of(arm(), noisy, *names)
    limits = (problem.free.nominal - 2e-3, problem.free.nominal + 2e-3)
    by_components, by_distances = least_absolute(problem, limits)[0].vector, solve(problem, "l1", limits).vector
    residuals = [problem.residual(x).reshape(-1, 3) for x in (by_components, by_distances)]
    components = [np.abs(r).sum() for r in residuals]
    distances = [np.linalg.norm(r, axis=1).sum() for r in residuals]
    assert components[0] < components[1]
    assert distances[1] < distances[0]
    assert (np.abs(by_components - problem.free.nominal) <= 2e-3 * (1 + 1e-12)).all()
