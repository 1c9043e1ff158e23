"""Values of criteria of poses, each with its status."""

from __future__ import annotations

import math
from typing import Final, Literal

from truearm.validation.iso9283.intervals import Interval
from truearm.validation.iso9283.values import COARSE, Component, Conditions, Quantity, Status, Value

AXES: Final[tuple[Literal["x", "y", "z"], ...]] = ("x", "y", "z")
ANGLES: Final[tuple[Literal["a", "b", "c"], ...]] = ("a", "b", "c")


def valued(
    id: str,
    component: Component,
    where: str,
    cycles: int,
    planned: int,
    conditions: Conditions,
    value: float,
    quantity: Quantity,
    interval: Interval | None = None,
    unknown: float = 0.0,
    *,
    enough: bool = True,
    least: float | None = None,
    largest: float | None = None,
) -> Value:
    """Return a value with its status.

    Args:
        value: NaN if it was not measured.
        planned: How many cycles there should be.
        unknown: What instrument and tie do not know of a reading, a standard deviation.
        enough: Whether there is as much of everything but cycles as planned: approaches, robots.
    """
    status: Status
    if math.isnan(value):
        status = "not-measured"
    elif cycles < planned or not enough:
        status = "too-few-cycles"
    elif unknown > COARSE * abs(value):
        status = "instrument-too-coarse"
    else:
        status = "measured"
    return Value(id, component, where, value, quantity, interval, cycles, conditions, status, least, largest)
