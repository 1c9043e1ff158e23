"""Which of many possible measurements tell most: observability indices, and a choice by exchange.

Measurements are added one at a time, then each is exchanged for a better one as long as there is one (Fedorov 1972,
"Theory of optimal experiments"; Cook and Nachtsheim 1980). What each candidate would add is looked at to first order,
for all of them at once: the inner product of its information with the slope of the objective, one matrix product in
single precision over the distinct entries of the information. The most promising ones are then weighed exactly, so the
objective never falls.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array

# How well a set of measurements tells parameters apart: the observability indices O1 to O5.
#
# With the singular values s_1 >= .. >= s_m of the identification Jacobian and n configurations,
#
# - O1 = (s_1 .. s_m)^(1/m) / sqrt(n)  (Borm and Menq 1989; Nubiola, section 2.5.2, as corrected there),
# - O2 = s_m / s_1, the inverse condition number  (Driels and Pathre 1990),
# - O3 = s_m  (Nahvi, Hollerbach and Hayward 1994),
# - O4 = s_m^2 / s_1, the noise amplification index  (Nahvi and Hollerbach 1996),
# - O5 = 1 / (1/s_1 + .. + 1/s_m)  (Sun and Hollerbach 2008, who compare all five).
#
# They are written with the information matrix ``M = J' J``, whose eigenvalues are the squares of the singular values.
#
# Only what O1 prefers does not depend on the units and sizes of the parameters; all other indices do. Here a row is a
# reading divided by its deviation, and a column is the move of a parameter by its size: 1 mm and 0.1 deg for base,
# targets, joint zeros and geometry (or the robot file's own priors), for joint effects what they are believed to be
# at most. Priors count as measurements. A parameter that no candidate can tell from the others is left out.
_SMALLEST: Final = 1e-300  # for logarithms of what rounding makes zero or less


class Objective(ABC):
    """What a choice of measurements makes as large as it can, as a function of their information."""

    @abstractmethod
    def value(self, information: Array) -> Array:
        """Return the natural logarithm of the objective, ``(...)``, of matrices ``(..., m, m)``."""

    @abstractmethod
    def slope(self, information: Array) -> Array:
        """Return the derivative of :meth:`value` by each entry of a matrix, both ``(..., m, m)``."""


class Index(Objective):
    """An observability index, not yet divided by the number of configurations."""

    name: ClassVar[str]


class O1(Index):
    """The geometric mean of the singular values."""

    name = "O1"

    def value(self, information: Array) -> Array:
        """Return the logarithm of the geometric mean."""
        return np.asarray(_log_determinant(information) / (2.0 * information.shape[-1]))

    def slope(self, information: Array) -> Array:
        """Return the derivative."""
        return np.asarray(np.linalg.inv(information) / (2.0 * information.shape[-1]))


class _Spectral(Index):
    """An index that is computed from eigenvalues."""

    def value(self, information: Array) -> Array:
        """Return the logarithm of the index."""
        return self._of(np.maximum(np.linalg.eigvalsh(information), _SMALLEST))

    def slope(self, information: Array) -> Array:
        """Return the derivative; where eigenvalues are equal, that by one of their vectors."""
        eigenvalues, vectors = np.linalg.eigh(information)
        rates = self._rates(np.maximum(eigenvalues, _SMALLEST))
        return np.asarray((vectors * rates[..., None, :]) @ vectors.swapaxes(-1, -2))

    @abstractmethod
    def _of(self, eigenvalues: Array) -> Array:
        """Return the logarithm of the index, ``(...)``, from eigenvalues in rising order, ``(..., m)``."""

    @abstractmethod
    def _rates(self, eigenvalues: Array) -> Array:
        """Return its derivative by each of them, ``(..., m)``."""


class O2(_Spectral):
    """The inverse condition number."""

    name = "O2"

    def _of(self, eigenvalues: Array) -> Array:
        return np.asarray(0.5 * (np.log(eigenvalues[..., 0]) - np.log(eigenvalues[..., -1])))

    def _rates(self, eigenvalues: Array) -> Array:
        return _ends(eigenvalues, 0.5, -0.5)


class O3(_Spectral):
    """The smallest singular value."""

    name = "O3"

    def _of(self, eigenvalues: Array) -> Array:
        return np.asarray(0.5 * np.log(eigenvalues[..., 0]))

    def _rates(self, eigenvalues: Array) -> Array:
        return _ends(eigenvalues, 0.5, 0.0)


class O4(_Spectral):
    """The noise amplification index."""

    name = "O4"

    def _of(self, eigenvalues: Array) -> Array:
        return np.asarray(np.log(eigenvalues[..., 0]) - 0.5 * np.log(eigenvalues[..., -1]))

    def _rates(self, eigenvalues: Array) -> Array:
        return _ends(eigenvalues, 1.0, -0.5)


class O5(_Spectral):
    """The inverse of the sum of the inverse singular values."""

    name = "O5"

    def _of(self, eigenvalues: Array) -> Array:
        return np.asarray(-np.log(np.sum(eigenvalues**-0.5, axis=-1)))

    def _rates(self, eigenvalues: Array) -> Array:
        return np.asarray(0.5 * eigenvalues**-1.5 / np.sum(eigenvalues**-0.5, axis=-1, keepdims=True))


INDICES: Final[Mapping[str, Index]] = {index.name: index for index in (O1(), O2(), O3(), O4(), O5())}


@dataclass(frozen=True)
class OfInterest(Objective):
    """The determinant of the information on some parameters, with what the others take away.

    That is the Schur complement (D_s-optimality: Atkinson, Donev and Tobias 2007, "Optimum experimental designs, with
    SAS", section 10.3).
    """

    count: int  #: How many of the parameters, the first ones, are of interest.

    def value(self, information: Array) -> Array:
        """Return the logarithm of the determinant."""
        others = information[..., self.count :, self.count :]
        return _log_determinant(information) - _log_determinant(others)

    def slope(self, information: Array) -> Array:
        """Return the derivative."""
        inverse = np.linalg.inv(information)
        inverse[..., self.count :, self.count :] -= np.linalg.inv(information[..., self.count :, self.count :])
        return np.asarray(inverse)


@dataclass(frozen=True, eq=False)
class OfPredictions(Objective):
    """The inverse of the root mean square error of predictions, about all that are of interest.

    That is the trace of the covariance times the mean information of the predictions (I- or V-optimality: Atkinson,
    Donev and Tobias 2007, "Optimum experimental designs, with SAS", section 10.6).
    """

    weight: Array  #: Mean of D' D over the predictions, D their derivatives by the parameters, ``(m, m)``.

    @classmethod
    def of(cls, rows: Array) -> OfPredictions:
        """Return the objective for predictions with derivatives ``(predictions, rows, m)``."""
        flat = rows.reshape(-1, rows.shape[2])
        return cls(flat.T @ flat / len(flat))

    def value(self, information: Array) -> Array:
        """Return the logarithm of the inverse error."""
        covariance = np.linalg.inv(information)
        return np.asarray(-0.5 * np.log(np.maximum(np.sum(covariance * self.weight, axis=(-2, -1)), _SMALLEST)))

    def slope(self, information: Array) -> Array:
        """Return the derivative."""
        covariance = np.linalg.inv(information)
        mean = np.maximum(np.sum(covariance * self.weight, axis=(-2, -1)), _SMALLEST)
        return np.asarray(0.5 * covariance @ self.weight @ covariance / mean[..., None, None])


def observability(information: Array, configurations: int) -> dict[str, float]:
    """Return the indices O1 to O5 of an information matrix ``(m, m)`` gathered at so many configurations."""
    values = {name: float(np.exp(index.value(information))) for name, index in INDICES.items()}
    return values | {"O1": values["O1"] / float(np.sqrt(configurations))}


def _ends(eigenvalues: Array, smallest: float, largest: float) -> Array:
    rates = np.zeros_like(eigenvalues)
    rates[..., 0] = smallest / eigenvalues[..., 0]
    rates[..., -1] += largest / eigenvalues[..., -1]
    return rates


def _log_determinant(matrix: Array) -> Array:
    return np.asarray(np.linalg.slogdet(matrix)[1], dtype=np.float64)


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
