from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.fleets.series import MonteCarlo, monte_carlo

BY_NAME = {m.name: m for m in MODELS}
SIGMA = 0.05e-3


def at_station() -> Robot:
    return truth_twin(load_robot("irb120"), "nominal", np.random.default_rng(0)).robot


@cache
def simulated(model: str, trials: int) -> MonteCarlo:
    robot = at_station()
    rng = np.random.default_rng(2024)
    q, held_out = robot.random_configurations(50, rng), robot.random_configurations(20, rng)
    return monte_carlo(robot, q, BY_NAME[model], SIGMA, trials, rng, held_out)


def test_intervals_contain_the_truth_as_often_as_they_say() -> None:
    for model in ("offsets", "geometric"):
        trials = simulated(model, 1000)
        assert trials.converged.all(), model
        joints = [p.group not in ("base", "target") for p in trials.problem.free.parameters]
        informed = (trials.informed > 0.5)[:, joints]
        inside = np.abs(trials.estimate - trials.truth) < 1.959964 * trials.deviation
        assert informed.sum() >= 4000, model
        assert 0.93 <= inside[:, joints][informed].mean() <= 0.97, model


def test_trials_together_are_what_the_solver_finds_alone() -> None:
    for model, trial in product(("offsets", "joints", "geometric"), range(5)):
        together = simulated(model, 5)
        alone = solve(replace(together.problem, data=together.dataset(trial)))
        assert alone.converged, (model, trial)
        np.testing.assert_allclose(together.estimate[trial], alone.vector, rtol=0, atol=1e-9, err_msg=model)


def test_trials_together_are_calibrations_of_their_datasets() -> None:
    """The base and the targets have another nominal place there, so predictions are compared, not what is shared."""
    together = simulated("geometric", 5)
    robot, names = at_station(), together.problem.free.names
    q = robot.random_configurations(20, np.random.default_rng(1))
    for trial in range(5):
        fit = identify(load_robot("irb120"), together.dataset(trial), BY_NAME["geometric"])
        estimated = robot.with_values(dict(zip(names, together.estimate[trial], strict=True)))
        for target in robot.targets:
            np.testing.assert_allclose(
                estimated.world_poses(q, target.name)[0], fit.robot.world_poses(q, target.name)[0], rtol=0, atol=1e-9
            )
        for i, name in enumerate(names):
            alone = fit.robot.parameters[name]
            if alone.group in ("joint zero", "geometry"):
                assert together.estimate[trial, i] == pytest.approx(alone.value, abs=1e-7), name
                assert together.deviation[trial, i] * fit.excess == pytest.approx(alone.deviation, rel=1e-4), name


def test_readings_and_position_errors_are_those_of_the_twin() -> None:
    trials = simulated("geometric", 3)
    names = trials.problem.free.names
    robot = at_station()
    rng = np.random.default_rng(2024)
    q, held_out = robot.random_configurations(50, rng), robot.random_configurations(20, rng)
    for trial in range(3):
        twin = Twin(robot.with_values(dict(zip(names, trials.truth[trial], strict=True))))
        seen = trials.dataset(trial).position.reshape(3, 50, 3)
        noise = seen - np.moveaxis(measure(twin, q, 0.0, rng).position.reshape(50, 3, 3), 1, 0)
        assert np.sqrt(np.mean(noise**2)) == pytest.approx(SIGMA, rel=0.1)
        estimated = robot.with_values(dict(zip(names, trials.estimate[trial], strict=True)))
        norms = errors_of(estimated, measure(twin, held_out, 0.0, rng)).position_norms
        np.testing.assert_allclose(trials.position_error[trial], norms.reshape(20, 3).T, rtol=0, atol=1e-12)


def test_a_problem_at_many_vectors_is_the_problem_at_each() -> None:
    rng = np.random.default_rng(5)
    frame = Transform((0.1, 0.02, 0.15), (0.6, 0.0, 0.8, 0.0))
    robot = (
        BY_NAME["joints"].prepared(load_robot("irb120")).with_frames(Transform(), {"1": frame, "2": (0.1, 0.1, 0.1)})
    )
    quaternion = np.stack([rng.normal(size=(7, 4)), np.full((7, 4), np.nan)], axis=1)
    quaternion /= np.linalg.norm(quaternion, axis=2, keepdims=True)
    joints, seen = robot.random_configurations(7, rng), rng.normal(size=(7, 2, 3))
    data = Dataset.of(joints, seen, quaternions=quaternion).of_readings(rng.permutation(14))
    problem = Problem(robot, data, BY_NAME["joints"].free(robot), {"position": 1e-4, "orientation": 1e-4})
    vectors = problem.free.start + 1e-2 * rng.normal(size=(4, len(problem.free.names)))
    together = problem.at(vectors)
    for trial, vector in enumerate(vectors):
        r, J = problem.linearised(vector)
        np.testing.assert_allclose(together.residual[trial], r, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(together.jacobian[trial], J, rtol=1e-12, atol=1e-9)
