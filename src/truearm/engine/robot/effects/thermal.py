"""Thermal growth: the lengths of a link grow with its temperature above 20 degC, where lengths are stated (ISO 1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

REFERENCE: Final = 20.0


@dataclass(frozen=True)
class ThermalGrowth(LinearEffect):
    """Parameters ``thermal_growth_i`` [1/K], of every length of link i; about 23e-6 for aluminium, 12e-6 for steel."""

    name: ClassVar[str] = "thermal-growth"
    warmed: ClassVar[bool] = True
    stretches: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One a link that has a length."""
        links = dict.fromkeys(joint for joint, _ in self.layout.lengths)
        return tuple(self.parameter(f"thermal_growth_{i + 1}", "1/K", 3e-5) for i in links)

    def shapes(self, at: Postures) -> Rates:
        """Return length times warming; nothing where the temperature is not known."""
        if at.temperature is None:
            return {}
        shapes: dict[str, dict[int, Array]] = {}
        for number, (joint, length) in enumerate(self.layout.lengths):
            grown = length * (at.temperature - REFERENCE)
            shapes.setdefault(f"thermal_growth_{joint + 1}", {})[self.layout.length(number)] = grown
        return shapes
