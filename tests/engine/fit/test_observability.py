"""The indices against closed forms and against singular values."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.fit.design import INDICES, Objective, OfInterest, OfPredictions, observability


def test_an_orthogonal_jacobian_in_closed_form() -> None:
    rng = np.random.default_rng(0)
    Q = np.linalg.qr(rng.normal(size=(12, 3)))[0]
    J = Q * [1.0, 2.0, 4.0] @ np.linalg.qr(rng.normal(size=(3, 3)))[0]  # singular values 4, 2, 1
    found = observability(J.T @ J, 4)
    assert found == pytest.approx({"O1": 2.0 / 2.0, "O2": 0.25, "O3": 1.0, "O4": 0.25, "O5": 4.0 / 7.0})


@pytest.mark.parametrize("seed", range(5))
def test_the_definitions_by_singular_values(seed: int) -> None:
    J = np.random.default_rng(seed).normal(size=(30, 6)) * [1, 2, 3, 0.1, 5, 1]
    s = np.linalg.svd(J, compute_uv=False)
    assert observability(J.T @ J, 10) == pytest.approx(
        {
            "O1": np.prod(s) ** (1 / 6) / np.sqrt(10),
            "O2": s[-1] / s[0],
            "O3": s[-1],
            "O4": s[-1] ** 2 / s[0],
            "O5": 1 / np.sum(1 / s),
        }
    )


def test_twice_the_data_change_the_indices_as_they_should() -> None:
    J = np.random.default_rng(1).normal(size=(30, 6))
    once, twice = observability(J.T @ J, 10), observability(2 * J.T @ J, 20)
    ratio = {name: twice[name] / once[name] for name in once}
    root = np.sqrt(2)
    assert ratio == pytest.approx({"O1": 1.0, "O2": 1.0, "O3": root, "O4": root, "O5": root})


def predictions() -> OfPredictions:
    return OfPredictions.of(np.random.default_rng(4).normal(size=(5, 3, 4)))


def test_the_error_of_predictions_in_closed_form() -> None:
    rows = np.array([[[1.0, 0.0]], [[0.0, 3.0]]])  # of one parameter, and of three times the other
    information = np.diag([4.0, 9.0])
    mean_square = (1.0 / 4.0 + 9.0 / 9.0) / 2.0
    assert np.exp(OfPredictions.of(rows).value(information)) == pytest.approx(mean_square**-0.5)


@pytest.mark.parametrize("objective", [*INDICES.values(), OfInterest(2), predictions()], ids=lambda o: type(o).__name__)
def test_slopes_against_differences(objective: Objective) -> None:
    rng = np.random.default_rng(2)
    A = rng.normal(size=(9, 4))
    M, step = A.T @ A + np.diag([1.0, 2.0, 3.0, 4.0]), 1e-6
    slope = objective.slope(M)
    for _ in range(5):
        B = rng.normal(size=(4, 4))
        way = B + B.T
        difference = (objective.value(M + step * way) - objective.value(M - step * way)) / (2 * step)
        assert np.sum(slope * way) == pytest.approx(float(difference), rel=1e-6)


def test_many_at_once_as_one_by_one() -> None:
    A = np.random.default_rng(3).normal(size=(7, 9, 4))
    M = A.swapaxes(1, 2) @ A
    for objective in (*INDICES.values(), OfInterest(2), predictions()):
        assert objective.value(M) == pytest.approx([float(objective.value(one)) for one in M])
        assert objective.slope(M) == pytest.approx(np.array([objective.slope(one) for one in M]))


def test_what_is_not_seen_at_all_makes_the_indices_zero() -> None:
    found = observability(np.diag([1.0, 0.0]), 1)
    assert found["O3"] < 1e-100
    assert found["O5"] < 1e-100
