"""Warm-up: the links grow while the arm warms up during a campaign of which nobody recorded the temperature.

Link lengths approach those of the warm arm as ``1 - warm_up_i exp(-k / warm_up_pace)``, k being the number of
configurations since the first. The parameters of the robot are then those of the warm arm, and so are predictions
where the number is not known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.effects.effect import Effect, Rates
from truearm.modeling.parameters import Parameter
from truearm.modeling.postures import Postures

PACE = "warm_up_pace"


@dataclass(frozen=True)
class WarmUp(Effect):
    """Parameters ``warm_up_i`` [1], the growth of link i from cold to warm, and ``warm_up_pace`` [configurations]."""

    name: ClassVar[str] = "warm-up"
    ordered: ClassVar[bool] = True
    stretches: ClassVar[bool] = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """One growth a link that has a length, and the pace of all."""
        links = dict.fromkeys(joint for joint, _ in self.layout.lengths)
        growths = (Parameter.plain(f"warm_up_{i + 1}", "1", "warm-up", 0.0, 3e-4) for i in links)
        return (*growths, Parameter.plain(PACE, "1", "warm-up", 100.0, 50.0))

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return what the links are shorter than when warm; nothing where the number is not known."""
        if at.number is None:
            return {}
        cold = np.exp(-at.number / np.asarray(values[PACE]))
        return {
            self.layout.length(k): -length * cold * np.asarray(values[f"warm_up_{joint + 1}"])
            for k, (joint, length) in enumerate(self.layout.lengths)
        }

    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return how the lengths follow each growth and the pace."""
        if at.number is None:
            return {}
        pace = np.asarray(values[PACE])
        cold = np.exp(-at.number / pace)
        rates: dict[str, dict[int, Array]] = {PACE: {}}
        for k, (joint, length) in enumerate(self.layout.lengths):
            name, variable = f"warm_up_{joint + 1}", self.layout.length(k)
            rates.setdefault(name, {})[variable] = -length * cold
            rates[PACE][variable] = -length * np.asarray(values[name]) * cold * at.number / pace**2
        return rates
