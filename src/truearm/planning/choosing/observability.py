"""How well a set of measurements tells parameters apart: the observability indices O1 to O5.

With the singular values s_1 >= .. >= s_m of the identification Jacobian and n configurations,

- O1 = (s_1 .. s_m)^(1/m) / sqrt(n)  (Borm and Menq 1989; Nubiola, section 2.5.2, as corrected there),
- O2 = s_m / s_1, the inverse condition number  (Driels and Pathre 1990),
- O3 = s_m  (Nahvi, Hollerbach and Hayward 1994),
- O4 = s_m^2 / s_1, the noise amplification index  (Nahvi and Hollerbach 1996),
- O5 = 1 / (1/s_1 + .. + 1/s_m)  (Sun and Hollerbach 2008, who compare all five).

They are written with the information matrix ``M = J' J``, whose eigenvalues are the squares of the singular values.

Only what O1 prefers does not depend on the units and sizes of the parameters; all other indices do. Here a row is a
reading divided by its deviation, and a column is the move of a parameter by its size: 1 mm and 0.1 deg for base,
targets, joint zeros and geometry (or the robot file's own priors), for joint effects what they are believed to be
at most. Priors count as measurements. A parameter that no candidate can tell from the others is left out.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from truearm.modeling.chain import Array

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
    found = {name: float(np.exp(index.value(information))) for name, index in INDICES.items()}
    return found | {"O1": found["O1"] / float(np.sqrt(configurations))}


def _ends(eigenvalues: Array, smallest: float, largest: float) -> Array:
    rates = np.zeros_like(eigenvalues)
    rates[..., 0] = smallest / eigenvalues[..., 0]
    rates[..., -1] += largest / eigenvalues[..., -1]
    return rates


def _log_determinant(matrix: Array) -> Array:
    return np.asarray(np.linalg.slogdet(matrix)[1], dtype=np.float64)
