"""Hardening stiffness: gears and bearings give way more to the first newton metres than to the last.

What is added to the linear compliance: c2 M |M| + c3 M^3, odd in the moment M, with c2 negative where the joint
hardens.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.effect import LinearEffect, Rates, effort
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures


@dataclass(frozen=True)
class Hardening(LinearEffect):
    """Parameters ``compliance_quadratic_i`` [rad/(N m)^2] and ``compliance_cubic_i`` [rad/(N m)^3]."""

    name: ClassVar[str] = "hardening"
    loaded: ClassVar[bool] = True
    part_of: ClassVar[str] = Compliance.name
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Two a turning joint."""
        return tuple(
            plain
            for i in self.layout.turning
            for plain in (
                self.parameter(f"compliance_quadratic_{i + 1}", "rad/(N m)^2", 3e-5),
                self.parameter(f"compliance_cubic_{i + 1}", "rad/(N m)^3", 3e-7),
            )
        )

    def shapes(self, at: Postures) -> Rates:
        """Return the square, with its sign, and the cube of the moments."""
        shapes = {}
        for i in self.layout.turning:
            moment = effort(at, self.layout, i)
            shapes[f"compliance_quadratic_{i + 1}"] = {i: moment * np.abs(moment)}
            shapes[f"compliance_cubic_{i + 1}"] = {i: moment**3}
        return shapes
