"""Choice by exchange against trying every choice, and the indices against closed forms and singular values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
import pytest
from tests.expecting import refusing

from truearm.engine.fit.design import (
    INDICES,
    O1,
    Candidates,
    Objective,
    OfInterest,
    OfPredictions,
    exchanged,
    most_informative,
    most_informative_number,
    observability,
)
from truearm.engine.robot.chain import Array


def information_of(rows: Array, chosen: list[int], known: Array, interest: int) -> float:
    """Return minus the logarithm of the determinant of the covariance of the parameters of interest."""
    J = rows[chosen].reshape(-1, rows.shape[2])
    covariance = np.linalg.inv(known + J.T @ J)
    return -float(np.linalg.slogdet(covariance[:interest, :interest])[1])


def total_of(rows: Array, chosen: Iterable[int]) -> Array:
    J = rows[list(chosen)].reshape(-1, rows.shape[2])
    return np.asarray(J.T @ J)


def test_hardly_any_choice_tells_more() -> None:
    for interest in (4, 2):
        for seed in range(5):
            rng = np.random.default_rng(seed)
            rows, known = rng.normal(size=(12, 2, 4)), 0.01 * np.eye(4)
            chosen = most_informative(rows, 4, known, OfInterest(interest))
            every = np.array([information_of(rows, list(c), known, interest) for c in combinations(range(12), 4)])
            assert len(set(chosen)) == 4
            result = information_of(rows, chosen, known, interest)
            assert result > every.max() - 0.1, (interest, seed)
            assert np.mean(every > result) < 0.02, (interest, seed)


@pytest.mark.parametrize("name", INDICES)
def test_every_index_comes_near_to_the_best_choice(name: str) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        rows, known = rng.normal(size=(12, 2, 4)), 1e-6 * np.eye(4)
        value = INDICES[name].value
        every = np.array([value(known + total_of(rows, c)) for c in combinations(range(12), 5)])
        chosen = most_informative(rows, 5, known, INDICES[name])
        assert len(set(chosen)) == 5
        result = value(known + total_of(rows, chosen))
        # The condition number is neither concave nor smooth: exchanges of one get stuck sooner.
        assert np.mean(every > result + 1e-12) < (0.2 if name == "O2" else 0.02), seed


def test_with_all_pairs_exchanged_the_choice_is_often_the_best() -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rows, known = rng.normal(size=(9, 3, 3)), 1e-6 * np.eye(3)
        every = [float(O1().value(known + total_of(rows, c))) for c in combinations(range(9), 3)]
        result = float(O1().value(known + total_of(rows, most_informative(rows, 3, known, O1()))))
        assert result == pytest.approx(max(every), abs=1e-9) or sum(v > result for v in every) <= 2, seed


@pytest.mark.parametrize("name", INDICES)
def test_no_single_exchange_and_no_random_choice_is_better(name: str) -> None:
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(120, 3, 6)) * rng.uniform(0.2, 2.0, size=(120, 1, 6))
    known, value = 1e-6 * np.eye(6), INDICES[name].value
    chosen = most_informative(rows, 10, known, INDICES[name])
    best = value(known + total_of(rows, chosen))
    by_chance = [value(known + total_of(rows, rng.permutation(120)[:10])) for _ in range(200)]
    assert best > max(by_chance)
    if name == "O1":  # of the others, some exchange outside the promising ones may gain a little
        for place in range(10):
            remaining = chosen[:place] + chosen[place + 1 :]
            others = [value(known + total_of(rows, [*remaining, new])) for new in range(120) if new not in remaining]
            assert max(others) <= best + 1e-9


def test_an_exchange_never_lowers_the_objective() -> None:
    rng = np.random.default_rng(2)
    rows, known = rng.normal(size=(80, 2, 5)), 1e-3 * np.eye(5)
    candidates = Candidates.of(rows, known, 8)
    for index in INDICES.values():
        for _ in range(20):
            start = rng.permutation(80)[:8].tolist()
            end = exchanged(candidates, start, index)
            assert index.value(candidates.total(end)) >= index.value(candidates.total(start))


def test_the_promise_is_the_first_order_of_what_is_added() -> None:
    rng = np.random.default_rng(3)
    rows, known = rng.normal(size=(6, 2, 4)), 0.1 * np.eye(4)
    candidates, total = Candidates.of(rows, known, 4), known + total_of(rows, range(6))
    for index in (*INDICES.values(), OfInterest(2)):
        step = 1e-6
        each = step * rows.swapaxes(1, 2) @ rows
        added = [index.value(total + each_row) - index.value(total - each_row) for each_row in each]
        promised = candidates.promise(index.slope(total))
        assert promised == pytest.approx(np.array(added) / (2 * step), rel=1e-3, abs=1e-6)


def test_the_number_is_chosen_so_that_one_more_or_less_is_worse() -> None:
    rng = np.random.default_rng(4)
    rows, known = rng.normal(size=(60, 2, 6)), 1e-6 * np.eye(6)
    chosen = most_informative_number(rows, known)

    def index(choice: Sequence[int]) -> float:
        return observability(known + total_of(rows, choice), len(choice))["O1"]

    assert len(set(chosen)) == len(chosen)
    more = [index([*chosen, new]) for new in range(60) if new not in chosen]
    less = [index(chosen[:place] + chosen[place + 1 :]) for place in range(len(chosen))]
    assert index(chosen) >= max(*more, *less) - 1e-9
    assert index(chosen) >= index(most_informative(rows, 11, known, O1()))


def test_a_line_is_measured_at_its_ends() -> None:
    x = np.linspace(-1.0, 1.0, 21)
    rows = np.stack([np.ones_like(x), x], axis=1)[:, None]
    assert set(most_informative(rows, 4, 1e-6 * np.eye(2), O1())) == {0, 1, 19, 20}


def test_what_only_a_nuisance_feels_is_left_out() -> None:
    rows = np.array([[[0.0, 100.0]], [[1.0, 0.0]]])
    assert most_informative(rows, 1, np.eye(2), OfInterest(1)) == [1]
    assert most_informative(rows, 1, np.eye(2), OfInterest(2)) == [0]


def test_more_than_there_are_is_refused() -> None:
    with refusing("0 to 3"):
        most_informative(np.ones((3, 1, 1)), 4, np.eye(1), O1())
    with refusing("0 to 10"):
        most_informative_number(np.ones((10, 1, 1)), np.eye(1))


# -- the indices


def test_an_orthogonal_jacobian_in_closed_form() -> None:
    rng = np.random.default_rng(0)
    Q = np.linalg.qr(rng.normal(size=(12, 3)))[0]
    J = Q * [1.0, 2.0, 4.0] @ np.linalg.qr(rng.normal(size=(3, 3)))[0]  # singular values 4, 2, 1
    result = observability(J.T @ J, 4)
    assert result == pytest.approx({"O1": 2.0 / 2.0, "O2": 0.25, "O3": 1.0, "O4": 0.25, "O5": 4.0 / 7.0})
    blind = observability(np.diag([1.0, 0.0]), 1)
    assert max(blind["O3"], blind["O5"]) < 1e-100


def test_the_definitions_by_singular_values() -> None:
    for seed in range(5):
        J = np.random.default_rng(seed).normal(size=(30, 6)) * [1, 2, 3, 0.1, 5, 1]
        s = np.linalg.svd(J, compute_uv=False)
        volume, harmonic = np.prod(s) ** (1 / 6) / np.sqrt(10), 1 / np.sum(1 / s)
        expected = {"O1": volume, "O2": s[-1] / s[0], "O3": s[-1], "O4": s[-1] ** 2 / s[0], "O5": harmonic}
        assert observability(J.T @ J, 10) == pytest.approx(expected), seed


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
        assert objective.value(M) == pytest.approx([float(objective.value(matrix)) for matrix in M])
        assert objective.slope(M) == pytest.approx(np.array([objective.slope(matrix) for matrix in M]))
