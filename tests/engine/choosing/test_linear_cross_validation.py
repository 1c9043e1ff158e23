"""Held-out residuals in closed form, held against explicit fits without each fold."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.choosing.cross_validation import Extensions, LinearFit
from truearm.engine.robot.chain import Array

ROWS, COLUMNS, MORE, FOLDS = 60, 8, 5, 5


class Made:
    """A linear problem whose columns are of very different sizes, as those of a robot are."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.columns = rng.normal(size=(ROWS, COLUMNS)) * 10.0 ** rng.uniform(-1.0, 4.0, COLUMNS)
        self.more = 30.0 * rng.normal(size=(ROWS, MORE))
        self.elsewhere = np.where(np.arange(MORE) == 1, 0.3, self.more)
        self.residual = 5.0 * rng.normal(size=ROWS)
        self.offset = rng.normal(size=COLUMNS)
        self.penalty = rng.uniform(0.5, 2.0, COLUMNS)
        self.fold = rng.integers(-1, FOLDS, ROWS)

    def fit(self) -> LinearFit:
        return LinearFit.of(self.residual, self.columns, self.offset, self.penalty, self.fold)

    def solved(self, kept: Array, more: Array) -> Array:
        """Return the unknowns from some rows, by one least squares problem."""
        penalty = np.concatenate([self.penalty, np.ones(more.shape[1])])
        offset = np.concatenate([self.offset, np.zeros(more.shape[1])])
        rows = np.concatenate([np.column_stack([self.columns, more])[kept], np.diag(penalty)])
        target = np.concatenate([self.residual[kept], penalty * offset])
        return np.asarray(np.linalg.lstsq(rows, -target, rcond=None)[0])

    def explicit(self, more: Array, elsewhere: Array) -> Array:
        """Return held-out residuals by a fit without each fold, which may predict with other columns."""
        everywhere = np.ones(ROWS, dtype=bool)
        found = self.residual + np.column_stack([self.columns, more]) @ self.solved(everywhere, more)
        for number in range(FOLDS):
            out = self.fold == number
            unknowns = self.solved(~out, more)
            found[out] = (self.residual + np.column_stack([self.columns, elsewhere]) @ unknowns)[out]
        return np.asarray(found)


@pytest.mark.parametrize("seed", range(5))
def test_the_closed_form_is_exact(seed: int) -> None:
    made = Made(seed)
    nothing = np.zeros((ROWS, 0))
    assert made.fit().held_out() == pytest.approx(made.explicit(nothing, nothing), abs=1e-10)
    more = made.fit().with_columns(made.more).held_out()
    assert more == pytest.approx(made.explicit(made.more, made.more), abs=1e-10)


@pytest.mark.parametrize("chosen", [[], [0], [1, 3], [0, 1, 2, 3, 4]])
def test_any_choice_among_candidates_is_exact(chosen: list[int]) -> None:
    made = Made(7)
    more, elsewhere = made.more[:, chosen], made.elsewhere[:, chosen]
    here, held = Extensions(made.fit(), made.more), made.fold >= 0
    assert here.held_out(chosen)[held] == pytest.approx(made.explicit(more, more)[held], abs=1e-10)
    there = Extensions(made.fit(), made.more, made.elsewhere)
    assert there.held_out(chosen)[held] == pytest.approx(made.explicit(more, elsewhere)[held], abs=1e-10)
    everything = np.column_stack([made.columns, more])
    whole = made.residual + everything @ made.solved(np.ones(ROWS, dtype=bool), more)
    assert here.solved(chosen) == pytest.approx(whole, abs=1e-10)
    without = made.residual + everything @ made.solved(made.fold != 2, more)
    assert here.without_fold(2, chosen) == pytest.approx(without, abs=1e-10)


def test_more_rows_than_unknowns_in_a_fold_and_fewer_agree() -> None:
    made = Made(3)
    one, whole = made.fit(), made.fit()
    few = LinearFit(one.Q[:, :2], one.residual, one.fold)  # the small system and the large one are the same numbers
    small = few.held_out()
    for number in range(FOLDS):
        mine = np.flatnonzero(few.fold == number)
        large = np.linalg.solve(np.eye(len(mine)) - few.Q[mine] @ few.Q[mine].T, few.residual[mine])
        assert small[mine] == pytest.approx(large, abs=1e-10)
    assert whole.folds == FOLDS


def test_what_no_reading_shows_is_not_excited() -> None:
    made = Made(4)
    faint = Extensions(made.fit(), np.column_stack([1e-3 * made.more[:, :2], made.more[:, 2:]]))
    assert not faint.excited([0, 1])
    assert faint.excited([0, 1, 2])
