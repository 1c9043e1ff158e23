"""What is compared: an observation predicts a reading from a sweep and knows how the prediction moves.

Residuals are prediction minus measurement, so adding a parameter step times the Jacobian moves the prediction.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array, Sweep
from truearm.modeling.transform import rotation_from_quaternion, rotation_vector


class Observation(ABC):
    """A kind of reading with three components."""

    name: ClassVar[str]
    unit: ClassVar[str]

    @abstractmethod
    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold this observation, ``(readings,)``."""

    @abstractmethod
    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared standard deviation of each reading, ``(readings,)``, None if there is none."""

    @abstractmethod
    def residual(self, sweep: Sweep, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return prediction minus measurement, ``(k, 3)``.

        Parameters
        ----------
        sweep
            The chain to one target at all configurations of `data`.
        readings
            Indices of the k readings of that target.
        """

    @abstractmethod
    def jacobian(self, residual: Array, linear: Array, angular: Array) -> Array:
        """Return the derivative of the residual, ``(k, 3, parameters)``.

        Parameters
        ----------
        residual
            From :meth:`residual`, ``(k, 3)``.
        linear, angular
            How the target moves with each parameter, ``(parameters, 3, k)``.
        """


class Position(Observation):
    """Where a target is, in the instrument's frame [m]."""

    name = "position"
    unit = "m"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold a position."""
        return data.has_position

    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared deviation per coordinate [m]."""
        return data.sigma

    def residual(self, sweep: Sweep, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return the difference of the positions [m]."""
        return sweep.position[:, data.configuration[readings]].T - data.position[readings]

    def jacobian(self, residual: Array, linear: Array, angular: Array) -> Array:
        """Return the linear velocities."""
        return np.ascontiguousarray(np.moveaxis(linear, (0, 1, 2), (2, 1, 0)))


class Orientation(Observation):
    """How a target is turned: the rotation vector from the measured to the predicted frame [rad], in the world."""

    name = "orientation"
    unit = "rad"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold an orientation."""
        return data.has_orientation

    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared deviation per axis [rad]."""
        return data.sigma_rot

    def residual(self, sweep: Sweep, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return log(R_predicted R_measured^T) [rad]."""
        if data.quaternion is None:
            raise ValueError("the data hold no orientations")
        predicted = sweep.matrix()[data.configuration[readings]]
        measured = rotation_from_quaternion(data.quaternion[readings])
        return rotation_vector(predicted @ np.swapaxes(measured, -1, -2))

    def jacobian(self, residual: Array, linear: Array, angular: Array) -> Array:
        """Return inv(left Jacobian of SO(3) at the residual) times the angular velocities (Barfoot 2017, eq. 7.85)."""
        angle = np.linalg.norm(residual, axis=1)[:, None, None]
        x, y, z = residual.T
        zero = np.zeros_like(x)
        cross = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)
        small = angle < 1e-4
        safe = np.where(small, 1.0, angle)
        second = np.where(small, 1 / 12, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
        inverse = np.eye(3) - 0.5 * cross + second * (cross @ cross)
        moved: Array = inverse @ np.moveaxis(angular, (0, 1, 2), (2, 1, 0))
        return moved


OBSERVATIONS: Final = (Position(), Orientation())
