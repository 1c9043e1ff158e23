from __future__ import annotations

import numpy as np
import pytest
from scipy.special import stdtrit

from truearm.engine.fit.likelihood import Arrivals, Likelihood, Linearised, Moments, Whitening
from truearm.engine.fit.losses import Loss, pulls
from truearm.engine.fit.variance_components import Components, cluster_covariance, variance_components
from truearm.engine.robot.chain import Array

ARRIVALS, READINGS = 12, 5


def one_way(between: float, seed: int = 0) -> Array:
    """Return readings of one number ``(arrivals, readings)`` that share an error of one joint by arrival."""
    rng = np.random.default_rng(seed)
    return between * rng.standard_normal((ARRIVALS, 1)) + rng.standard_normal((ARRIVALS, READINGS))


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
        arrivals=Arrivals(np.repeat(np.arange(len(readings)), readings.shape[1])),
        factor=np.zeros(len(y), dtype=np.intp),
    )
    return variance_components(at, [True], np.array([1e-12]), [np.array([0])])


def mean_squares(readings: Array) -> tuple[float, float]:
    """Return the mean squares between and within arrivals of the analysis of variance."""
    means = readings.mean(axis=1)
    between = readings.shape[1] * float(np.var(means, ddof=1))
    return between, float(np.mean(np.var(readings, axis=1, ddof=1)))


def test_equal_arrivals_give_the_estimates_of_the_analysis_of_variance() -> None:
    readings = one_way(1.5)
    between, within = mean_squares(readings)
    found = components(readings)
    assert found.holds
    assert found.weighing.factors[0] == pytest.approx(within, rel=1e-3)
    assert found.weighing.joints[0] == pytest.approx((between - within) / READINGS, rel=1e-3)


def test_the_mean_of_arrivals_is_as_uncertain_as_student_says() -> None:
    readings = one_way(1.5)
    between, _ = mean_squares(readings)
    expected = np.sqrt(between / readings.size) * stdtrit(ARRIVALS - 1, 0.975) / 1.959964
    assert np.sqrt(components(readings).covariance[0, 0]) == pytest.approx(expected, rel=0.02)


def test_arrivals_that_share_nothing_have_no_error_of_the_joints() -> None:
    readings = one_way(0.0, 1)
    found = components(readings)
    assert found.likeliest.joints[0] == 0.0
    assert found.weighing.factors[0] == pytest.approx(np.var(readings, ddof=1), rel=1e-3)


def test_priors_are_integrated_out() -> None:
    """The likelihood is that of readings whose parameters come from their priors: its slope is zero at the estimate."""
    rng = np.random.default_rng(3)
    of_row = rng.integers(0, 20, 90)
    A, G = rng.standard_normal((90, 6)), rng.standard_normal((90, 3))
    z = A @ rng.standard_normal(6) + 0.8 * np.sum(G * rng.standard_normal((20, 3))[of_row], axis=1)
    z += np.where(np.arange(90) < 50, 1.0, 2.0) * rng.standard_normal(90)
    factor = (np.arange(90) >= 50).astype(np.intp)
    at = Linearised(-z, A, G, np.zeros(6), True, Arrivals(of_row), factor)
    found = variance_components(at, [True, True], np.full(2, 1e-9), [np.array([0, 1]), np.array([2])])

    def likelihood(values: Array) -> float:
        V = np.diag(values[factor]) + A @ A.T
        same = of_row[:, None] == of_row[None, :]
        V += same * ((G * np.array([values[2], values[2], values[3]])) @ G.T)
        return -0.5 * float(np.linalg.slogdet(V)[1] + z @ np.linalg.solve(V, z))

    best = np.array([*found.likeliest.factors, found.likeliest.joints[0], found.likeliest.joints[2]])
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
    np.testing.assert_allclose(sum(part.covariance for part in found.parts), C, rtol=1e-6)
    part = next(part for part in found.parts if part.joints == (0, 1))
    pulled = np.linalg.solve(V, A @ C)
    np.testing.assert_allclose(part.covariance, pulled.T @ of_joints @ pulled, rtol=1e-6, atol=1e-9)
    assert part.freedom == found.likeliest.freedom[0] < 2 * len(set(of_row.tolist()))


def test_the_likelihood_is_right_where_joints_err_by_far_more_than_readings() -> None:
    """Readings of an arrival in three coordinates then say nothing of six joints but in three directions."""
    rng = np.random.default_rng(5)
    A, G, z = rng.standard_normal((60, 4)), rng.standard_normal((60, 6)), rng.standard_normal(60)
    at = Linearised(-z, A, G, np.zeros(4), True, Arrivals(np.repeat(np.arange(20), 3)), np.zeros(60, dtype=np.intp))
    moments = Moments(at, 1)
    large, larger = (Likelihood(moments, np.ones(1), np.full(6, variance)) for variance in (1e6, 1e10))
    assert larger.likelihood - large.likelihood == pytest.approx(-0.5 * 20 * 3 * np.log(1e4), rel=1e-4)


def test_whitening_is_the_root_of_the_inverse() -> None:
    rng = np.random.default_rng(4)
    of_row = np.unique(rng.integers(0, 9, 40), return_inverse=True)[1]
    shared, rows = rng.standard_normal((40, 3)), rng.standard_normal((40, 4))
    V = np.eye(40) + (of_row[:, None] == of_row) * (shared @ shared.T)
    whitening = Whitening(Arrivals(of_row), shared)
    np.testing.assert_allclose(whitening.applied(whitening.applied(rows)), np.linalg.solve(V, rows), atol=1e-12)


def test_scatter_of_equal_arrivals_is_that_of_their_means() -> None:
    """Then the second estimator of Bell and McCaffrey is exact, with one degree of freedom less than arrivals."""
    readings = one_way(2.0, 5)
    y = readings.reshape(-1)
    rows = np.ones((len(y), 1))
    arrivals = Arrivals(np.repeat(np.arange(ARRIVALS), READINGS))
    covariance, parts = cluster_covariance(
        lambda: [(slice(None), rows, (y - y.mean())[:, None])], arrivals, np.array([True]), np.zeros(1)
    )
    variance = np.var(readings.mean(axis=1), ddof=1) / ARRIVALS
    assert covariance[0, 0] == pytest.approx(variance * (stdtrit(ARRIVALS - 1, 0.975) / 1.959964) ** 2, rel=1e-6)
    assert parts[0].covariance[0, 0] == pytest.approx(variance, rel=1e-6)
    assert parts[0].freedom == pytest.approx(ARRIVALS - 1, rel=1e-6)


@pytest.mark.parametrize("loss", ["huber", "cauchy", "l1"])
def test_pulls_follow_the_parameters_as_their_root_says(loss: Loss) -> None:
    rng = np.random.default_rng(6)
    components_of = np.full(200, 3)
    jacobian = rng.standard_normal((600, 2))
    residual = rng.standard_normal(600) * np.repeat(1.0 + 8.0 * (rng.random(200) < 0.1), 3)
    _, root = pulls(loss, residual, jacobian, components_of)
    step = 1e-4
    moved = []
    for k in range(2):
        after, before = (
            pulls(loss, residual + side * step * jacobian[:, k], jacobian, components_of)[0].sum(axis=0)
            for side in (1, -1)
        )
        moved.append((after - before) / (2 * step))
    np.testing.assert_allclose(root.T @ root, np.array(moved), rtol=0.05, atol=0.02 * np.abs(moved).max())
