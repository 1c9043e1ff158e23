"""A fourth cup on the base fixture, 300 mm from the three others (Nubiola, 4.5).

The four cups are the corners of a tetrahedron, and the tool can be measured outside each of its four sides. The fourth
cup stands below the first three, so that the first side is the fixture as it was. Six distances between the cups say
where the sides are to each other, as well as the bar reads: unlike a fixture that is moved, they need no robot.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.hexapod.geometry import triangle
from truearm.measurement.hexapod.kinematics import tripod
from truearm.measurement.hexapod.world_frame import plain_frame
from truearm.modeling.chain import Array
from truearm.modeling.transform import Transform
from truearm.simulation.hexapod.session import SetUp
from truearm.simulation.hexapod.simulated import Ballbar

#: The cups of each side, counted from 0, in the order in which they are its B1, B2 and B3: from outside, they go round
#: against the clock.
SIDES_OF_FOUR: Final = ((0, 1, 2), (1, 0, 3), (2, 1, 3), (0, 2, 3))
_TO_FOURTH: Final = ("B1-B4", "B2-B4", "B3-B4")


def four_cups(base: Array, to_fourth: Array) -> Array:
    """Return B1 to B4 in the frame of the first three [m], ``(4, 3)``.

    Parameters
    ----------
    base
        Distances 12, 23 and 31 [m], ``(3,)``.
    to_fourth
        Distances 14, 24 and 34 [m], ``(3,)``.

    Raises
    ------
    InputError
        If the first three lie on one line, or the distances do not meet.
    """
    cups = triangle(base, "B")
    return np.vstack([cups, tripod(cups, to_fourth, -1, _TO_FOURTH)])


def side_frames(cups: Array) -> tuple[Transform, ...]:
    """Return the frame of each side in that of the cups ``(4, 3)`` [m], as :data:`SIDES_OF_FOUR` orders them."""
    return tuple(plain_frame(cups[list(side)]) for side in SIDES_OF_FOUR)


def with_fourth(fixtures: SetUp, place: Array, bar: Ballbar) -> tuple[tuple[SetUp, Transform], ...]:
    """Measure a fourth cup on a twin's fixture.

    Parameters
    ----------
    fixtures
        The first three cups.
    place
        Where the fourth truly is in the twin's world [m], ``(3,)``.
    bar
        The ballbar; it is initialised.

    Returns
    -------
    For each side the fixture that it is, and its frame in that of the first side by the measured distances.

    Raises
    ------
    InputError
        If the fourth cup is beyond the ballbar's range from one of the others.
    """
    true = np.vstack([fixtures.base_cups, place])
    bar.initialise()
    to_fourth = bar.read(np.linalg.norm(fixtures.base_cups - place, axis=1), bar.device.base)
    for name, length in zip(_TO_FOURTH, to_fourth.tolist(), strict=True):
        if not np.isfinite(length):
            raise InputError(
                f"the distance {name} is beyond the range of the ballbar",
                where="fixture",
                cure="Set the fourth cup nearer to its nominal distance.",
            )
    between = dict(zip(((0, 1), (1, 2), (0, 2)), fixtures.base, strict=True))
    between |= dict(zip(((0, 3), (1, 3), (2, 3)), to_fourth, strict=True))
    frames = side_frames(four_cups(fixtures.base, to_fourth))
    sides = []
    for side, frame in zip(SIDES_OF_FOUR, frames, strict=True):
        lengths = [between[min(a, b), max(a, b)] for a, b in zip(side, np.roll(side, -1), strict=True)]
        sides.append((SetUp(true[list(side)], np.array(lengths), fixtures.tool), frame))
    return tuple(sides)
