"""A value of a criterion, with its interval and the conditions under which it was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

#: ``too-few-cycles``: fewer than planned, the value stands nevertheless. ``instrument-too-coarse``: what the instrument
#: does not know is more than a quarter of the value.
Status = Literal["measured", "not-measured", "too-few-cycles", "instrument-too-coarse"]
#: Of a pose or a path: its position as a whole, an axis of the base, or an angle about one.
Component = Literal["position", "x", "y", "z", "a", "b", "c"]
Quantity = Literal["length", "angle", "time", "ratio", "speed", "compliance"]


@dataclass(frozen=True)
class Conditions:
    """Under what something was measured."""

    velocity: float | None = None  #: velocity, load: shares of the rated ones, 0 to 1; None where it does not matter.
    load: float | None = None
    robot: str = ""  #: Its name where several were measured.


@dataclass(frozen=True)
class Value:
    """A value of a criterion."""

    id: str  #: One of :data:`truearm.planning.iso9283.criteria.CRITERIA`.
    component: Component  #: What of it.
    where: str  #: The pose, the two poses, the path or the corner: ``P1``, ``P2-P4``, ``line``, ``rectangle E2``.
    value: float  #: In SI units (a share for a ratio); NaN where it was not measured.
    quantity: Quantity  #: What kind of number it is.
    #: From where to where the true value lies with a probability of 95 %; None where nothing can be said.
    interval: tuple[float, float] | None
    cycles: int  #: From how many.
    conditions: Conditions  #: Under what.
    status: Status  #: Whether it can be relied on.
    #: least, largest: of the cycles, where there are too few of them for an interval; None otherwise.
    least: float | None = None
    largest: float | None = None
    bandwidth: float | None = None  #: Frequency up to which it tells what fluctuates [Hz]; None of others.


@dataclass(frozen=True)
class Instrument:
    """What is not known of a reading."""

    sigma: float  #: Standard deviation of each coordinate [m].
    sigma_rot: float | None = None  #: Of each angle [rad]; None where no orientation is read.
    #: rounding, rounding_rot: what rounding in the file leaves open of each coordinate [m], and of each angle [rad], as
    #: standard deviations.
    rounding: float = 0.0
    rounding_rot: float = 0.0

    def reading(self, resolution: float, resolution_rot: float = 0.0) -> Instrument:
        """Return the same instrument as its readings stand in a file: what rounding leaves open is not known either.

        A number rounded to q is off by q / sqrt(12), and an angle by twice that of the quaternion's components.

        Args:
            resolution, resolution_rot: Steps to which positions [m] and components of quaternions were rounded.
        """
        one, other = resolution / math.sqrt(12.0), 2.0 * resolution_rot / math.sqrt(12.0)
        turned = self.sigma_rot if self.sigma_rot is None else max(self.sigma_rot, other)
        return Instrument(max(self.sigma, one), turned, one, other)

    def least_scatter(self, share: float) -> tuple[float, float]:
        """Return below what no scatter of coordinates [m] and angles [rad] is taken: a share of sigma, or rounding."""
        return max(share * self.sigma, self.rounding), max(share * (self.sigma_rot or 0.0), self.rounding_rot)


#: What is not known of a reading may be this share of a value.
COARSE = 0.25
