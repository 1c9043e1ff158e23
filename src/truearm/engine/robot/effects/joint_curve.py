"""Curve of a joint: what gear, encoder and bearing make it turn beyond its position, as a function of that position.

The curve is a Fourier series of the joint's own angle. An eccentric wheel at the output errs once in a turn, an oval
one twice (Nubiola, section 1.8); teeth, encoders and the strain waves of small gears err more often. No period has to
be known: how much is expected of those of a band beforehand, and so how stiff the curve is against fast changes, a fit
finds from the data, joint by joint (:mod:`truearm.engine.fit.relevance`). Gears that err more than sixty times in a
turn are the business of :mod:`truearm.engine.robot.effects.transmission`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

#: Periods in a turn of the term that errs most often.
HIGHEST: Final = 60
#: Standard deviation of each sine and cosine [rad] until data say better.
PRIOR: Final = 1e-4
#: Configurations that are computed at once, so that a hundred thousand of them fill no memory.
_AT_ONCE: Final = 4096


@dataclass(frozen=True)
class JointCurve(LinearEffect):
    """Parameters ``curve_sin1_i``, ``curve_cos1_i``, ``curve_sin2_i`` and so on [rad], of each turning joint."""

    name: ClassVar[str] = "joint-curve"
    exportable: ClassVar[bool] = True
    selectable: ClassVar[bool] = False

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Sine and cosine of every period of each turning joint."""
        return _parameters_of(tuple(self.layout.turning))

    @cached_property
    def terms(self) -> Mapping[int, tuple[str, ...]]:
        """Names of the parameters of each turning joint (from 0): sine and cosine of 1, 2 .. periods in turns."""
        return {i: curve_names(i + 1) for i in self.layout.turning}

    def shapes(self, at: Postures) -> Rates:
        """Return sines and cosines of multiples of the joint positions."""
        shapes = {}
        for i, names in self.terms.items():
            waves = curve_waves(at.joints[:, i], HIGHEST)
            shapes.update({name: {i: wave} for name, wave in zip(names, waves, strict=True)})
        return shapes

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return the sums of the series of the joints that have one."""
        moved: dict[int, Array] = {}
        for i, names in self.terms.items():
            coefficients = [values[name] for name in names]
            if any(isinstance(amount, np.ndarray) for amount in coefficients):
                amounts = np.concatenate(np.broadcast_arrays(*map(np.atleast_2d, coefficients)), axis=1)
            else:
                amounts = np.array(coefficients)
            used = np.flatnonzero(amounts.reshape(-1, len(names)).any(axis=0))
            if not len(used):
                continue
            highest = int(used[-1]) // 2 + 1
            q, amounts = at.joints[:, i], amounts[..., : 2 * highest]
            parts = [amounts @ curve_waves(q[n : n + _AT_ONCE], highest) for n in range(0, len(q), _AT_ONCE)]
            moved[i] = np.concatenate(parts, axis=-1) if parts else np.zeros((*amounts.shape[:-1], 0))
        return moved


@lru_cache(maxsize=16)
def _parameters_of(turning: tuple[int, ...]) -> tuple[Parameter, ...]:
    """Return the parameters of joints (from 0): hundreds of them, which every robot that is tried with curves has."""
    names = (name for i in turning for name in curve_names(i + 1))
    return tuple(Parameter.plain(name, "rad", JointCurve.name, 0.0, PRIOR) for name in names)


def curve_names(number: int) -> tuple[str, ...]:
    """Return the names of a joint's parameters, sine and cosine of 1, 2 .. periods in turns; `number` from 1."""
    return tuple(f"curve_{part}{k}_{number}" for k in range(1, HIGHEST + 1) for part in ("sin", "cos"))


def curve_waves(angle: Array, highest: int) -> Array:
    """Return sine and cosine of 1, 2 .. `highest` times angles ``(n,)`` [rad] in turns, ``(2 highest, n)``.

    Powers of ``exp(i angle)`` take two functions for all of them. Each round doubles how many there are, so that an
    error of rounding grows with the logarithm of `highest` only.
    """
    powers = np.empty((highest, len(angle)), dtype=complex)
    powers[0].real, powers[0].imag = np.cos(angle), np.sin(angle)
    known = 1
    while known < highest:
        more = min(known, highest - known)
        np.multiply(powers[:more], powers[known - 1], out=powers[known : known + more])
        known += more
    waves = np.empty((2 * highest, len(angle)))
    waves[0::2], waves[1::2] = powers.imag, powers.real
    return waves
