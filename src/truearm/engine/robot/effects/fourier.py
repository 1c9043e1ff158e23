"""Fourier series of a joint: gears and encoders that run out of true (Nubiola, section 1.8).

Two periods in a turn of the joint are what an eccentric and an oval wheel at the output make.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

HARMONICS: Final = (1, 2)
_PRIOR: Final = math.radians(0.03)


@dataclass(frozen=True)
class Fourier(LinearEffect):
    """Parameters ``fourier_sin1_i``, ``fourier_cos1_i``, ``fourier_sin2_i``, ``fourier_cos2_i`` [rad]."""

    name: ClassVar[str] = "fourier"
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Sine and cosine of each harmonic of each turning joint."""
        return tuple(
            self.parameter(f"fourier_{part}{k}_{i + 1}", "rad", _PRIOR)
            for i in self.layout.turning
            for k in HARMONICS
            for part in ("sin", "cos")
        )

    def shapes(self, at: Postures) -> Rates:
        """Return sines and cosines of multiples of the joint positions."""
        shapes = {}
        for i in self.layout.turning:
            for k in HARMONICS:
                shapes[f"fourier_sin{k}_{i + 1}"] = {i: np.sin(k * at.joints[:, i])}
                shapes[f"fourier_cos{k}_{i + 1}"] = {i: np.cos(k * at.joints[:, i])}
        return shapes
