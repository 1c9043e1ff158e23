"""A trajectory: where a point is over time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array

#: More samples than anyone means.
_MOST_SAMPLES: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Where a point is over time, in the robot's base frame."""

    time: Array  #: [s], ``(n,)``, rising.
    position: Array  #: position, velocity, acceleration: [m], [m/s], [m/s^2], ``(n, 3)``.
    velocity: Array
    acceleration: Array

    @property
    def distance(self) -> Array:
        """Length of the chords up to each sample [m], ``(n,)``."""
        chords = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(chords)])


def sample_times(duration: float, step: float) -> Array:
    """Return times from 0 to `duration` [s], evenly apart by `step` or a little less."""
    if not (math.isfinite(step) and step > 0):
        raise InputError("it must be a positive number", where="step", came=step, allowed="above 0 s")
    if duration / step > _MOST_SAMPLES:
        raise InputError(
            "there would be too many samples",
            where="step",
            came=f"{step:.4g} s over {duration:.4g} s",
            allowed=f"at most {_MOST_SAMPLES} samples",
            cure="Take a longer step, or go faster.",
        )
    return np.linspace(0.0, duration, math.ceil(duration / step - 1e-9) + 1)
