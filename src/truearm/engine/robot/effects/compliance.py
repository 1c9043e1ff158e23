"""Joint compliance: the load turns the joint on, or pushes it (Nubiola, section 2.4.2 and annex I; Patel, 4.15)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from truearm.engine.robot.effects.effect import LinearEffect, Rates, effort
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures


@dataclass(frozen=True)
class Compliance(LinearEffect):
    """Parameters ``compliance_i`` [rad/(N m), m/N], the inverse of a stiffness."""

    name: ClassVar[str] = "compliance"
    loaded: ClassVar[bool] = True
    non_negative: ClassVar[bool] = True
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One compliance a joint."""
        return tuple(
            self.parameter(f"compliance_{i + 1}", "rad/(N m)", 1e-3)
            if self.layout.kinds[i] == "revolute"
            else self.parameter(f"compliance_{i + 1}", "m/N", 1e-5)
            for i in self.layout.joints
        )

    def shapes(self, at: Postures) -> Rates:
        """Return the loads' moments about the axes, and forces along them."""
        return {f"compliance_{i + 1}": {i: effort(at, self.layout, i)} for i in self.layout.joints}
