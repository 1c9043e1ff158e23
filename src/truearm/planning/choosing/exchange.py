"""Which of many possible measurements tell most: a choice by exchange.

Measurements are added one at a time, then each is exchanged for a better one as long as there is one (Fedorov 1972,
"Theory of optimal experiments"; Cook and Nachtsheim 1980). What each candidate would add is looked at to first order,
for all of them at once: the inner product of its information with the slope of the objective, one matrix product in
single precision over the distinct entries of the information. The most promising ones are then weighed exactly, so the
objective never falls.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.choosing.observability import O1, Objective

N = TypeVar("N", bound=np.floating[Any])

#: What the search for a number begins with (Nubiola, section 2.5.2).
FIRST: Final = 11
_ROUNDS: Final = 20
_CANDIDATES_TRIED: Final = 8
_LEAST_GAIN: Final = 1e-9  # of the logarithm of the objective


@dataclass(frozen=True, eq=False)
class Candidates:
    """Measurements to choose from."""

    rows: Array  #: Derivatives of each by the parameters, per standard deviation, ``(candidates, rows, parameters)``.
    known: Array  #: Information that is there beforehand, ``(parameters, parameters)``, positive definite.
    colouring: Array  #: Factor of the information of an average choice, ``(parameters, parameters)``.
    #: Distinct entries of the information of each candidate on parameters that an average choice tells equally well,
    #: where single precision is enough, ``(candidates, entries)``.
    packed: NDArray[np.float32]

    @classmethod
    def of(cls, rows: Array, known: Array, count: int) -> Candidates:
        """Prepare a choice of about `count` candidates."""
        flat = rows.reshape(-1, rows.shape[2])
        average = known + flat.T @ flat * (max(count, 1) / max(len(rows), 1))
        colouring = np.asarray(np.linalg.cholesky(average).T, dtype=np.float64)
        turned = (flat @ np.linalg.inv(colouring)).astype(np.float32).reshape(rows.shape)
        return cls(rows, known, colouring, _packed(turned.swapaxes(1, 2) @ turned))

    @cached_property
    def twice(self) -> Array:
        """How often each distinct entry stands in a matrix, ``(entries,)``."""
        return _packed(np.asarray(2.0 - np.eye(len(self.known)), dtype=np.float64))

    def information(self, chosen: NDArray[np.intp]) -> Array:
        """Return the information of single candidates, ``(chosen, parameters, parameters)``."""
        rows = self.rows[chosen]
        return np.asarray(rows.swapaxes(1, 2) @ rows)

    def total(self, chosen: list[int]) -> Array:
        """Return what is known beforehand and from the chosen, ``(parameters, parameters)``."""
        rows = self.rows[chosen].reshape(-1, self.rows.shape[2])
        return np.asarray(self.known + rows.T @ rows)

    def promise(self, slopes: Array) -> NDArray[np.float32]:
        """Return to first order what each candidate adds, ``(candidates, ...)``, for slopes ``(..., m, m)``."""
        turned = _packed(self.colouring @ slopes @ self.colouring.T) * self.twice
        return np.asarray(self.packed @ turned.astype(np.float32).T)


def most_informative(rows: Array, count: int, known: Array, objective: Objective) -> list[int]:
    """Return the indices of `count` measurements that together tell most.

    Args:
        rows: Derivatives of each possible measurement by the parameters, per standard deviation, ``(candidates, rows,
            parameters)``.
        count: How many to choose.
        known: Information that is there beforehand, ``(parameters, parameters)``, positive definite.
        objective: What is made large.

    Raises:
        InputError: If there are fewer candidates.
    """
    _refuse_too_many(count, len(rows))
    return _chosen(Candidates.of(rows, known, count), count, objective)


def most_informative_number(rows: Array, known: Array) -> list[int]:
    """Return the indices of as many measurements as make O1 largest, beginning with 11.

    One is added, taken away or exchanged as long as the index rises (Nubiola, section 2.5.2).

    Args:
        rows, known: As for :func:`most_informative`.

    Raises:
        InputError: If there are fewer than 11 candidates.
    """
    _refuse_too_many(FIRST, len(rows))
    objective = O1()
    candidates = Candidates.of(rows, known, FIRST)
    chosen = _chosen(candidates, FIRST, objective)

    def index(choice: list[int]) -> float:
        return float(objective.value(candidates.total(choice))) - 0.5 * float(np.log(len(choice)))

    best = index(chosen)
    while True:
        tried = []
        if len(chosen) < len(rows):
            more = candidates.total(chosen)
            promise = candidates.promise(objective.slope(more))
            tried.append([*chosen, _best(candidates, more, objective, promise, chosen)[0]])
        if len(chosen) > 1:
            total = candidates.total(chosen)
            left = objective.value(total - candidates.information(np.array(chosen)))
            weakest = int(np.argmax(left))
            tried.append(chosen[:weakest] + chosen[weakest + 1 :])
        better = next((choice for choice in tried if index(choice) > best + _LEAST_GAIN), None)
        if better is None:
            better = exchanged(candidates, chosen, objective)
            if index(better) <= best + _LEAST_GAIN:
                return chosen
        chosen, best = better, index(better)


def _refuse_too_many(count: int, candidates: int) -> None:
    if not 0 <= count <= candidates:
        raise InputError(
            "there are too few measurements to choose from",
            where="number of measurements",
            came=count,
            allowed=f"0 to {candidates}",
        )


def _chosen(candidates: Candidates, count: int, objective: Objective) -> list[int]:
    """Choose one after the other, as if average ones stood for those to come, then exchange."""
    flat = candidates.rows.reshape(-1, candidates.rows.shape[2])
    average = flat.T @ flat / max(len(candidates.rows), 1)
    chosen: list[int] = []
    total = candidates.known + count * average
    for _ in range(count):
        total = total - average
        promise = candidates.promise(objective.slope(total))
        best, information = _best(candidates, total, objective, promise, chosen)
        chosen.append(best)
        total = total + information
    return exchanged(candidates, chosen, objective)


def exchanged(candidates: Candidates, chosen: list[int], objective: Objective) -> list[int]:
    """Exchange each of the chosen for a better one as long as there is one."""
    chosen = list(chosen)
    total = candidates.total(chosen)
    reached = objective.value(total)
    for _ in range(_ROUNDS):
        changed = False
        own = candidates.information(np.array(chosen, dtype=np.intp))
        promise = candidates.promise(objective.slope(total - own))
        for place, old in enumerate(chosen):
            without = total - own[place]
            others = chosen[:place] + chosen[place + 1 :]
            best, information = _best(candidates, without, objective, promise[:, place], others)
            if best == old:
                continue
            exchanged_for = objective.value(without + information)
            if exchanged_for - reached > _LEAST_GAIN:
                chosen[place], total, reached, changed = best, without + information, exchanged_for, True
        if not changed:
            break
    return chosen


def _best(
    candidates: Candidates, total: Array, objective: Objective, promise: NDArray[np.float32], taken: list[int]
) -> tuple[int, Array]:
    """Return the candidate that adds most to `total`, and its information."""
    promise = promise.copy()
    promise[taken] = -np.inf
    several = min(_CANDIDATES_TRIED, len(promise) - len(taken))
    few = np.argpartition(promise, len(promise) - several)[len(promise) - several :]
    information = candidates.information(few)
    best = int(np.argmax(objective.value(total + information)))
    return int(few[best]), information[best]


def _packed(matrices: NDArray[N]) -> NDArray[N]:
    """Return the entries on and above the diagonal of symmetric matrices, ``(..., entries)``."""
    rows, columns = np.triu_indices(matrices.shape[-1])
    return matrices[..., rows, columns]
