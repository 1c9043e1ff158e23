"""A run of one joint, seen by a tracker: the circle of a reflector, and how far it is from what was commanded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truearm.measurement.twin import Twin, measure
from truearm.modeling.chain import Array


@dataclass(frozen=True)
class AxisTest:
    """A row of Table 2.3: interval and increment [deg], ranges of the errors [mm, deg], backlash [deg]."""

    low: int
    high: int
    step: int
    tangential: float
    angular: float
    backlash: float


@dataclass(frozen=True)
class Turn:
    """What circle fitting makes of one joint's run, forward and back.

    Attributes
    ----------
    angle
        Commanded [deg], ``(n,)``: forward, then backward.
    error
        Angle about the fitted axis beyond the commanded one, zero where the joint is at zero [deg], ``(n,)``.
    radius
        [mm].
    """

    angle: Array
    error: Array
    radius: float

    @property
    def angular(self) -> float:
        """Range of the angular error [deg]."""
        return float(np.ptp(self.error))

    @property
    def tangential(self) -> float:
        """Range of the tangential error [mm]."""
        return math.radians(self.angular) * self.radius

    @property
    def backlash(self) -> float:
        """How far the joint lags behind, backward minus forward [deg]."""
        forward, backward = np.split(self.error, 2)
        return float(np.mean(backward[::-1] - forward))


def _angles(test: AxisTest) -> Array:
    """Return the commanded angles [deg], forward and then backward."""
    steps = np.arange(-(-test.low // test.step), test.high // test.step + 1) * float(test.step)
    return np.concatenate([steps, steps[::-1]])


def places_of(twin: Twin, number: int, test: AxisTest) -> Array:
    """Return where the reflector is during the run of one joint [m], ``(n, 3)``."""
    joints = np.zeros((len(_angles(test)), 6))
    joints[:, number - 1] = np.radians(_angles(test))
    approach = np.zeros_like(joints)
    approach[:, number - 1] = np.repeat([1.0, -1.0], len(joints) // 2)
    return measure(twin, joints, 0.0, np.random.default_rng(0), approach=approach).position


def turn_of(places: Array, test: AxisTest) -> Turn:
    """Fit a circle to the places of a reflector [m] and compare its angle with the commanded one."""
    angle = _angles(test)
    centred = places - places.mean(axis=0)
    across, along, _ = np.linalg.svd(centred, full_matrices=False)[2]
    x, y = centred @ across, centred @ along
    solved = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2)[0]
    turned = np.degrees(np.unwrap(np.arctan2(y - solved[1], x - solved[0])))
    turned *= np.sign(np.polyfit(angle, turned, 1)[0])
    error = turned - angle
    radius = math.sqrt(solved[2] + solved[0] ** 2 + solved[1] ** 2)
    return Turn(angle, error - error[angle == 0.0].mean(), radius * 1e3)


def run_out(turn: Turn, test: AxisTest) -> tuple[float, float]:
    """Return amplitude [deg] and phase [rad] of the smallest sine a turn that leaves the printed range and backlash.

    Parameters
    ----------
    turn
        What compliance and noise do.
    """
    at = np.radians(turn.angle)
    lagging = turn.error + np.repeat([-0.5, 0.5], len(at) // 2) * test.backlash
    amplitudes, phases = np.arange(0.0, 0.2, 0.001), np.radians(np.arange(0, 360, 15))
    found = []
    for phase in phases.tolist():
        ranges = np.ptp(lagging + amplitudes[:, None] * np.sin(at + phase), axis=1)
        passed = np.flatnonzero(np.sign(ranges - test.angular) != np.sign(ranges[0] - test.angular))
        if len(passed):
            found.append((float(amplitudes[passed[0]]), phase))
    return min(found)
