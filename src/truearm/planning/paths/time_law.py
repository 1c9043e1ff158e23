"""When a point is where on its path: from rest to rest, at a stated speed, with continuous acceleration.

The speed rises over a ramp of duration ``T`` as ``V (3x^2 - 2x^3)``, ``x = t / T``, is constant, and falls in the same
way. The acceleration along the path is then ``6 V/T x (1 - x)``: continuous, zero at rest and at full speed, and at
most ``1.5 V / T``, which is the acceleration that the caller states. The documents state no law; this one is ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.paths.paths import Path
from truearm.planning.paths.trajectory import Trajectory, sample_times


@dataclass(frozen=True)
class TimeLaw:
    """The motion along a path of some length, from rest to rest."""

    length: float  #: Of the path [m].
    #: Speed between the ramps [m/s]. On a path too short for both ramps the peak is lower: see :attr:`peak_speed`.
    speed: float
    #: Largest acceleration along the path [m/s^2]. What a bend adds, speed squared times curvature, is not in it.
    acceleration: float

    def __post_init__(self) -> None:
        for name in ("length", "speed", "acceleration"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError("it must be a positive number", where=name, came=value, allowed="above 0")

    @property
    def peak_speed(self) -> float:
        """Speed that is reached [m/s]."""
        return min(self.speed, math.sqrt(self.length * self.acceleration / 1.5))

    @property
    def ramp(self) -> float:
        """Duration of each ramp [s]."""
        return 1.5 * self.peak_speed / self.acceleration

    @property
    def duration(self) -> float:
        """Duration of the whole motion [s]."""
        return self.ramp + self.length / self.peak_speed

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Return distance [m], speed [m/s] and acceleration [m/s^2] along the path at times [s], ``(n,)`` each."""
        T, V = self.ramp, self.peak_speed
        late = time > self.duration / 2  # the second half is the first one seen backwards
        elapsed = np.where(late, self.duration - time, time)
        x = np.clip(elapsed / T, 0.0, 1.0)
        distance = V * T * x**3 * (1 - x / 2) + V * np.maximum(elapsed - T, 0.0)
        distance = np.where(late, self.length - distance, distance)
        return distance, V * x**2 * (3 - 2 * x), np.where(late, -6.0, 6.0) * V / T * x * (1 - x)


def timed(path: Path, speed: float, acceleration: float, step: float) -> Trajectory:
    """Let a point run along a path, from rest to rest.

    Args:
        path: Where it goes.
        speed, acceleration: As :class:`TimeLaw` has them [m/s], [m/s^2].
        step: Time between samples, or a little less, so that the last sample is the end [s].

    Raises:
        InputError: If a number is not positive, or the samples would be more than a million.
    """
    law = TimeLaw(path.length, speed, acceleration)
    time = sample_times(law.duration, step)
    s, rate, change = law.at(time)
    position, along, curvature = path.at(s)
    velocity = rate[:, None] * along
    return Trajectory(time, position, velocity, change[:, None] * along + rate[:, None] ** 2 * curvature)
