"""Bearing compliance: the load tilts a joint across its axis, in proportion to the moment that its bearings carry.

Stiffer than about the axis, but it acts on every joint, and on a vertical first axis under gravity too. The tilts are
those of :mod:`truearm.engine.robot.effects.clearance`, right behind the joint's own turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures


@dataclass(frozen=True)
class BearingCompliance(LinearEffect):
    """Parameters ``bearing_compliance_i`` [rad/(N m)], alike about x and y."""

    name: ClassVar[str] = "bearing-compliance"
    loaded: ClassVar[bool] = True
    part_of: ClassVar[str] = Compliance.name
    tilts: ClassVar[bool] = True
    non_negative: ClassVar[bool] = True
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One a turning joint."""
        return tuple(self.parameter(f"bearing_compliance_{i + 1}", "rad/(N m)", 1e-4) for i in self.layout.turning)

    def shapes(self, at: Postures) -> Rates:
        """Return the moments across the axes."""
        return {
            f"bearing_compliance_{i + 1}": dict(zip(self.layout.tilt(i), at.joint_loads[i, 3:5], strict=True))
            for i in self.layout.turning
        }
