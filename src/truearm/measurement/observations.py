"""What is compared: an observation predicts a reading from a sighting and knows how the prediction moves.

Residuals are prediction minus measurement, so adding a parameter step times the Jacobian moves the prediction.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.measurement.sighting import Sighting
from truearm.modeling.chain import Array
from truearm.modeling.transform import rotation_from_quaternion, rotation_vector


class Observation(ABC):
    """A kind of reading."""

    name: ClassVar[str]  #: name, unit: as reports spell them.
    unit: ClassVar[Literal["m", "rad"]]
    components: ClassVar[int]  #: How many numbers a reading has.
    #: What moves it: the ``linear`` velocity of the target or its ``angular`` one.
    velocity: ClassVar[Literal["linear", "angular"]]

    @abstractmethod
    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold this observation, ``(readings,)``."""

    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared standard deviation of each reading, ``(readings,)``, None if there is none."""
        return data.sigma

    @abstractmethod
    def residual(self, seen: Sighting, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return prediction minus measurement, ``(..., k, components)``.

        Args:
            seen: One target from one fixture, at the configurations of the readings.
            readings: Indices of these k readings.
        """

    @abstractmethod
    def jacobian(self, seen: Sighting, residual: Array, velocity: Array) -> Array:
        """Return the derivative of the residual, ``(parameters, ..., k, components)``.

        Args:
            residual: From :meth:`residual`.
            velocity: How the target, seen from there, moves with each parameter, linear or angular, ``(parameters, 3,
                ..., k)``.
        """


class Position(Observation):
    """Where a target is, in the instrument's frame or counted from a fixture in its axes [m]."""

    name = "position"
    unit = "m"
    components = 3
    velocity = "linear"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold a position."""
        return np.asarray(np.isfinite(data.position).all(axis=1))

    def residual(self, seen: Sighting, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return the difference of the positions [m]."""
        return _last(seen.position, 0) - data.position[readings]

    def jacobian(self, seen: Sighting, residual: Array, velocity: Array) -> Array:
        """Return the linear velocities."""
        return _last(velocity, 1)


class Orientation(Observation):
    """How a target is turned: the rotation vector from the measured to the predicted frame [rad], in its axes."""

    name = "orientation"
    unit = "rad"
    components = 3
    velocity = "angular"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold an orientation."""
        if data.quaternion is None:
            return np.zeros(len(data.target), dtype=bool)
        return np.asarray(np.isfinite(data.quaternion).all(axis=1))

    def declared_sigma(self, data: Dataset) -> Array | None:
        """Return the declared deviation per axis [rad]."""
        return data.sigma_rot

    def residual(self, seen: Sighting, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return log(R_predicted R_measured^T) [rad]."""
        if data.quaternion is None:
            raise ValueError("the data hold no orientations")
        measured = rotation_from_quaternion(data.quaternion[readings])
        return rotation_vector(seen.rotation @ np.swapaxes(measured, -1, -2))

    def jacobian(self, seen: Sighting, residual: Array, velocity: Array) -> Array:
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


class Distance(Observation):
    """How far a target is from the origin of a fixture [m]: a ballbar, a string, the centre of a touched sphere."""

    name = "distance"
    unit = "m"
    components = 1
    velocity = "linear"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold a distance."""
        return np.zeros(len(data.target), dtype=bool) if data.distance is None else np.isfinite(data.distance)

    def residual(self, seen: Sighting, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return the difference of the distances [m]."""
        if data.distance is None:
            raise ValueError("the data hold no distances")
        return np.asarray(np.linalg.norm(seen.position, axis=0) - data.distance[readings])[..., None]

    def jacobian(self, seen: Sighting, residual: Array, velocity: Array) -> Array:
        """Return the velocities along the line from the fixture to the target."""
        far = np.linalg.norm(seen.position, axis=0)
        along = seen.position / np.where(far > 0.0, far, 1.0)
        return np.asarray(np.sum(along * velocity, axis=1))[..., None]


class Height(Observation):
    """How high a target is over the plane of a fixture [m]: zero where it touches, or what a dial gauge reads."""

    name = "height"
    unit = "m"
    components = 1
    velocity = "linear"

    def present(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings hold a height."""
        return np.zeros(len(data.target), dtype=bool) if data.height is None else np.isfinite(data.height)

    def residual(self, seen: Sighting, data: Dataset, readings: NDArray[np.intp]) -> Array:
        """Return the difference of the heights [m]."""
        if data.height is None:
            raise ValueError("the data hold no heights")
        return np.asarray(seen.position[2] - data.height[readings])[..., None]

    def jacobian(self, seen: Sighting, residual: Array, velocity: Array) -> Array:
        """Return the velocities along the plane's normal."""
        return velocity[:, 2, ..., None]


def _last(array: Array, axis: int) -> Array:
    """Return a view with an axis put last: :func:`numpy.moveaxis` in a fifth of the time."""
    return array.transpose(*range(axis), *range(axis + 1, array.ndim), axis)


OBSERVATIONS: Final = (Position(), Orientation(), Distance(), Height())


def compared(data: Dataset) -> Iterator[tuple[str, str | None, Observation, NDArray[np.intp]]]:
    """Go through the readings by target, fixture and observation.

    Yields:
        Name of the target, name of the fixture or None for the instrument's own frame, what is compared, and the
        indices of the readings that hold it, at least one.
    """
    against = data.against
    for index, name in enumerate(data.targets):
        mine = data.target == index
        for other in np.unique(against[mine]).tolist():
            fixture = data.fixtures[other] if other >= 0 else None
            for observation in OBSERVATIONS:
                readings = np.flatnonzero(mine & (against == other) & observation.present(data))
                if len(readings):
                    yield name, fixture, observation, readings
