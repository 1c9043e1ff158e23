"""The model of every robot: all joint effects that robot and data say something about, each as large as the data tell.

Nothing is chosen. What the data do not support shrinks to nothing by itself (:mod:`truearm.engine.fit.relevance`).
Errors that repeat with the angle of a joint are looked for in what the first fit leaves, and join in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model, named_model
from truearm.engine.fit.rounds import Redundant
from truearm.engine.fit.transmission import PeriodicError, periodic_errors
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.linear_contact import LinearContactClearance
from truearm.engine.robot.effects.transmission import TransmissionError
from truearm.engine.robot.loads import has_weight
from truearm.engine.robot.robot import Robot

AUTO: Final = "auto"


def closed_because(robot: Robot, data: Dataset, name: str) -> str | None:
    """Return why the data say nothing of an effect, None if they may."""
    effect = next(effect for effect in EFFECTS if effect.name == name)
    if not effect(robot.layout).parameters:
        return "the robot has nothing that it moves"
    if effect.ordered and (data.approach is None or data.number is None):
        return "the order of measurement is not known"
    if effect.warmed and data.temperature is None:
        return "no temperature was recorded"
    if effect.loaded and not (has_weight(robot) or data.wrench is not None):
        return "nothing loads the joints"
    return None


OUT = {"balancer", "clearance-linear-contact"}


def every_effect(robot: Robot, data: Dataset) -> Model:
    """Return the model with every effect that robot and data may say something about."""
    names = [e.name for e in EFFECTS if e.name not in OUT and closed_because(robot, data, e.name) is None]
    groups = named_model("geometric").groups
    return Model(AUTO, "every joint effect, as large as the data tell", groups, tuple(names), weighed=True)
