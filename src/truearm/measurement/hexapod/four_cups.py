"""A fourth cup on the base fixture, 300 mm from the three others (Nubiola, 4.5).

The four cups are the corners of a tetrahedron, and the tool can be measured outside each of its four sides. The fourth
cup stands below the first three, so that the first side is the fixture as it was. Six distances between the cups say
where the sides are to each other, as well as the bar reads: unlike a fixture that is moved, they need no robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.measurement.hexapod.geometry import SIDES, Design, Order, triangle
from truearm.measurement.hexapod.kinematics import tripod
from truearm.measurement.hexapod.world_frame import plain_frame
from truearm.modeling.chain import Array
from truearm.modeling.transform import Transform

#: The cups of each side, counted from 0, in the order in which they are its B1, B2 and B3: from outside, they go round
#: against the clock.
SIDES_OF_FOUR: Final[tuple[Order, ...]] = ((0, 1, 2), (1, 0, 3), (2, 1, 3), (0, 2, 3))
#: Names of the distances to the fourth cup.
TO_FOURTH: Final = ("B1-B4", "B2-B4", "B3-B4")


def four_cups(base: Sequence[float] | Array, to_fourth: Sequence[float] | Array) -> Array:
    """Return B1 to B4 in the frame of the first three [m], ``(4, 3)``.

    Args:
        base: Distances 12, 23 and 31 [m], ``(3,)``.
        to_fourth: Distances 14, 24 and 34 [m], ``(3,)``.

    Raises:
        InputError: If the first three lie on one line, or the distances do not meet.
    """
    cups = triangle(base, "B")
    return np.vstack([cups, tripod(cups, np.asarray(to_fourth, float), -1, TO_FOURTH)])


def side_frames(cups: Array) -> tuple[Transform, ...]:
    """Return the frame of each side in that of the cups ``(4, 3)`` [m], as :data:`SIDES_OF_FOUR` orders them."""
    return tuple(plain_frame(cups[list(side)]) for side in SIDES_OF_FOUR)


def side_distances(side: int, base: Sequence[float] | Array, to_fourth: Sequence[float] | Array) -> Array:
    """Return the distances 12, 23 and 31 of a side, 1 to 4 [m], ``(3,)``; the rest as in :func:`four_cups`."""
    between = dict(zip((frozenset(ends) for ends in SIDES), np.asarray(base, float), strict=True))
    between |= {frozenset((cup, 3)): length for cup, length in enumerate(np.asarray(to_fourth, float))}
    cups = SIDES_OF_FOUR[side - 1]
    return np.array([between[frozenset((cups[a], cups[b]))] for a, b in SIDES])


def legs_of_side(design: Design, side: int) -> tuple[str, ...]:
    """Return the legs of a design on a side, 1 to 4, by the names of the cups, as ``B4-T2``; in the design's order."""
    cups = SIDES_OF_FOUR[side - 1]
    return tuple(f"B{cups[base] + 1}-T{tool + 1}" for base, tool in design.legs)
