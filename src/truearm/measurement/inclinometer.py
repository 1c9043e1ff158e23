"""Inclinometers on the links: what they read of the digital twin, alone and in comparisons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.measurement.twin import Conditions, Twin, measure
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures


def inclinations(
    twin: Twin,
    joints: Array,
    noise: float,
    rng: np.random.Generator,
    resolution: float = 0.0,
    **conditions: Unpack[Conditions],
) -> Array:
    """Return what inclinometers on all links read at joint readings ``(n, joints)``.

    Each link carries one with three sensitive axes along x, y and z of the link's frame (the frame behind the tilt of
    its joint, :attr:`Posture.links`). A reading is the angle of such an axis above the horizontal plane, -pi/2 to
    pi/2: ``asin(-g . axis)`` with the unit vector g along gravity. The direction of gravity in the link's frame is
    therefore ``-sin`` of the three readings. An axis that is horizontal sees a small turn about a horizontal axis
    across it in full; one near the vertical hardly sees it. Differences between configurations are free of how the
    instrument sits on its link as long as the link turns little between them.

    Parameters
    ----------
    noise
        Standard deviation of each reading [rad].
    resolution
        Readings are whole multiples of it [rad], unless it is zero.
    conditions
        See :class:`Conditions`.

    Returns
    -------
    inclinations
        ``(n, links, 3)`` [rad].
    """
    down = np.array(twin.robot.gravity) / np.linalg.norm(twin.robot.gravity)
    links = np.array([posture.links for posture in twin.postures(joints, **conditions)])
    pulled = np.einsum("nlij,i->nlj", links[:, :, :3, :3], down)
    read = np.arcsin(np.clip(-pulled, -1.0, 1.0))
    read = read + rng.normal(0.0, 1.0, read.shape) * noise
    return np.asarray(np.round(read / resolution) * resolution if resolution else read)


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
        joints, wrench = self._in_turn()
        return Postures(joints, wrench=wrench)

    def _in_turn(self) -> tuple[Array, Array]:
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
        readings are those of :func:`inclinations`.
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


def compare(
    twin: Twin, pairs: Pairs, resolution: float, rng: np.random.Generator, noise: float = 0.0
) -> InclinometerReadings:
    """Return by how much inclinometers on the links of a twin change their readings between postures.

    Parameters
    ----------
    resolution, noise
        Of each reading [rad]; see :func:`inclinations`.
    """
    joints, wrench = pairs._in_turn()
    read = inclinations(twin, joints, noise, rng, resolution, wrench=wrench)
    return InclinometerReadings(pairs, read[1::2] - read[::2], deviation_of_change(resolution, noise))


def measure_pairs(twin: Twin, pairs: Pairs, noise: float, rng: np.random.Generator) -> Dataset:
    """Return what an instrument reads of a twin's targets at the postures of pairs, in turn; noise in metres."""
    joints, wrench = pairs._in_turn()
    return measure(twin, joints, noise, rng, wrench=wrench)
