"""Choice by exchange against trying every choice."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.exchange import most_telling


def told(rows: Array, chosen: list[int], known: Array, interest: int) -> float:
    """Return minus the logarithm of the determinant of the covariance of the parameters of interest."""
    J = rows[chosen].reshape(-1, rows.shape[2])
    covariance = np.linalg.inv(known + J.T @ J)
    return -float(np.linalg.slogdet(covariance[:interest, :interest])[1])


@pytest.mark.parametrize("interest", [4, 2])
@pytest.mark.parametrize("seed", range(5))
def test_hardly_any_choice_tells_more(interest: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, known = rng.normal(size=(12, 2, 4)), 0.01 * np.eye(4)
    chosen = most_telling(rows, 4, known, interest)
    every = np.array([told(rows, list(c), known, interest) for c in combinations(range(12), 4)])
    assert len(set(chosen)) == 4
    found = told(rows, chosen, known, interest)
    assert found > every.max() - 0.1
    assert np.mean(every > found) < 0.02


def test_a_line_is_measured_at_its_ends() -> None:
    x = np.linspace(-1.0, 1.0, 21)
    rows = np.stack([np.ones_like(x), x], axis=1)[:, None]
    assert set(most_telling(rows, 4, 1e-6 * np.eye(2), 2)) == {0, 1, 19, 20}


def test_what_only_a_nuisance_feels_is_left_out() -> None:
    rows = np.array([[[0.0, 100.0]], [[1.0, 0.0]]])
    assert most_telling(rows, 1, np.eye(2), 1) == [1]
    assert most_telling(rows, 1, np.eye(2), 2) == [0]


def test_more_than_there_are_is_refused() -> None:
    with pytest.raises(InputError, match="0 to 3"):
        most_telling(np.ones((3, 1, 1)), 4, np.eye(1), 1)
