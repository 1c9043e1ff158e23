"""Joint gain: the joint turns by k1 times its joint position (Nubiola, section 1.3.1: k1 theta + k0).

The offset k0 is no effect: it is the value of the joint's own element, ``theta_offset_i``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures


@dataclass(frozen=True)
class Gain(LinearEffect):
    """Parameters ``gain_i``, 1 for a perfect joint."""

    name: ClassVar[str] = "gain"
    kinematic: ClassVar[bool] = True
    selectable: ClassVar[bool] = False
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One gain a joint, believed to be good for 1 in 1000."""
        return tuple(self.parameter(f"gain_{i + 1}", "1", 1e-3, nominal=1.0) for i in self.layout.joints)

    def shapes(self, at: Postures) -> Rates:
        """Return the joint positions."""
        return {f"gain_{i + 1}": {i: at.joints[:, i]} for i in self.layout.joints}
