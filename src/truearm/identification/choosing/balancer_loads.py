"""Whether readings can tell how strong a balancer is.

A balancer moves its joint by compliance times a moment that depends on that joint's position alone, as a periodic
error of the joint does. Under one load its strength is then one guess among several. Another load shows the compliance
by itself, and with it the moment. Beside a free curve of the same joint no load tells the two apart; the informed share
of the strength says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.solving.models import Model
from truearm.measurement.dataset import Dataset
from truearm.modeling.effects.balancing import Balancing
from truearm.modeling.robot import Robot
from truearm.notices import Notice

#: Configurations under another load that are worth it; fewer may be a slip.
_ENOUGH: Final = 5
#: Forces and moments that differ by less are the same load [N, N m].
_SAME: Final = 1.0


def refuse_balancers_that_are_not_there(robot: Robot, effects: Sequence[str]) -> None:
    """Refuse to identify balancers of a robot that has none.

    Raises:
        InputError: Naming the robot.
    """
    if Balancing.name in effects and not robot.balancers:
        raise InputError(
            f"{robot.name} has no balancer whose strength could be identified",
            parameter="effects",
            came=Balancing.name,
            cure="Enter balancers in the robot file: anchors, length, force and stiffness as the maker states them.",
        )


def without_unseen_balancers(model: Model, data: Dataset) -> tuple[Model, list[Notice]]:
    """Return a model without balancers where all readings were taken under one load, and what to know of that.

    Args:
        data: The training part.
    """
    if Balancing.name not in model.effects or _load_changes(data):
        return model, []
    kept = replace(model, effects=tuple(name for name in model.effects if name != Balancing.name))
    words = (
        "All training configurations carry one load. A balancer then looks like a periodic error of the joint that it "
        "relieves, so its strength is held at what the robot file states. Measure some configurations with another "
        "weight or a pull at the flange, and enter that in the columns force_x [N] to force_z [N]."
    )
    return kept, [Notice("balancer-held", words, "note")]


def _load_changes(data: Dataset) -> bool:
    """Return whether enough configurations carry another load at the flange than most do."""
    if data.wrench is None:
        return False
    usual = np.median(data.wrench, axis=0)
    other = int((np.abs(data.wrench - usual).max(axis=1) > _SAME).sum())
    return min(other, len(data.wrench) - 1) >= _ENOUGH
