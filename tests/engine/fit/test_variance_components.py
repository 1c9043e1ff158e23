"""Errors of joints that readings share, by closed forms, and fits in portions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import stdtrit
from tests.engine.fit.test_two_sockets import NOMINAL
from tests.engine.fit.test_two_sockets import campaign as two_sockets
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit import likelihood, problem
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.likelihood import Likelihood, Linearised, Moments, Visits, Whitening
from truearm.engine.fit.losses import Loss, pulls
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.fit.variance_components import Components, cluster_covariance, variance_components
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

VISITS, READINGS = 12, 5


def one_way(between: float, seed: int = 0) -> Array:
    """Return readings of one number ``(visits, readings)`` that share an error of one joint by visit."""
    rng = np.random.default_rng(seed)
    return between * rng.standard_normal((VISITS, 1)) + rng.standard_normal((VISITS, READINGS))


def components(readings: Array) -> Components:
    """Estimate the variances of readings around their mean, which is the one parameter and has no prior."""
    y = readings.reshape(-1)
    mean = np.full(len(y), y.mean())
    at = Linearised(
        residual=mean - y,
        by_parameters=np.ones((len(y), 1)),
        by_joints=np.ones((len(y), 1)),
        offset=np.zeros(1),
        priors=False,
        visits=Visits(np.repeat(np.arange(len(readings)), readings.shape[1])),
        factor=np.zeros(len(y), dtype=np.intp),
    )
    return variance_components(at, [True], np.array([1e-12]), [np.array([0])])


def mean_squares(readings: Array) -> tuple[float, float]:
    """Return the mean squares between and within visits of the analysis of variance."""
    means = readings.mean(axis=1)
    between = readings.shape[1] * float(np.var(means, ddof=1))
    return between, float(np.mean(np.var(readings, axis=1, ddof=1)))


def test_equal_visits_give_the_estimates_of_the_analysis_of_variance() -> None:
    readings = one_way(1.5)
    between, within = mean_squares(readings)
    result = components(readings)
    assert result.holds
    assert result.weighing.factors[0] == pytest.approx(within, rel=1e-3)
    assert result.weighing.joints[0] == pytest.approx((between - within) / READINGS, rel=1e-3)


def test_the_mean_of_visits_is_as_uncertain_as_student_says() -> None:
    readings = one_way(1.5)
    between, _ = mean_squares(readings)
    expected = np.sqrt(between / readings.size) * stdtrit(VISITS - 1, 0.975) / 1.959964
    assert np.sqrt(components(readings).worth[0][0, 0]) == pytest.approx(expected, rel=0.02)


def test_visits_that_share_nothing_have_no_error_of_the_joints() -> None:
    readings = one_way(0.0, 1)
    result = components(readings)
    assert result.likeliest.joints[0] == 0.0
    assert result.weighing.factors[0] == pytest.approx(np.var(readings, ddof=1), rel=1e-3)


def test_priors_are_integrated_out() -> None:
    """The likelihood is that of readings whose parameters come from their priors: its slope is zero at the estimate."""
    rng = np.random.default_rng(3)
    of_row = rng.integers(0, 20, 90)
    A, G = rng.standard_normal((90, 6)), rng.standard_normal((90, 3))
    z = A @ rng.standard_normal(6) + 0.8 * np.sum(G * rng.standard_normal((20, 3))[of_row], axis=1)
    z += np.where(np.arange(90) < 50, 1.0, 2.0) * rng.standard_normal(90)
    factor = (np.arange(90) >= 50).astype(np.intp)
    at = Linearised(-z, A, G, np.zeros(6), True, Visits(of_row), factor)
    estimate = variance_components(at, [True, True], np.full(2, 1e-9), [np.array([0, 1]), np.array([2])])

    def likelihood(values: Array) -> float:
        V = np.diag(values[factor]) + A @ A.T
        same = of_row[:, None] == of_row[None, :]
        V += same * ((G * np.array([values[2], values[2], values[3]])) @ G.T)
        return -0.5 * float(np.linalg.slogdet(V)[1] + z @ np.linalg.solve(V, z))

    best = np.array([*estimate.likeliest.factors, estimate.likeliest.joints[0], estimate.likeliest.joints[2]])
    assert np.all(best > 0.0)
    for place in range(4):
        for step in (0.93, 1.07):
            other = best.copy()
            other[place] *= step
            assert likelihood(other) < likelihood(best)
    V = np.diag(best[factor])
    of_joints = (of_row[:, None] == of_row[None, :]) * ((G[:, :2] * best[2]) @ G[:, :2].T)
    V += of_joints + (of_row[:, None] == of_row[None, :]) * (best[3] * np.outer(G[:, 2], G[:, 2]))
    C = np.linalg.inv(A.T @ np.linalg.solve(V, A) + np.eye(6))
    np.testing.assert_allclose(sum(part.covariance for part in estimate.worth[1]), C, rtol=1e-6)
    part = next(part for part in estimate.worth[1] if part.joints == (0, 1))
    pulled = np.linalg.solve(V, A @ C)
    np.testing.assert_allclose(part.covariance, pulled.T @ of_joints @ pulled, rtol=1e-6, atol=1e-9)
    assert part.freedom == estimate.likeliest.freedom[0] < 2 * len(set(of_row.tolist()))


def test_the_likelihood_is_right_where_joints_err_by_far_more_than_readings() -> None:
    """Readings of a visit in three coordinates then say nothing of six joints but in three directions."""
    rng = np.random.default_rng(5)
    A, G, z = rng.standard_normal((60, 4)), rng.standard_normal((60, 6)), rng.standard_normal(60)
    at = Linearised(-z, A, G, np.zeros(4), True, Visits(np.repeat(np.arange(20), 3)), np.zeros(60, dtype=np.intp))
    moments = Moments(at, 1)
    large, larger = (Likelihood(moments, np.ones(1), np.full(6, variance)) for variance in (1e6, 1e10))
    assert larger.likelihood - large.likelihood == pytest.approx(-0.5 * 20 * 3 * np.log(1e4), rel=1e-4)


def test_whitening_is_the_root_of_the_inverse() -> None:
    rng = np.random.default_rng(4)
    of_row = np.unique(rng.integers(0, 9, 40), return_inverse=True)[1]
    shared, rows = rng.standard_normal((40, 3)), rng.standard_normal((40, 4))
    V = np.eye(40) + (of_row[:, None] == of_row) * (shared @ shared.T)
    whitening = Whitening(Visits(of_row), shared)
    np.testing.assert_allclose(whitening.applied(whitening.applied(rows)), np.linalg.solve(V, rows), atol=1e-12)


def test_scatter_of_equal_visits_is_that_of_their_means() -> None:
    """Then the second estimator of Bell and McCaffrey is exact, with one degree of freedom less than visits."""
    readings = one_way(2.0, 5)
    y = readings.reshape(-1)
    rows = np.ones((len(y), 1))
    visits = Visits(np.repeat(np.arange(VISITS), READINGS))
    covariance, parts = cluster_covariance(
        lambda: [(slice(None), rows, (y - y.mean())[:, None])], visits, np.array([True]), np.zeros(1)
    )
    variance = np.var(readings.mean(axis=1), ddof=1) / VISITS
    assert covariance[0, 0] == pytest.approx(variance * (stdtrit(VISITS - 1, 0.975) / 1.959964) ** 2, rel=1e-6)
    assert parts[0].covariance[0, 0] == pytest.approx(variance, rel=1e-6)
    assert parts[0].freedom == pytest.approx(VISITS - 1, rel=1e-6)


def test_pulls_follow_the_parameters_as_their_root_says() -> None:
    rng = np.random.default_rng(6)
    components_of = np.full(200, 3)
    jacobian = rng.standard_normal((600, 2))
    residual = rng.standard_normal(600) * np.repeat(1.0 + 8.0 * (rng.random(200) < 0.1), 3)
    robust: tuple[Loss, ...] = ("huber", "cauchy", "l1")
    for loss in robust:
        _, root = pulls(loss, residual, jacobian, components_of)
        moved = []
        for way in 1e-4 * jacobian.T:
            after, before = (pulls(loss, r, jacobian, components_of)[0] for r in (residual + way, residual - way))
            moved.append((after - before).sum(axis=0) / 2e-4)
        size = np.abs(moved).max()
        np.testing.assert_allclose(root.T @ root, np.array(moved), rtol=0.05, atol=0.02 * size, err_msg=loss)


# -- derivatives in portions of whole configurations: results are those of one portion

MODEL = {model.name: model for model in MODELS}
IRB120 = load_robot("irb120")


def readings(configurations: int = 24) -> Dataset:
    """Return readings of three targets whose visits share errors of the joints."""
    rng = np.random.default_rng(5)
    twin = truth_twin(IRB120, "tracker-triangular", rng)
    q = IRB120.random_configurations(configurations, rng)
    read = measure(twin, q + 1e-4 * rng.standard_normal(q.shape), 3e-5, rng)
    return replace(read, joints=q, sigma=None)


def same_fit(first: Fit, other: Fit) -> None:
    assert first.status == other.status
    assert_allclose([*other.robot.values.values()], [*first.robot.values.values()], rtol=1e-9, atol=1e-12)
    size = np.sqrt(np.diag(first.covariance))
    assert_allclose(other.covariance, first.covariance, rtol=0.0, atol=1e-9 * np.outer(size, size).max())
    assert_allclose(other.joint_error, first.joint_error, rtol=1e-9)
    assert other.sigma == pytest.approx(first.sigma, rel=1e-9)


def test_a_fit_in_portions_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    data = readings()
    whole = {name: identify(IRB120, data, MODEL[name]) for name in ("geometric", "elastic")}
    monkeypatch.setattr(problem, "_AT_ONCE", 3000)
    for stored in (True, False):
        if not stored:
            monkeypatch.setattr(likelihood, "_MOST_STORED", 0)
            monkeypatch.setattr(likelihood, "_AT_ONCE", 1000)
        for name, value in whole.items():
            assert value.joint_error.any()
            same_fit(value, identify(IRB120, data, MODEL[name]))


def test_what_is_known_of_fixtures_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    data = two_sockets(2, 2e-5, 0.0, 60)[1]
    assert data.setup is not None
    other_fit = identify(NOMINAL, data, MODEL["geometric"])
    monkeypatch.setattr(problem, "_AT_ONCE", 2000)
    same_fit(other_fit, identify(NOMINAL, data, MODEL["geometric"]))


def test_portions_hold_every_equation_once(monkeypatch: pytest.MonkeyPatch) -> None:
    data = readings()
    drawn = data.of_readings(np.flatnonzero(np.random.default_rng(0).random(len(data.target)) < 0.7))
    robot = truth_twin(IRB120, "tracker-triangular", np.random.default_rng(5)).robot
    noise = {"position": 1e-4}
    whole = Problem(robot, drawn, MODEL["geometric"].free(robot), noise)
    evaluation = whole.at(whole.free.start)
    r, J, G = evaluation.residual, evaluation.jacobian, evaluation.by_joints
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
