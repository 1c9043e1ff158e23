"""Approach direction: friction stops a joint short of where it was sent, on the side it came from (hysteresis)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

_PRIOR: Final = math.radians(0.02)


@dataclass(frozen=True)
class Approach(LinearEffect):
    """Parameters ``approach_i`` [rad, m]: what is added to a joint that was reached moving forward."""

    name: ClassVar[str] = "approach"
    ordered: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One a joint."""
        return tuple(
            self.parameter(f"approach_{i + 1}", "rad", _PRIOR)
            if self.layout.kinds[i] == "revolute"
            else self.parameter(f"approach_{i + 1}", "m", 1e-4)
            for i in self.layout.joints
        )

    def shapes(self, at: Postures) -> Rates:
        """Return the signs of the last moves; nothing where they are not known."""
        if at.approach is None:
            return {}
        return {f"approach_{i + 1}": {i: at.approach[:, i]} for i in self.layout.joints}
