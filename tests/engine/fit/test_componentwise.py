"""The sum of absolute components: medians where they are the answer, exact against mistakes, inside its bounds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import least_absolute, solve
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin, measure


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


@pytest.mark.parametrize("bounded", [False, True])
def test_true_parameters_come_back_though_a_quarter_of_the_readings_is_mistaken(bounded: bool) -> None:
    names = ("theta_offset_1", "alpha_1", "theta_offset_2", "a_2", "theta_offset_3", "a_3")
    rng = np.random.default_rng(2)
    truth = {n: arm().values[n] + (0.05 if "theta" in n or "alpha" in n else 0.01) * rng.uniform(-1, 1) for n in names}
    data = read(arm().with_values(truth), 24, 3)
    position = data.position.copy()
    position[::4] += rng.normal(0.0, 0.05, position[::4].shape)
    problem = problem_of(arm(), replace(data, position=position), *names)
    nominal = problem.free.nominal
    limits = (nominal - 0.1, nominal + 0.1) if bounded else None
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
