"""Inclinometers on the links: postures in pairs, and by how much readings change between them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures


@dataclass(frozen=True, eq=False)
class Pairs:
    """Postures in pairs, whose readings are compared.

    Attributes
    ----------
    first, second
        ``n`` postures each, with their wrenches.
    """

    first: Postures
    second: Postures

    def __len__(self) -> int:
        return len(self.first)

    def at(self, indices: NDArray[np.intp]) -> Pairs:
        """Return some of them."""
        return Pairs(self.first.at(indices), self.second.at(indices))

    @property
    def in_turn(self) -> Postures:
        """All postures, first and second of each pair in turn, as they are measured."""
        joints, wrench = self.joints_in_turn()
        return Postures(joints, wrench=wrench)

    def joints_in_turn(self) -> tuple[Array, Array]:
        """Return readings ``(2n, joints)`` and wrenches ``(2n, 6)``."""
        wrenches = [np.zeros((len(p), 6)) if p.wrench is None else p.wrench for p in (self.first, self.second)]
        joints = np.stack([self.first.joints, self.second.joints], axis=1)
        return joints.reshape(2 * len(self), -1), np.stack(wrenches, axis=1).reshape(2 * len(self), 6)


@dataclass(frozen=True, eq=False)
class InclinometerReadings:
    """By how much the readings of inclinometers on all links changed from one posture to another.

    Attributes
    ----------
    pairs
        The postures.
    change
        Second reading less first of each axis of each link ``(n, links, 3)`` [rad]; NaN where there is none. Axes and
        readings are those of :func:`truearm.simulation.inclinometer.inclinations`.
    sigma
        Standard deviation of one change [rad]; :func:`deviation_of_change` finds it for an instrument.
    """

    pairs: Pairs
    change: Array
    sigma: float

    def __post_init__(self) -> None:
        shape = (len(self.pairs), self.pairs.first.joints.shape[1], 3)
        if self.change.shape != shape:
            raise InputError(
                "inclinometers read three axes of every link in every pair of postures",
                where="inclinometer readings",
                came=f"an array of shape {self.change.shape}",
                allowed=str(shape),
            )
        if not self.sigma > 0.0:
            raise InputError(
                "changes of inclination need a standard deviation",
                where="inclinometer readings",
                came=f"{self.sigma:g} rad",
                allowed="more than 0",
            )


def deviation_of_change(resolution: float, noise: float = 0.0) -> float:
    """Return the standard deviation of the difference of two readings [rad].

    Rounding to multiples of the resolution spreads a reading evenly over one step (variance ``step^2 / 12``).
    """
    return math.sqrt(2.0 * (resolution**2 / 12.0 + noise**2))
