"""Balancers: springs and gas cylinders between two links that relieve the joints between them (Patel, 2.3.2).

Source: Klimchik et al. 2013, "Modelling of the gravity compensators in robotic manufacturing cells", which Patel cites.

Large arms carry a spring or a cylinder beside joint 2, anchored on the link that stands and on the link that moves. It
pulls the two anchors together with a force along the line between them that grows with its length L::

    F = factor (force + stiffness (L - length))

A negative force pushes them apart, as a gas spring beneath an arm does. The force acts on both links at their anchors;
what its moments about the joints are follows from the posture.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.robot.chain import (
    Coordinates,
    Direction,
    Element,
    Move,
    Number,
    cross,
    in_frame_before,
    in_frame_behind,
)

if TYPE_CHECKING:
    from truearm.engine.robot.robot_data import RobotData


@dataclass(frozen=True)
class Anchor:
    """Where a balancer holds a link."""

    link: int  #: Number of the link; 0 is the base.
    point: Direction  #: In the frame of the link [m].


@dataclass(frozen=True)
class Balancer:
    """A spring or a gas cylinder."""

    name: str  #: As the maker calls it.
    fixed: Anchor  #: fixed, moving: its anchors; the fixed one is on the link nearer to the base.
    moving: Anchor
    force: float  #: With which it pulls [N] at `length`; zero for the free length of a spring, negative if it pushes.
    length: float  #: Distance of the anchors [m].
    stiffness: float  #: By how much the pull grows with the length [N/m].

    def pull(self, length: Number) -> Number:
        """Return the force [N] at a distance of the anchors [m]."""
        return self.force + self.stiffness * (length - self.length)


#: A force [N] and a moment [N m] about the origin of a frame, in its axes.
Wrench = tuple[Coordinates, Coordinates]


def balancer_wrenches(
    robot: RobotData,
    balancer: Balancer,
    elements: Sequence[Element],
    moves: Sequence[Move],
    ends: Sequence[int],
    values: Mapping[str, float],
) -> Iterator[tuple[int, Wrench]]:
    """Give what a balancer does to its two links, as the number of elements up to the link's frame and the wrench.

    Args:
        elements, moves: Of the arm, and what they do.
        ends: Number of elements up to the frame of each link, beginning with the base.
        values: Of the parameters: places count as with nominal slides, see :mod:`truearm.engine.robot.bearings`.
    """
    lower, upper = balancer.fixed, balancer.moving
    start, stop = ends[lower.link], ends[upper.link]
    anchor = robot.axial_slides.stayed(lower.link, lower.point, values)
    moved = robot.axial_slides.stayed(upper.link, upper.point, values)
    seen: Coordinates = moved
    for element, move in zip(reversed(elements[start:stop]), reversed(moves[start:stop]), strict=True):
        if move:
            seen = in_frame_before(seen, element, move)
    way = anchor[0] - seen[0], anchor[1] - seen[1], anchor[2] - seen[2]
    length = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    share = balancer.pull(length) / length
    force: Coordinates = way[0] * share, way[1] * share, way[2] * share
    against = -force[0], -force[1], -force[2]
    yield start, (against, cross(anchor, against))
    for element, move in zip(elements[start:stop], moves[start:stop], strict=True):
        if move and element.turns:
            force = in_frame_behind(force, element, move)
    yield stop, (force, cross(moved, force))
