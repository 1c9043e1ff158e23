"""What a joint of the digital twin does besides following its commanded position."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

#: Loads below this [N or N m] are rounding: no shaft leans on its housing for them.
_NO_LOAD: Final = 1e-9

#: How the point where a shaft touches its housing follows from the moments: by their direction, or as printed in
#: Patel, equation 5.16, which is up to 4 deg off.
Contact = Literal["exact", "document"]


@dataclass(frozen=True)
class JointTruth:
    """The truth about one joint and the link behind it.

    Loads are moments about the joint's axis [N m], or forces along it [N] for a prismatic joint, which then deflects
    in metres.

    Attributes
    ----------
    compliance, quadratic, cubic
        Deflection per load M, per M|M| and per M^3 [rad/(N m)] and so on; hardening is negative.
    backlash
        What a dial shows when the load changes its sign, the full gap [rad]: half of it on either side
        (Patel, equation 5.19, whose text measures the gap by such a reversal).
    clearance
        How far the shaft can tilt in its housing from the middle [rad] (Patel, equation 4.11).
    gear
        Run-out of the gear: harmonic (1 for one sine a turn), amplitude [rad] and phase [rad] of each sine.
    teeth
        Errors that rise and fall in straight lines: periods in a turn, amplitude and phase [rad] of each triangle.
    bumps
        Places of a turn at which something is worn or dirty: middle [rad], half of its width [rad], height [rad].
    bearing
        Tilt of the shaft per moment across the axis [rad/(N m)]: bearings that give way.
    hysteresis
        What the joint turns too far [rad] when its last move was forward, and too little when it was backward.
    growth
        Thermal growth of the lengths of the link behind the joint [1/K].
    warm_up
        Share by which those lengths are shorter when a campaign begins than when the arm is warm.
    """

    compliance: float = 0.0
    quadratic: float = 0.0
    cubic: float = 0.0
    backlash: float = 0.0
    clearance: float = 0.0
    bearing: float = 0.0
    gear: tuple[tuple[int, float, float], ...] = ()
    teeth: tuple[tuple[int, float, float], ...] = ()
    bumps: tuple[tuple[float, float, float], ...] = ()
    hysteresis: float = 0.0
    growth: float = 0.0
    warm_up: float = 0.0

    def turn(self, position: float, approach: float, load: float) -> float:
        """Return what the joint turns, or slides, beyond its commanded position [rad or m].

        Parameters
        ----------
        position
            [rad or m].
        approach
            Direction of the last move, +1 or -1, 0 if it is not known.
        load
            Moment about the axis [N m], or force along it [N].
        """
        geared = sum(amplitude * math.sin(k * position + phase) for k, amplitude, phase in self.gear)
        geared += sum(amplitude * _triangle(k * position + phase) for k, amplitude, phase in self.teeth)
        geared += sum(height * _bump(position - middle, half) for middle, half, height in self.bumps)
        sprung = self.compliance * load + self.quadratic * load * abs(load) + self.cubic * load**3
        return geared + self.hysteresis * approach + sprung + self.backlash / 2 * _sign(load)

    def tilt(self, x: float, y: float, contact: Contact) -> tuple[float, float]:
        """Return how the shaft leans about x and y of the joint [rad] under the moments about them [N m].

        Source: Patel, equations 5.16 to 5.18, with radius ``(L/2) tan C`` and a sign (his 5.15 is inverted, and the
        shaft's length L cancels).
        """
        sign_x, sign_y = _sign(x), _sign(y)
        if not (self.clearance and (sign_x or sign_y)):
            return self.bearing * x, self.bearing * y
        if contact == "exact":
            gamma = math.atan2(abs(x), abs(y))
        else:
            gamma = math.pi / 2 * abs(x) / (abs(x) + abs(y))
        across, along = math.tan(self.clearance) * math.sin(gamma), math.tan(self.clearance) * math.cos(gamma)
        laid_x, laid_y = sign_x * across / math.hypot(1.0, across), sign_y * along / math.hypot(1.0, along)
        return laid_x + self.bearing * x, laid_y + self.bearing * y


#: Follows its commanded position and nothing else.
PERFECT: Final = JointTruth()


def _triangle(angle: float) -> float:
    """Return a wave between -1 and 1 of straight lines, 0 and rising at 0, like the sine."""
    return 2.0 / math.pi * math.asin(max(-1.0, min(1.0, math.sin(angle))))


def _bump(angle: float, half: float) -> float:
    """Return 1 in the middle of a place of the turn, 0 beyond half of its width, and an arc of a cosine between."""
    away = abs(math.remainder(angle, 2.0 * math.pi)) / half
    return 0.5 * (1.0 + math.cos(math.pi * away)) if away < 1.0 else 0.0


def _sign(load: float) -> float:
    return 0.0 if abs(load) < _NO_LOAD else math.copysign(1.0, load)
