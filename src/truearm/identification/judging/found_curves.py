"""The curves of the joints that a fit found: how large, how often they err, and how well each angle is known."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.effects.joint_curve import HIGHEST, curve_names, curve_waves

#: Angles without a training configuration that are wider than this are outside the measured range [rad].
_GAP: Final = math.radians(20.0)
#: Steps of a grid on which a curve is looked at [rad]: a twelfth of the shortest period.
_STEP: Final = math.radians(0.5)
#: A neighbour belongs to a group of periods if its square is at least this share of the group's largest.
_BELONGS: Final = 0.5
#: Groups of periods that are told.
_GROUPS: Final = 3
#: Curves smaller than this everywhere are none [rad].
_NOTHING: Final = 1e-9


@dataclass(frozen=True)
class Periods:
    """Neighbouring numbers of periods in a turn at which a curve is strong."""

    lowest: int  #: lowest, highest: periods in a turn, both included.
    highest: int
    amplitude: float  #: Root of the sum of the squares of their amplitudes [rad].

    @property
    def range(self) -> str:
        """Such as ``1`` or ``19 to 22``."""
        return f"{self.lowest}" if self.lowest == self.highest else f"{self.lowest} to {self.highest}"


@dataclass(frozen=True, eq=False)
class FoundCurve:
    """The curve of one joint, as a fit found it."""

    number: int  #: Of the joint, from 1.
    name: str  #: Of the joint.
    amounts: Array  #: Sine and cosine of 1, 2 .. periods in turns [rad], ``(2 periods,)``.
    covariance: Array  #: Of them [rad^2], ``(2 periods, 2 periods)``.
    #: From where to where the joint is looked at [rad]: its limits, or one turn where they are wider or there are none.
    shown: tuple[float, float]
    #: Where it was in the training part [rad], in order, ``(n,)``; moved by whole turns into `shown` if that is one.
    places: Array

    @property
    def whole_turn(self) -> bool:
        """Whether the last angle that is looked at is the first one again."""
        return self.shown[1] - self.shown[0] > 2.0 * math.pi - 1e-9

    @cached_property
    def angles(self) -> Array:
        """Angles on which the curve is looked at [rad], ``(n,)``."""
        return np.linspace(*self.shown, max(2, math.ceil((self.shown[1] - self.shown[0]) / _STEP) + 1))

    def at(self, angles: Array) -> tuple[Array, Array]:
        """Return the curve and its standard deviation [rad] at angles ``(n,)``, each ``(n,)``."""
        waves = curve_waves(np.asarray(angles, float), len(self.amounts) // 2)
        variance = np.sum(waves * (self.covariance @ waves), axis=0)
        return np.asarray(self.amounts @ waves), np.sqrt(np.maximum(variance, 0.0))

    @cached_property
    def measured(self) -> tuple[tuple[float, float], ...]:
        """The ranges in which there are training configurations [rad], in order; gaps of 20 deg part them."""
        if not len(self.places):
            return ()
        ends = np.flatnonzero(np.diff(self.places) > _GAP)
        first, last = self.places[[0, *(ends + 1)]], self.places[[*ends, -1]]
        low, high = self.shown
        if self.whole_turn and self.places[0] + high - low - self.places[-1] <= _GAP:  # across the end of the turn
            first, last = np.r_[low, first[1:]], np.r_[last[:-1], high]
        return tuple(zip(first.tolist(), last.tolist(), strict=True))

    @cached_property
    def rms(self) -> float:
        """Root mean square about its mean in the measured ranges [rad]; in all that is shown if there are none."""
        return float(np.std(self.at(self._looked_at)[0]))

    @cached_property
    def rms_deviation(self) -> float:
        """Standard deviation of the root mean square [rad], by its derivatives."""
        waves = curve_waves(self._looked_at, len(self.amounts) // 2)
        waves -= waves.mean(axis=1, keepdims=True)
        slope = waves @ (self.amounts @ waves) / (waves.shape[1] * max(self.rms, _NOTHING))
        return math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))

    @cached_property
    def _looked_at(self) -> Array:
        inside = np.zeros(len(self.angles), dtype=bool)
        for low, high in self.measured:
            inside |= (self.angles >= low) & (self.angles <= high)
        return self.angles[inside] if inside.any() else self.angles

    @cached_property
    def strongest(self) -> tuple[Periods, ...]:
        """Where it is strong, the strongest first; neighbours share what a range shorter than a turn cannot part."""
        squares = self.amounts[0::2] ** 2 + self.amounts[1::2] ** 2
        left = squares.copy()
        groups: list[Periods] = []
        while len(groups) < _GROUPS and left.max() > 0.01 * squares.max():
            top = low = high = int(np.argmax(left))
            while low > 0 and left[low - 1] > _BELONGS * left[top]:
                low -= 1
            while high + 1 < len(left) and left[high + 1] > _BELONGS * left[top]:
                high += 1
            groups.append(Periods(low + 1, high + 1, math.sqrt(float(left[low : high + 1].sum()))))
            left[low : high + 1] = 0.0
        return tuple(groups)


def found_curves(fit: Fit, training: Dataset) -> tuple[FoundCurve, ...]:
    """Return the curves that a fit found, joint by joint; none of joints whose curve is zero.

    Args:
        training: The readings that it was made from.
    """
    return tuple(_curves(fit, training))


def _curves(fit: Fit, training: Dataset) -> Iterator[FoundCurve]:
    place = {name: i for i, name in enumerate((*fit.free.names, *fit.unfitted))}
    uncertain = fit.covariance_with_unfitted
    for number, joint in enumerate(fit.robot.joints, 1):
        names = curve_names(number)
        known = [i for i, name in enumerate(names) if name in place]
        if not known:
            continue
        amounts = np.array([fit.robot.values[name] for name in names])
        if not (np.abs(amounts) > _NOTHING).any():
            continue
        covariance, rows = np.zeros((2 * HIGHEST, 2 * HIGHEST)), [place[names[i]] for i in known]
        covariance[np.ix_(known, known)] = uncertain[np.ix_(rows, rows)]
        turn = 2.0 * math.pi
        shown = joint.limits
        places = training.joints[:, number - 1]
        if shown is None or shown[1] - shown[0] >= turn:
            shown = (-math.pi, math.pi)
            places = (places + math.pi) % turn - math.pi
        else:
            shown = (min(shown[0], float(places.min())), max(shown[1], float(places.max())))
        yield FoundCurve(number, joint.name, amounts, covariance, shown, np.sort(places))
