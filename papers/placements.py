"""The base fixture at several places, for a calibration from all of them (Nubiola, 4.5).

What is measured at a place is in the frame of the fixture there, and no instrument says where the places are to each
other. The robot does: the frame of each place is the one in which its readings lie nearest to what the model predicts.
The better the model, the better the frames, so both are found in turn, and the sum of squares falls at every turn. The
three touches alone are no substitute: they weigh too little, and what errs there comes back larger at every turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import Model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.hexapod.rehearsal import joined

#: Turns at most, and the movement of a reading at which the places are taken to stand still [m].
_MOST_ROUNDS: Final = 30
_SETTLED: Final = 2e-6


def identify_placements(robot: Robot, places: Sequence[Dataset], model: Model) -> Fit:
    """Identify a robot from positions measured at several places of the base fixture.

    Args:
        robot: The nominal robot, with the tool's cups as targets.
        places: Cups measured at each place, in the frame of the fixture there.
        model: What is free.

    Returns:
        The fit; its world is the frame of the first place.

    Raises:
        InputError: If there is no place, or the places cannot be put together.
    """
    if not places:
        raise InputError("a calibration needs at least one place of the base fixture", where="places")
    fit = identify(robot, places[0], model)
    if len(places) == 1:
        return fit
    before = np.full((sum(len(data.position) for data in places), 3), np.inf)
    for _ in range(_MOST_ROUNDS):
        together = reduce(joined, in_one_frame(fit.robot, places))
        fit = identify(robot, together, model)
        if np.nanmax(np.abs(together.position - before)) < _SETTLED:
            break
        before = together.position
    return fit


def in_one_frame(robot: Robot, places: Sequence[Dataset]) -> tuple[Dataset, ...]:
    """Return the readings of all places in the frame of the first, by what a robot's model predicts of them."""
    (R0, p0), *_ = frames = [_place(robot, data) for data in places]
    return tuple(
        replace(data, position=(data.position @ R.T + p - p0) @ R0) for data, (R, p) in zip(places, frames, strict=True)
    )


def _place(robot: Robot, data: Dataset) -> tuple[Array, Array]:
    """Return rotation and origin of the frame in the robot's world in which the readings are nearest to the model."""
    seen = data.has_position
    return rigid_motion(data.position[seen], (data.position + errors_of(robot, data).position_errors)[seen])
