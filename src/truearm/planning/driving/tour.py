"""A tour: where the arm stops, one after the other, from its safe configuration and back to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.planning.driving.cell import FLOOR

#: Why the arm stops: in its safe configuration, on a way around something, right before a measurement, or to measure.
StopKind = Literal["home", "via", "approach", "measure"]
#: Name of the safe configuration in which every tour starts and ends.
HOME: Final = "home"


@dataclass(frozen=True, eq=False)
class Stop:
    """A configuration that is driven to with all joints moving at once, from the one before.

    Attributes
    ----------
    joints
        Joint positions of the model [rad or m], ``(joints,)``.
    kind
        Why the arm stops there.
    label
        Name of the configuration that is measured; None for every other kind.
    """

    joints: Array
    kind: StopKind
    label: str | None = None


@dataclass(frozen=True, eq=False)
class Tour:
    """Stops in driving order; the first and the last are the safe configuration.

    Attributes
    ----------
    stops
        Three or more.
    floor
        Height of the floor in the base frame [m]; None if none is kept clear.
    clearance
        What is kept between the arm and the floor, boxes and its own links [m].
    room
        The smallest such distance on the ways [m]; infinite if there is nothing to come close to.
    surface
        What the plane at the height `floor` is called.
    distances
        How near the arm comes to each thing on the ways [m], the smallest first: ``floor``, ``keep_out`` and the name
        of a box, ``links`` for its own.
    notices
        What is to be known of what was kept clear.
    connected
        How much of the arm is left out of the distance of its links where two are connected, at most [m].
    """

    stops: tuple[Stop, ...]
    floor: float | None
    clearance: float
    room: float
    surface: str = FLOOR
    distances: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()
    connected: float = 0.0

    @property
    def joints(self) -> Array:
        """Joint positions of all stops, ``(stops, joints)`` [rad or m]."""
        return np.array([stop.joints for stop in self.stops])

    @property
    def home(self) -> Array:
        """The safe configuration, ``(joints,)`` [rad or m]."""
        return self.stops[0].joints

    @property
    def measured(self) -> tuple[Stop, ...]:
        """The stops at which something is measured, in driving order."""
        return tuple(stop for stop in self.stops if stop.kind == "measure")
