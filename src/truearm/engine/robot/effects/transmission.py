"""Transmission error of a gear: an error that repeats many times in a turn of the joint.

A strain wave gear errs twice in a turn of its wave generator (Ghorbel, Gandhi and Alpeter 2001, "On the kinematic
error in harmonic drive gears"), so two hundred times in a turn of the joint at a ratio of 1 to 100. How often is a fact
about the gear and stands in the robot file, as ``transmission_periods`` of the joint;
:mod:`truearm.engine.fit.transmission` finds it in what a fit leaves over. A gear whose other wheels err too, or whose
error is no sine, has several numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    """Parameters ``transmission_sin_i`` and ``transmission_cos_i`` [rad] of joints whose gear is known.

    Those of further numbers of periods have the number in their names: ``transmission_sin400_3``.
    """

    name: ClassVar[str] = "transmission-error"
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Sine and cosine of each joint and its known numbers of periods."""
        return tuple(
            self.parameter(name, "rad", _PRIOR) for _, _, sine, cosine in self._geared() for name in (sine, cosine)
        )

    def shapes(self, at: Postures) -> Rates:
        """Return the sines and cosines of the joint positions times the periods in a turn."""
        shapes = {}
        for i, periods, sine, cosine in self._geared():
            shapes[sine] = {i: np.sin(periods * at.joints[:, i])}
            shapes[cosine] = {i: np.cos(periods * at.joints[:, i])}
        return shapes

    def _geared(self) -> Iterator[tuple[int, int, str, str]]:
        for i, known in enumerate(self.layout.transmission_periods):
            yield from ((i, *line) for line in transmission_names(known, i + 1))


def transmission_names(periods: Sequence[int], number: int) -> Iterator[tuple[int, str, str]]:
    """Return each number of periods of a joint and the names of its sine and cosine; `number` from 1."""
    for place, k in enumerate(periods):
        mark = str(k) if place else ""  # robot files had only one
        yield k, f"transmission_sin{mark}_{number}", f"transmission_cos{mark}_{number}"
