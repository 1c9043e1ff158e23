"""A target as something else sees it: the instrument, or a fixture beside the robot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array, ForwardKinematics
from truearm.modeling.parameters import SCALE
from truearm.modeling.transform import cross


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
        mine = [k for k, name in enumerate(names) if name in self.fixture.places]
        places = [self.fixture.places[names[k]] for k in mine]
        moved = moved.copy()
        for k, slide, turn in zip(
            mine, self.fixture.position_jacobian(places), self.fixture.orientation_jacobian(places), strict=True
        ):
            moved[k] -= slide + cross(*np.broadcast_arrays(turn, arm))
        return self._by_scale(self._turned(moved, at=1), names)

    def orientation_jacobian(self, velocity: Array, names: tuple[str, ...]) -> Array:
        """Return how the target turns with parameters [rad per unit], as :meth:`position_jacobian`."""
        moved = velocity[..., self.configurations]
        if self.fixture is None:
            return moved
        mine = [k for k, name in enumerate(names) if name in self.fixture.places]
        moved = moved.copy()
        for k, turn in zip(
            mine, self.fixture.orientation_jacobian([self.fixture.places[names[k]] for k in mine]), strict=True
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
