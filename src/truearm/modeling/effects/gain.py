"""Joint gain: the joint turns by k1 times its reading (Nubiola, section 1.3.1: k1 theta + k0).

The offset k0 is no effect: it is the value of the joint's own element, ``theta_offset_i``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.effects.effect import Effect


@dataclass(frozen=True)
class Gain(Effect):
    """Parameters ``gain_i``, 1 for a perfect joint."""

    name: ClassVar[str] = "gain"

    @property
    def nominal(self) -> Mapping[str, float]:
        """One gain a joint."""
        return {f"gain_{i + 1}": 1.0 for i in range(len(self.joints))}

    def deflection(self, q: Array, values: Mapping[str, float | Array]) -> Array:
        """Return (k1 - 1) q."""
        turned = [(np.asarray(values[f"gain_{i + 1}"]) - 1.0) * reading for i, reading in enumerate(q)]
        return np.stack(np.broadcast_arrays(*turned))

    def derivative(self, q: Array, values: Mapping[str, float | Array]) -> Mapping[str, Mapping[int, Array]]:
        """Return q."""
        return {f"gain_{i + 1}": {i: reading} for i, reading in enumerate(q)}
