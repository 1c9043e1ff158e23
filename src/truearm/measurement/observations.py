"""What is compared: an observation predicts a reading from a sweep and knows how the prediction moves.

Residuals are prediction minus measurement, so adding a parameter step times the Jacobian moves the prediction.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array, Sweep
from truearm.modeling.transform import rotation_from_quaternion, rotation_vector


class Observation(ABC):
    """A kind of reading with three components.

    Attributes
    ----------
    name, unit
        As reports spell them.
    velocity
        What moves it: the ``linear`` velocity of the target or its ``angular`` one.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    velocity: ClassVar[Literal["linear", "angular"]]

    @abstractmethod
    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold this observation, ``(readings,)``."""

    @abstractmethod
    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared standard deviation of each reading, ``(readings,)``, None if there is none."""

    @abstractmethod
    def residual(self, sweep: Sweep, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return prediction minus measurement, ``(..., k, 3)``.

        Parameters
        ----------
        sweep
            The chain to one target at all configurations of `data`.
        readings
            Indices of the k readings of that target.
        """

    @abstractmethod
    def jacobian(self, residual: Array, velocity: Array) -> Array:
        """Return the derivative of the residual, ``(parameters, ..., k, 3)``.

        Parameters
        ----------
        residual
            From :meth:`residual`, ``(..., k, 3)``.
        velocity
            How the target moves with each parameter, linear or angular, ``(parameters, 3, ..., k)``.
        """


class Position(Observation):
    """Where a target is, in the instrument's frame [m]."""

    name = "position"
    unit = "m"
    velocity = "linear"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold a position."""
        return data.has_position

    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared deviation per coordinate [m]."""
        return data.sigma

    def residual(self, sweep: Sweep, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return the difference of the positions [m]."""
        predicted = sweep.position[..., data.configuration[readings]]
        return np.moveaxis(predicted, 0, -1) - data.position[readings]

    def jacobian(self, residual: Array, velocity: Array) -> Array:
        """Return the linear velocities."""
        return np.moveaxis(velocity, 1, -1)


class Orientation(Observation):
    """How a target is turned: the rotation vector from the measured to the predicted frame [rad], in the world."""

    name = "orientation"
    unit = "rad"
    velocity = "angular"

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
        predicted = sweep.matrix()[..., data.configuration[readings], :, :]
        measured = rotation_from_quaternion(data.quaternion[readings])
        return rotation_vector(predicted @ np.swapaxes(measured, -1, -2))

    def jacobian(self, residual: Array, velocity: Array) -> Array:
        """Return inv(left Jacobian of SO(3) at the residual) times the angular velocities (Barfoot 2017, eq. 7.85)."""
        angle = np.linalg.norm(residual, axis=-1)[..., None, None]
        x, y, z = np.moveaxis(residual, -1, 0)
        zero = np.zeros_like(x)
        cross = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))
        small = angle < 1e-4
        safe = np.where(small, 1.0, angle)
        second = np.where(small, 1 / 12, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
        inverse = np.eye(3) - 0.5 * cross + second * (cross @ cross)
        moved: Array = inverse @ np.moveaxis(velocity, 1, -1)[..., None]
        return moved[..., 0]


OBSERVATIONS: Final = (Position(), Orientation())
