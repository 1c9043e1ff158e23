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
    """A configuration that is driven to with all joints moving at once, from the one before."""

    joints: Array  #: Joint positions of the model [rad or m], ``(joints,)``.
    kind: StopKind  #: Why the arm stops there.
    label: str | None = None  #: Name of the configuration that is measured; None for every other kind.


@dataclass(frozen=True, eq=False)
class Tour:
    """Stops in driving order; the first and the last are the safe configuration."""

    stops: tuple[Stop, ...]  #: Three or more.
    floor: float | None  #: Height of the floor in the base frame [m]; None if none is kept clear.
    clearance: float  #: What is kept between the arm and the floor, boxes and its own links [m].
    room: float  #: The smallest such distance on the ways [m]; infinite if there is nothing to come close to.
    surface: str = FLOOR  #: What the plane at the height `floor` is called.
    #: How near the arm comes to each thing on the ways [m], the smallest first: ``floor``, ``keep_out`` and the name of
    #: a box, ``links`` for its own.
    distances: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()  #: What is to be known of what was kept clear.
    #: How much of the arm is left out of the distance of its links where two are connected, at most [m].
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
