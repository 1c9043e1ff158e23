"""Balancers whose strength is identified: a factor of the force that the robot file states for each.

A balancer acts on the loads (:mod:`truearm.engine.robot.balancers`), whatever the effects of a model are. This effect
makes how strong it really is a parameter. It moves nothing by itself: what joints do under loads tells. Springs age and
gas leaks, so a tenth is believed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import Effect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

_PRIOR: Final = 0.1


@dataclass(frozen=True)
class Balancing(Effect):
    """Parameters ``balancer_i``, 1 for a balancer as the robot file has it."""

    name: ClassVar[str] = "balancer"
    loaded: ClassVar[bool] = True
    non_negative: ClassVar[bool] = True
    selectable: ClassVar[bool] = False
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One factor a balancer of the robot."""
        numbers = range(1, self.layout.balancers + 1)
        return tuple(self.parameter(f"balancer_{i}", "1", _PRIOR, nominal=1.0) for i in numbers)

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return nothing: the loads have it."""
        return {}

    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return nothing: :func:`truearm.engine.robot.parameters.effect_rates` takes it from the other effects."""
        return {}
