"""Run-out: the axis of a turning joint moves sideways and along itself, once in a turn of the joint.

A race that is askew or oval, a preload that is not even: the line about which the joint turns is not quite the same at
each of its angles. The part of these error motions that comes once in a turn (ISO 230-7: radial and axial error motion)
is an ellipse of some hundredths of a millimetre. Of every ellipse across the axis a circle that goes round with the
joint is no error of the axis, but an offset of what stands on it: priors share that with the geometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

_PARTS: Final = ("sin", "cos")
_PRIOR: Final = 2e-5


@dataclass(frozen=True)
class RunOut(LinearEffect):
    """Parameters ``run_out_x_sin_i``, ``run_out_x_cos_i`` and so on [m], of x, y and z of each turning joint.

    They are the joint's own axes before it turns: z along its axis, x and y across it. All behind the joint is carried
    along. The angle is the joint position.
    """

    name: ClassVar[str] = "run-out"
    shifts: ClassVar[bool] = True
    selectable: ClassVar[bool] = False
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Sine and cosine along each axis of each turning joint."""
        return tuple(self.parameter(name, "m", _PRIOR) for i in self.layout.turning for name in run_out_names(i + 1))

    def shapes(self, at: Postures) -> Rates:
        """Return sine and cosine of the joint positions."""
        found: dict[str, dict[int, Array]] = {}
        for i in self.layout.turning:
            waves = np.sin(at.joints[:, i]), np.cos(at.joints[:, i])
            terms = ((variable, wave) for variable in self.layout.shift(i) for wave in waves)
            found |= {
                name: {variable: wave} for name, (variable, wave) in zip(run_out_names(i + 1), terms, strict=True)
            }
        return found


def run_out_names(number: int) -> tuple[str, ...]:
    """Return the names of a joint's parameters: sine and cosine along x, along y, along z; `number` from 1."""
    return tuple(f"run_out_{axis}_{part}_{number}" for axis in "xyz" for part in _PARTS)
