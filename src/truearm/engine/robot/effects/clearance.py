"""Clearance tilt: the load lays a joint's shaft askew in its bearings (Patel, 4.11-4.13 and 5.15-5.18).

The shaft tilts by the angle C from the middle, about the direction of the moment across the axis. With the contact
angle gamma = atan2(|M_x|, |M_y|) the length of the bearing cancels from the document's formulas:
``tilt_x = sign(M_x) tan C sin(gamma) / sqrt(1 + tan^2 C sin^2 gamma)``, and with the cosine for y. Both tilts follow
right behind the joint's own turn, in whose frame the moments are expressed. Where hardly a moment lies across the axis,
the shaft stands in between, smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import Effect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

#: The moment across the axis at which three quarters of the tilt are reached [N m]; bearings hold less than gears.
SEATED: Final = 0.01
_PRIOR: Final = math.radians(0.05)


@dataclass(frozen=True)
class Clearance(Effect):
    """Parameters ``clearance_i`` [rad], the tilt of a turning joint from the middle."""

    name: ClassVar[str] = "clearance"
    loaded: ClassVar[bool] = True
    tilts: ClassVar[bool] = True
    non_negative: ClassVar[bool] = True
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One angle a turning joint."""
        return tuple(self.parameter(f"clearance_{i + 1}", "rad", _PRIOR) for i in self.layout.turning)

    def contact(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return sine and cosine of the contact angle, signed like the moments x and y, as far as it is seated."""
        across = np.hypot(x, y)
        safe = np.where(across > 0.0, across, 1.0)
        seated = np.tanh(across / SEATED)
        return seated * x / safe, seated * y / safe

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return the tilts about x and y."""
        moved = {}
        for i, parts in self._contacts(at).items():
            slope = np.tan(np.asarray(values[f"clearance_{i + 1}"]))
            for variable, part in zip(self.layout.tilt(i), parts, strict=True):
                moved[variable] = slope * part / np.sqrt(1.0 + (slope * part) ** 2)
        return moved

    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return how the tilts grow with the angle."""
        rates = {}
        for i, parts in self._contacts(at).items():
            slope = np.tan(np.asarray(values[f"clearance_{i + 1}"]))
            rates[f"clearance_{i + 1}"] = {
                variable: (1.0 + slope**2) * part / (1.0 + (slope * part) ** 2) ** 1.5
                for variable, part in zip(self.layout.tilt(i), parts, strict=True)
            }
        return rates

    def _contacts(self, at: Postures) -> Mapping[int, tuple[Array, Array]]:
        return {i: self.contact(*at.joint_loads[i, 3:5]) for i in self.layout.turning}
