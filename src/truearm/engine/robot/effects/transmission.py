"""Transmission error of a gear: an error that repeats many times in a turn of the joint.

A strain wave gear errs twice in a turn of its wave generator (Ghorbel, Gandhi and Alpeter 2001, "On the kinematic
error in harmonic drive gears"), so two hundred times in a turn of the joint at a ratio of 1 to 100. How often is a fact
about the gear and stands in the robot file, as ``transmission_periods`` of the joint;
:mod:`truearm.engine.diagnose.advice` finds it in what a fit leaves over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

_PRIOR: Final = 1e-4


@dataclass(frozen=True)
class TransmissionError(LinearEffect):
    """Parameters ``transmission_sin_i`` and ``transmission_cos_i`` [rad] of joints whose gear is known."""

    name: ClassVar[str] = "transmission-error"
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Sine and cosine of each joint with known periods."""
        return tuple(
            self.parameter(f"transmission_{part}_{i + 1}", "rad", _PRIOR)
            for i, _ in self._geared()
            for part in ("sin", "cos")
        )

    def shapes(self, at: Postures) -> Rates:
        """Return the sines and cosines of the joint positions times the periods in a turn."""
        shapes = {}
        for i, periods in self._geared():
            shapes[f"transmission_sin_{i + 1}"] = {i: np.sin(periods * at.joints[:, i])}
            shapes[f"transmission_cos_{i + 1}"] = {i: np.cos(periods * at.joints[:, i])}
        return shapes

    def _geared(self) -> Iterator[tuple[int, int]]:
        return ((i, periods) for i, periods in enumerate(self.layout.transmission_periods) if periods is not None)
