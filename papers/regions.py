"""Regions of joint positions that documents drive their robots in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array


@dataclass(frozen=True)
class Region:
    """A box of joint positions."""

    low: tuple[float, ...]  #: low, high: lowest and highest position of each joint [deg].
    high: tuple[float, ...]

    @property
    def limits(self) -> tuple[Array, Array]:
        """Lowest and highest position of each joint [rad], ``(joints,)`` each."""
        return np.radians(self.low), np.radians(self.high)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return configurations drawn evenly from the region [rad], ``(count, joints)``."""
        return np.asarray(rng.uniform(*self.limits, (count, len(self.low))))


#: Of the IRB 120: Nubiola, section 2.5; upper ends of joints 2 and 3 are the robot's own limits.
IRB120: Final = Region((-90, 0, -80, -150, -90, -180), (90, 110, 70, 150, 90, 180))
