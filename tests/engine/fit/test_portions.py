"""Large fits find their derivatives in portions of whole configurations: results are those of one portion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.fit.test_two_sockets import NOMINAL
from tests.engine.fit.test_two_sockets import campaign as two_sockets
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit import likelihood, problem
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

MODEL = {model.name: model for model in MODELS}
IRB120 = load_robot("irb120")


def readings(configurations: int = 24) -> Dataset:
    """Return readings of three targets whose arrivals share errors of the joints."""
    rng = np.random.default_rng(5)
    twin = truth_twin(IRB120, "tracker-triangular", rng)
    q = IRB120.random_configurations(configurations, rng)
    read = measure(twin, q + 1e-4 * rng.standard_normal(q.shape), 3e-5, rng)
    return replace(read, joints=q, sigma=None)


def same_fit(one: Fit, other: Fit) -> None:
    assert one.status == other.status
    assert_allclose([*other.robot.values.values()], [*one.robot.values.values()], rtol=1e-9, atol=1e-12)
    size = np.sqrt(np.diag(one.covariance))
    assert_allclose(other.covariance, one.covariance, rtol=0.0, atol=1e-9 * np.outer(size, size).max())
    assert_allclose(other.joint_error, one.joint_error, rtol=1e-9)
    assert other.sigma == pytest.approx(one.sigma, rel=1e-9)


@pytest.mark.parametrize("model", ["geometric", "elastic"])
@pytest.mark.parametrize("kept", [True, False])
def test_a_fit_in_portions_is_the_same(model: str, kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    data = readings()
    one = identify(IRB120, data, MODEL[model])
    assert one.joint_error.any()
    monkeypatch.setattr(problem, "_AT_ONCE", 3000)
    if not kept:
        monkeypatch.setattr(likelihood, "_KEPT", 0)
        monkeypatch.setattr(likelihood, "_AT_ONCE", 1000)
    same_fit(one, identify(IRB120, data, MODEL[model]))


def test_what_is_known_of_fixtures_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    data = two_sockets(2, 2e-5, 0.0, 60)[1]
    assert data.setup is not None
    one = identify(NOMINAL, data, MODEL["geometric"])
    monkeypatch.setattr(problem, "_AT_ONCE", 2000)
    same_fit(one, identify(NOMINAL, data, MODEL["geometric"]))


def test_portions_hold_every_equation_once(monkeypatch: pytest.MonkeyPatch) -> None:
    data = readings()
    drawn = data.of_readings(np.flatnonzero(np.random.default_rng(0).random(len(data.target)) < 0.7))
    robot = truth_twin(IRB120, "tracker-triangular", np.random.default_rng(5)).robot
    noise = {"position": 1e-4}
    whole = Problem(robot, drawn, MODEL["geometric"].free(robot), noise)
    here = whole.at(whole.free.start)
    r, J, G = here.residual, here.jacobian, here.by_joints
    monkeypatch.setattr(problem, "_AT_ONCE", 2000)
    parted = replace(whole).at(whole.free.start)
    parts = [*parted.portions()]
    assert len(parts) > 3
    assert sorted(np.concatenate([rows for rows, _ in parts]).tolist()) == list(range(whole.rows))
    for rows, part in parts:
        assert_allclose(part.jacobian, J[rows], rtol=1e-12, atol=1e-9)
    assert_allclose(parted.residual, r, rtol=1e-12)
    assert_allclose(parted.by_joints, G, rtol=1e-12, atol=1e-9)
    assert_allclose(parted.triangle.T @ parted.triangle, J.T @ J, rtol=1e-9, atol=1e-3)


def test_a_step_that_is_left_out_would_have_moved_nothing() -> None:
    twin, data = campaign("irb120", 24, 3e-5, 1, "tracker-triangular")
    robot = twin.robot
    problem_ = Problem(robot, data, MODEL["geometric"].free(robot), {"position": 3e-5})
    quick, far = solve(problem_), solve(problem_, small=1e-12)
    assert quick.converged
    assert quick.steps < far.steps
    assert np.abs((quick.vector - far.vector) / problem_.free.prior).max() < 1e-7
