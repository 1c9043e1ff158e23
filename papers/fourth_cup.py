"""A fourth cup, set and measured on a twin's fixture (Nubiola, 4.5; :mod:`truearm.hexapod.sheet`)."""

from __future__ import annotations

import numpy as np

from papers.session import SetUp
from papers.simulated import Ballbar
from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import Transform
from truearm.hexapod.sheet import SIDES_OF_FOUR, TO_FOURTH, four_cups, side_distances, side_frames


def with_fourth(fixtures: SetUp, place: Array, bar: Ballbar) -> tuple[tuple[SetUp, Transform], ...]:
    """Measure a fourth cup on a twin's fixture.

    Args:
        fixtures: The first three cups.
        place: Where the fourth truly is in the twin's world [m], ``(3,)``.
        bar: The ballbar; it is initialised.

    Returns:
        For each side the fixture that it is, and its frame in that of the first side by the measured distances.

    Raises:
        InputError: If the fourth cup is beyond the ballbar's range from one of the others.
    """
    true = np.vstack([fixtures.base_cups, place])
    bar.initialise()
    to_fourth = bar.read(np.linalg.norm(fixtures.base_cups - place, axis=1), bar.device.base)
    for name, length in zip(TO_FOURTH, to_fourth.tolist(), strict=True):
        if not np.isfinite(length):
            raise InputError(
                f"the distance {name} is beyond the range of the ballbar",
                where="fixture",
                cure="Set the fourth cup nearer to its nominal distance.",
            )
    frames = side_frames(four_cups(fixtures.base, to_fourth))
    sides = []
    for number, (side, frame) in enumerate(zip(SIDES_OF_FOUR, frames, strict=True), 1):
        lengths = side_distances(number, fixtures.base, to_fourth)
        sides.append((SetUp(true[list(side)], lengths, fixtures.tool), frame))
    return tuple(sides)
