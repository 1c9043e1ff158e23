"""A value of a criterion, with its interval and the conditions under which it was measured."""

from __future__ import annotations

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
    """Under what something was measured.

    Attributes
    ----------
    velocity, load
        Shares of the rated ones, 0 to 1; None where it does not matter.
    robot
        Its name where several were measured.
    """

    velocity: float | None = None
    load: float | None = None
    robot: str = ""


@dataclass(frozen=True)
class Value:
    """A value of a criterion.

    Attributes
    ----------
    id
        One of :data:`truearm.planning.iso9283.criteria.CRITERIA`.
    component
        What of it.
    where
        The pose, the two poses, the path or the corner: ``P1``, ``P2-P4``, ``line``, ``rectangle E2``.
    value
        In SI units (a share for a ratio); NaN where it was not measured.
    quantity
        What kind of number it is.
    interval
        From where to where the true value lies with a probability of 95 %; None where nothing can be said.
    cycles
        From how many.
    conditions
        Under what.
    status
        Whether it can be relied on.
    least, largest
        Of the cycles, where there are too few of them for an interval; None otherwise.
    bandwidth
        Frequency up to which it tells what fluctuates [Hz]; None of others.
    """

    id: str
    component: Component
    where: str
    value: float
    quantity: Quantity
    interval: tuple[float, float] | None
    cycles: int
    conditions: Conditions
    status: Status
    least: float | None = None
    largest: float | None = None
    bandwidth: float | None = None


@dataclass(frozen=True)
class Instrument:
    """What is not known of a reading.

    Attributes
    ----------
    sigma
        Standard deviation of each coordinate [m].
    sigma_rot
        Of each angle [rad]; None where no orientation is read.
    """

    sigma: float
    sigma_rot: float | None = None


#: What is not known of a reading may be this share of a value.
COARSE = 0.25
