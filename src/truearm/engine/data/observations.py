"""Observations: what readings of a target are compared with, and how predictions move."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.parameters import SCALE
from truearm.engine.robot.transform import cross, rotation_from_quaternion, rotation_vector


@dataclass(frozen=True, eq=False)
class Sighting:
    """A target at k configurations, in the axes of the fixture that it is measured against."""

    target: ForwardKinematics  #: The chain to the target, at all configurations.
    configurations: NDArray[np.intp] | slice  #: Which of them, in order; a slice costs no copy.
    #: The chain to the fixture, at one configuration; None for the instrument, whose frame is the world.
    fixture: ForwardKinematics | None = None
    #: How much longer than it reads the unit of length is, a number or one for each trial ``(trials, 1)``: places are
    #: seen so much smaller.
    scale: float | Array = 0.0

    @cached_property
    def position(self) -> Array:
        """Where the target is [m], ``(3, ..., k)``."""
        at = self.target.position[..., self.configurations]
        return self._shrunk(at if self.fixture is None else self._turned(at - self.fixture.position))

    @cached_property
    def rotation(self) -> Array:
        """How the target is turned, ``(..., k, 3, 3)``."""
        turned = self.target.matrix()[..., self.configurations, :, :]
        return turned if self.fixture is None else np.swapaxes(self.fixture.matrix(), -1, -2) @ turned

    def position_jacobian(self, velocity: Array, names: tuple[str, ...]) -> Array:
        """Return how the position moves with parameters [m per unit], ``(parameters, 3, ..., k)``.

        Args:
            velocity: Of the target in the world by each parameter, at all configurations, ``(parameters, 3, ..., n)``.
            names: Of the parameters.
        """
        moved = velocity[..., self.configurations]
        if self.fixture is None:
            return self._by_scale(moved, names)
        arm = self.target.position[..., self.configurations] - self.fixture.position
        columns = [k for k, name in enumerate(names) if name in self.fixture.places]
        places = [self.fixture.places[names[k]] for k in columns]
        moved = moved.copy()
        for k, slide, turn in zip(
            columns, self.fixture.position_jacobian(places), self.fixture.orientation_jacobian(places), strict=True
        ):
            moved[k] -= slide + cross(*np.broadcast_arrays(turn, arm))
        return self._by_scale(self._turned(moved, at=1), names)

    def orientation_jacobian(self, velocity: Array, names: tuple[str, ...]) -> Array:
        """Return how the target turns with parameters [rad per unit], as :meth:`position_jacobian`."""
        moved = velocity[..., self.configurations]
        if self.fixture is None:
            return moved
        columns = [k for k, name in enumerate(names) if name in self.fixture.places]
        moved = moved.copy()
        for k, turn in zip(
            columns, self.fixture.orientation_jacobian([self.fixture.places[names[k]] for k in columns]), strict=True
        ):
            moved[k] -= turn
        return self._turned(moved, at=1)

    @property
    def _scaled(self) -> bool:
        return bool(self.scale) if isinstance(self.scale, float) else bool(np.any(self.scale))

    def _shrunk(self, vector: Array) -> Array:
        return vector / (1.0 + self.scale) if self._scaled else vector

    def _by_scale(self, moved: Array, names: tuple[str, ...]) -> Array:
        """Return a derivative of places as they are seen, with that by the scale."""
        moved = self._shrunk(moved)
        if SCALE in names:
            moved = moved.copy()
            moved[names.index(SCALE)] = -self._shrunk(self.position)
        return moved

    def _turned(self, vector: Array, at: int = 0) -> Array:
        """Return vectors ``(3, ..., k)`` of the world in the axes of the fixture; `at` is where their 3 is."""
        if self.fixture is None or not any(element.turns for element in self.fixture.elements):
            return vector
        return np.stack([np.sum(axis * vector, axis=at) for axis in self.fixture.rotation], axis=at)


# Residuals are prediction minus measurement, so adding a parameter step times the Jacobian moves the prediction.
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
        of_target = data.target == index
        for other in np.unique(against[of_target]).tolist():
            fixture = data.fixtures[other] if other >= 0 else None
            for observation in OBSERVATIONS:
                readings = np.flatnonzero(of_target & (against == other) & observation.present(data))
                if len(readings):
                    yield name, fixture, observation, readings
