"""Warm-up: the links grow while the arm warms up during a campaign of which nobody recorded the temperature.

Link lengths approach those of the warm arm as ``1 - warm_up_i exp(-warm_up_rate k)``, k being the number of
configurations since the first. The parameters of the robot are then those of the warm arm. Where the number is not
known, in another session for one, predictions are those of an arm with the share ``warm_up_left`` of the growth still
to come: a calibration sets it to the mean of its session, so that they are of the session's middle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import Effect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

RATE: Final = "warm_up_rate"
#: Share of the growth that is still to come where the number of a configuration is not known. No model frees it.
LEFT: Final = "warm_up_left"
_SESSION: Final = "session"
#: No arm starts this many powers of e away from where it ends; it keeps a stray step of a fit finite.
_LARGEST_POWER: Final = 30.0


@dataclass(frozen=True)
class WarmUp(Effect):
    """Parameters ``warm_up_i`` [1], the growth of link i from cold to warm, ``warm_up_rate`` [1], ``warm_up_left`` [1].

    The rate is that of one configuration: 0.01 if a share of 1/e of the growth is left after a hundred.
    """

    name: ClassVar[str] = "warm-up"
    ordered: ClassVar[bool] = True
    stretches: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """One growth a link that has a length, the rate of all, and what is left of it where no number is known."""
        links = dict.fromkeys(joint for joint, _ in self.layout.lengths)
        growths = (self.parameter(f"warm_up_{i + 1}", "1", 3e-4) for i in links)
        left = Parameter.plain(LEFT, "1", _SESSION, 0.0, 1.0)
        return (*growths, self.parameter(RATE, "1", 0.005, nominal=0.01), left)

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return what the links are shorter than when warm."""
        cold = _left(at, values)
        return {
            self.layout.length(k): -length * cold * np.asarray(values[f"warm_up_{joint + 1}"])
            for k, (joint, length) in enumerate(self.layout.lengths)
        }

    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return how the lengths follow each growth, and the rate where the number is known, else what is left."""
        cold = _left(at, values)
        rates: dict[str, dict[int, Array]] = {RATE: {}, LEFT: {}}
        for k, (joint, length) in enumerate(self.layout.lengths):
            name, variable = f"warm_up_{joint + 1}", self.layout.length(k)
            rates.setdefault(name, {})[variable] = -length * cold
            if at.number is not None:
                rates[RATE][variable] = length * np.asarray(values[name]) * cold * at.number
            else:
                rates[LEFT][variable] = -length * np.asarray(values[name]) * np.ones(len(at))
        return rates


def share_left(number: Array, rate: float | Array) -> Array:
    """Return the share of the growth that is still to come after so many configurations, ``(n,)``."""
    return np.asarray(np.exp(np.minimum(-number * np.asarray(rate), _LARGEST_POWER)))


def _left(at: Postures, values: Mapping[str, float | Array]) -> Array:
    """Return the share of the growth that is still to come at postures."""
    if at.number is None:
        return np.asarray(np.zeros(len(at)) + np.asarray(values[LEFT]))
    return share_left(at.number, values[RATE])
