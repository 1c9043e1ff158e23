"""Find gears that err periodically, in what a fit leaves over.

The residuals of each joint are held against sines of its readings, one number of periods in a turn after the other: a
periodogram on readings at uneven places (Lomb 1976, "Least-squares frequency analysis of unequally spaced data").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.notices import Notice

#: Periods in a turn that are looked at; fewer than the first are the Fourier series' business.
_PERIODS: Final = np.arange(20, 401)
#: A periodic error is believed if chance would show one as strong in any joint less often than this.
_CHANCE: Final = 1e-3
_FEWEST: Final = 60  # configurations


@dataclass(frozen=True)
class PeriodicError:
    """A joint's residual that repeats.

    Attributes
    ----------
    joint
        Number of the joint, from 1.
    periods
        In a turn of the joint.
    amplitude
        Of the sine [rad].
    share
        Of the squared residuals that it explains.
    chance
        Probability that noise alone shows one as strong anywhere.
    """

    joint: int
    periods: int
    amplitude: float
    share: float
    chance: float


def periodic_errors(fit: Fit, data: Dataset) -> tuple[PeriodicError, ...]:
    """Return the periodic errors of joints whose gear the robot file does not describe, one a joint at most.

    Parameters
    ----------
    fit
        What is left over is seen from it.
    data
        The readings it is held against; fewer than 60 configurations say nothing.
    """
    robot = fit.robot
    if data.configurations < _FEWEST:
        return ()
    at = robot.loaded(data.postures)
    count = len(robot.joints)
    # Of each configuration, over its position readings: J'r and J'J of each joint, r'r, and how many there are.
    pull, weight, left, readings = (np.zeros(shape) for shape in ((count, len(at)), (count, len(at)), len(at), len(at)))
    for index, name in enumerate(data.targets):
        mine = np.flatnonzero((data.target == index) & data.has_position)
        where = data.configuration[mine]
        sweep = robot.sweep(at, name)
        rate = sweep.linear(robot.moving[:count])[..., where]
        residual = data.position[mine].T - sweep.position[:, where]
        np.add.at(pull.T, where, (rate * residual).sum(1).T)
        np.add.at(weight.T, where, (rate**2).sum(1).T)
        np.add.at(left, where, (residual**2).sum(0))
        np.add.at(readings, where, 1.0)
    # The targets of a configuration share its errors, so that it counts as one reading of three coordinates.
    seen = int((readings > 0).sum())
    found = []
    for joint in range(count):
        if robot.joints[joint].kind != "revolute" or robot.joints[joint].transmission_periods is not None:
            continue
        share, amplitude = _periodogram(at.joints[:, joint], pull[joint], weight[joint], float(left.sum()))
        best = int(np.argmax(share))
        chance = count * len(_PERIODS) * float(np.exp(-0.5 * (3 * seen - len(fit.free.names) + 0.0) * share[best]))
        if chance < _CHANCE:
            found.append(
                PeriodicError(joint + 1, int(_PERIODS[best]), float(amplitude[best]), float(share[best]), chance)
            )
    return tuple(found)


def _periodogram(q: Array, pull: Array, weight: Array, left: float) -> tuple[Array, Array]:
    """Return the share of the squared residuals that a sine explains and its amplitude, by number of periods."""
    angle = _PERIODS[:, None] * q
    s, c = np.sin(angle), np.cos(angle)
    ss, sc, cc = (s * s) @ weight, (s * c) @ weight, (c * c) @ weight
    ys, yc = s @ pull, c @ pull
    safe = np.maximum(ss * cc - sc * sc, 1e-12 * (ss + cc) ** 2 + 1e-300)
    a, b = (cc * ys - sc * yc) / safe, (ss * yc - sc * ys) / safe
    return (a * ys + b * yc) / max(left, 1e-300), np.hypot(a, b)


def check_transmission(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if some joints err periodically."""
    found = periodic_errors(fit, data)
    if not found:
        return []
    told = "; ".join(
        f"joint {error.joint} {error.periods} times in a turn, by {np.rad2deg(error.amplitude) * 1e3:.1f} millidegrees"
        for error in found
    )
    return [
        Notice(
            "transmission-error",
            f"What is left over repeats with the joints' angles: {told}. Strain wave gears do that, twice in a turn of "
            "their wave generator. Write transmission_periods to these joints in the robot file, and --model auto "
            "will try to take the error out.",
        )
    ]
