"""The safe configuration, in which a tour starts and ends."""

from __future__ import annotations

import math
from itertools import product
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.robot.chain import Array

#: Joint positions that are tried of joints between the first and the last that turn [rad], the sixth at fewer.
_ANGLES: Final = np.deg2rad([-90.0, -45.0, 0.0, 45.0, 90.0])
_FEWER: Final = np.deg2rad([0.0, 90.0])
#: More room than this part of the arm's length makes a configuration no safer.
_ENOUGH: Final = 0.15
#: How far inside its limits a joint rests [rad, or m].
_INSIDE: Final = 0.05
_DRAWN: Final = 600


def safe_configuration(check: CollisionCheck, low: Array, high: Array) -> Array:
    """Return a configuration in which the arm keeps well clear of everything, ``(joints,)`` [rad or m].

    Zero if there is as much room as anywhere; otherwise one at multiples of 45 deg, the nearest to zero of those with
    most room. A joint whose limits do not hold zero rests in the middle of them. If none of these is clear, some that
    are drawn are tried.

    Args:
        low, high: Within which it lies, each ``(joints,)``.

    Raises:
        InputError: If none of them keeps the clearance.
    """
    joints = check.arm.robot.joints
    turning = np.array([joint.kind == "revolute" for joint in joints])
    holds_zero = (low <= -_INSIDE) & (high >= _INSIDE) & turning
    middle = np.where(holds_zero, 0.0, (low + high) / 2.0)
    tried = [k for k in range(1, min(6, len(low))) if turning[k]]
    grid = np.array([*product(*(_FEWER if k == 5 else _ANGLES for k in tried))], ndmin=2)
    within = (grid >= (low + _INSIDE)[tried]) & (grid <= (high - _INSIDE)[tried])
    at = np.tile(middle, (len(grid) + 1, 1))
    at[1:, tried] = np.where(within, grid, middle[tried])
    best, distance = _best(check, at, middle)
    if distance < check.need:
        drawn = np.random.default_rng(0).uniform(low, high, (_DRAWN, len(low)))
        other, more = _best(check, drawn, middle)
        if more > distance:
            best, distance = other, more
    if distance < check.need:
        number = int(np.argmin(check.distances(best[None])[:, 0]))
        raise InputError(
            "no configuration was found in which the arm keeps clear, to start and to end in",
            parameter="clearance",
            came=f"{len(at) + _DRAWN} tried; in the best of them {check.words(number)}",
            allowed=f"{check.cell.clearance * 1e3:g} mm of room to everything",
            cure="See that limits, floor and boxes leave the arm room; lower `clearance`, or give one (`home`).",
        )
    return best


def _best(check: CollisionCheck, at: Array, middle: Array) -> tuple[Array, float]:
    """Return the configuration farthest from everything, the nearest to the middle of those, and its distance [m]."""
    distance = check.smallest_distance(at)
    enough = np.minimum(distance, max(_ENOUGH * float(check.arm.along[check.arm.flange]), check.need))
    away = np.abs(at - middle).sum(axis=1)
    # To a millimetre, so that the nearest of many at the same distance does not depend on the last digit.
    best = int(np.lexsort((np.arange(len(at)), away.round(6), -(enough / 1e-3).round()))[0])
    return np.asarray(at[best]), float(distance[best])


def checked_home(check: CollisionCheck, home: Array, low: Array, high: Array) -> Array:
    """Return a safe configuration that was given, or refuse it.

    Raises:
        InputError: If a joint is beyond its limits, or on another turn, or the arm does not keep the clearance there.
    """
    for k, joint in enumerate(check.arm.robot.joints):
        if not low[k] - 1e-9 <= home[k] <= high[k] + 1e-9:
            unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
            raise InputError(
                f"joint {k + 1} of the safe configuration is not where the plan keeps it",
                parameter="home",
                came=f"{size * home[k]:.6g} {unit}",
                allowed=f"{size * low[k]:.6g} to {size * high[k]:.6g} {unit}",
                cure="Name it on the same turn, or leave it out: one is found.",
            )
    distances = check.distances(home[None])[:, 0]
    if distances.min(initial=np.inf) < check.cell.clearance:
        number = int(np.argmin(distances))
        raise InputError(
            "the safe configuration is not clear",
            parameter="home",
            came=f"{check.words(number)}: {max(distances[number], 0.0) * 1e3:.1f} mm",
            allowed=f"{check.cell.clearance * 1e3:g} mm or more",
            cure="Name another one, or leave it out: one is found. `clearance` says how much room is kept.",
        )
    return home
