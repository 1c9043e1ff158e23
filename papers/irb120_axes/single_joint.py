"""A run of one joint, seen by a tracker: the circle of a reflector, and how far it is from what was commanded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truearm.axis_circles import fit as turns
from truearm.engine.data.circles import fit_circle
from truearm.engine.robot.chain import Array
from truearm.engine.twin.twin import Twin, measure


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
    """What circle fitting makes of one joint's run, forward and back, in the document's units."""

    angle: Array  #: Commanded [deg], ``(n,)``: forward, then backward.
    #: Angle about the fitted axis beyond the commanded one, zero where the joint is at zero [deg], ``(n,)``.
    error: Array
    radius: float  #: [mm].
    angular: float  #: angular, tangential: range of the angular error [deg] and of the tangential one [mm].
    tangential: float
    backlash: float  #: How far the joint lags behind, backward minus forward [deg].


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
    turned = turns.turn_of(fit_circle(places), np.radians(angle), np.repeat([1.0, -1.0], len(angle) // 2))
    error = np.degrees(turned.error)
    return Turn(
        angle=angle,
        error=error - error[angle == 0.0].mean(),
        radius=turned.circle.radius * 1e3,
        angular=math.degrees(turned.angular),
        tangential=turned.tangential * 1e3,
        backlash=math.degrees(turned.backlash or 0.0),
    )


@dataclass(frozen=True)
class RunOut:
    """A sine a turn by which a gear runs out."""

    amplitude: float  #: [deg].
    phase: float  #: [rad].


def run_out(turn: Turn, test: AxisTest) -> RunOut:
    """Return the smallest sine a turn that leaves the printed range and backlash; none if no sine does.

    Args:
        turn: What compliance and noise do.
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
    # Noise alone may make more than the printed range already.
    return RunOut(*min(found, default=(0.0, 0.0)))
