"""What a joint of the digital twin does besides following its commanded position."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from truearm.engine.robot.chain import Array

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
    """

    #: compliance, quadratic, cubic: deflection per load M, per M|M| and per M^3 [rad/(N m)] and so on; hardening is
    #: negative.
    compliance: float = 0.0
    quadratic: float = 0.0
    cubic: float = 0.0
    #: What a dial shows when the load changes its sign, the full gap [rad]: half of it on either side (Patel, equation
    #: 5.19, whose text measures the gap by such a reversal).
    backlash: float = 0.0
    clearance: float = 0.0  #: How far the shaft can tilt in its housing from the middle [rad] (Patel, equation 4.11).
    bearing: float = 0.0  #: Tilt of the shaft per moment across the axis [rad/(N m)]: bearings that give way.
    #: Run-out of the gear: harmonic (1 for one sine a turn), amplitude [rad] and phase [rad] of each sine.
    gear: tuple[tuple[int, float, float], ...] = ()
    #: Errors that rise and fall in straight lines: periods in a turn, amplitude and phase [rad] of each triangle.
    teeth: tuple[tuple[int, float, float], ...] = ()
    #: Places of a turn at which something is worn or dirty: middle [rad], half of its width [rad], height [rad].
    bumps: tuple[tuple[float, float, float], ...] = ()
    #: What the joint turns too far [rad] when its last move was forward, and too little when it was backward.
    hysteresis: float = 0.0
    #: Turn of the arm about x, y and z of the joint [rad] per x, y and z of the direction in which gravity falls: a row
    #: for each axis turned about; empty where nothing bends.
    bending: tuple[tuple[float, float, float], ...] = ()
    #: Links further out that turn the joint by their weight, from 1: what the joint turns [rad] for their first moments
    #: along x, y and z of the joint before the link.
    moments: tuple[tuple[int, float, float, float], ...] = ()
    #: How far the axis is carried along x, y and z of the joint before its turn [m]: sine and cosine of the position
    #: for each; empty where it stays.
    run_out: tuple[tuple[float, float], ...] = ()
    growth: float = 0.0  #: Thermal growth of the lengths of the link behind the joint [1/K].
    warm_up: float = 0.0  #: Share by which those lengths are shorter when a campaign begins than when the arm is warm.

    def turn(self, position: Array | float, approach: Array | float, load: Array | float) -> Array:
        """Return what the joint turns, or slides, beyond its commanded positions ``(n,)`` [rad or m].

        Args:
            position: [rad or m], ``(n,)``.
            approach: Direction of the last move, +1 or -1, 0 if it is not known, ``(n,)``.
            load: Moment about the axis [N m], or force along it [N], ``(n,)``.
        """
        geared = sum((amplitude * np.sin(k * position + phase) for k, amplitude, phase in self.gear), np.zeros(()))
        geared = sum((size * _triangle(k * position + phase) for k, size, phase in self.teeth), geared)
        geared = sum((height * _bump(position - middle, half) for middle, half, height in self.bumps), geared)
        sprung = self.compliance * load + self.quadratic * load * np.abs(load) + self.cubic * load**3
        return np.asarray(geared + self.hysteresis * approach + sprung + self.backlash / 2 * _sign(load))

    def tilt(self, x: Array | float, y: Array | float, contact: Contact) -> tuple[Array, Array]:
        """Return how the shaft leans about x and y of the joint [rad] under the moments about them [N m], ``(n,)``.

        Source: Patel, equations 5.16 to 5.18, with radius ``(L/2) tan C`` and a sign (his 5.15 is inverted, and the
        shaft's length L cancels).
        """
        if not self.clearance:
            return np.asarray(self.bearing * x), np.asarray(self.bearing * y)
        if contact == "exact":
            gamma = np.arctan2(np.abs(x), np.abs(y))
        else:
            gamma = np.pi / 2 * np.abs(x) / np.maximum(np.abs(x) + np.abs(y), _NO_LOAD)
        across, along = math.tan(self.clearance) * np.sin(gamma), math.tan(self.clearance) * np.cos(gamma)
        laid_x, laid_y = _sign(x) * across / np.hypot(1.0, across), _sign(y) * along / np.hypot(1.0, along)
        return laid_x + self.bearing * x, laid_y + self.bearing * y

    def bent(self, fall: Array) -> Array:
        """Return what the arm turns about x, y and z of the joint [rad] as gravity falls along ``(n, 3)``."""
        about = [sum(row[k] * fall[:, k] for k in range(3)) for row in self.bending]
        return np.stack(about, axis=1) if about else np.zeros(fall.shape)

    def hung(self, pulls: Array) -> Array:
        """Return what weights of links turn the joint by [rad], ``(n,)``, from pulls on it ``(n, joints, 3)``."""
        return sum((pulls[:, link - 1] @ np.array(moment) for link, *moment in self.moments), np.zeros(len(pulls)))

    def carried_aside(self, position: Array) -> Array:
        """Return how far the axis is carried along x, y and z ``(n, 3)`` [m] at positions ``(n,)``."""
        circles = [math.hypot(s, c) * np.sin(position + math.atan2(c, s)) for s, c in self.run_out]
        return np.stack(circles, axis=1) if circles else np.zeros((len(position), 3))


#: Follows its commanded position and nothing else.
PERFECT: Final = JointTruth()


def _triangle(angle: Array | float) -> Array:
    """Return a wave between -1 and 1 of straight lines, 0 and rising at 0, like the sine."""
    return np.asarray(2.0 / np.pi * np.arcsin(np.clip(np.sin(angle), -1.0, 1.0)))


def _bump(angle: Array | float, half: float) -> Array:
    """Return 1 in the middle of a place of the turn, 0 beyond half of its width, and an arc of a cosine between."""
    away = np.abs(angle - 2.0 * np.pi * np.round(np.asarray(angle) / (2.0 * np.pi))) / half
    return np.asarray(np.where(away < 1.0, 0.5 * (1.0 + np.cos(np.pi * away)), 0.0))


def _sign(load: Array | float) -> Array:
    return np.where(np.abs(load) < _NO_LOAD, 0.0, np.copysign(1.0, load))
