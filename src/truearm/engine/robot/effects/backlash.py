"""Backlash: the load pushes a joint to one end of its play (Patel, 4.10 and 5.19).

``backlash_i`` is the whole play, what a dial shows when the load is reversed; the joint lies half of it from the
middle. (Equation 5.19 adds the whole, on either side.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.effects.effect import LinearEffect, Rates, effort
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

#: The moment at which three quarters of the play are taken up [N m]: friction holds a joint that nothing pushes.
SEATED: Final = 0.05
_PRIOR: Final = math.radians(0.05)


@dataclass(frozen=True)
class Backlash(LinearEffect):
    """Parameters ``backlash_i`` [rad], the whole play of a turning joint."""

    name: ClassVar[str] = "backlash"
    loaded: ClassVar[bool] = True
    non_negative: ClassVar[bool] = True
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One play a turning joint."""
        return tuple(self.parameter(f"backlash_{i + 1}", "rad", _PRIOR) for i in self.layout.turning)

    def shapes(self, at: Postures) -> Rates:
        """Return half the sign of the moments, smooth where they change sign."""
        return {
            f"backlash_{i + 1}": {i: 0.5 * np.tanh(effort(at, self.layout, i) / SEATED)} for i in self.layout.turning
        }
