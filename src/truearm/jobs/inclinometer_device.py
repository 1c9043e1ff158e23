"""Inclinometers as a device of `plan` and `simulate`: which postures they are read in, under which loads."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from truearm.arrays import finite_number
from truearm.errors import InputError, refusals_of
from truearm.jobs.arguments import device_argument
from truearm.measurement.inclinometer import deviation_of_change
from truearm.modeling.robot import Robot

if TYPE_CHECKING:
    from truearm.planning.choosing.inclinometer import TiltingPlan
    from truearm.simulation.devices import Device

#: What `device` is for inclinometers on the links, which read no targets as other instruments do.
INCLINOMETERS: Final = "inclinometers"
#: Of a two-axis inclinometer (Patel, section 4.4.1) [rad].
RESOLUTION: Final = math.radians(0.001)
#: It has the axes x and y of its link.
AXES: Final = (0, 1)
#: A string or a weight on the flange [N], how far joints move without one [rad], and pairs of poses under loads.
PULL: Final = 20.0
_MOVE: Final = math.radians(20.0)
_POSED: Final = 8
_STRONGEST: Final = 1e4  # N


def instrument_argument(device: object) -> Device | Literal["inclinometers"] | None:
    """Return the instrument of a name; inclinometers by their name alone, and None for None."""
    if device is None or device == INCLINOMETERS:
        return None if device is None else INCLINOMETERS
    return device_argument(device, beside=(INCLINOMETERS,))


def pull_argument(pull: object, device: object) -> float:
    """Return the force on the flange that inclinometers are read under [N]; it is asked of nothing else."""
    if pull is None:
        return PULL
    force = finite_number(pull, "pull", lowest=0.0)
    if force > _STRONGEST:
        raise InputError("no flange is pulled so hard", parameter="pull", came=force, allowed=f"0 to {_STRONGEST:g} N")
    if device != INCLINOMETERS:
        raise InputError(
            "only inclinometers are read under a pull",
            parameter="pull",
            came=force,
            cure=f"Leave it out, or use `device={INCLINOMETERS}`.",
        )
    return force


def planned_pairs(
    robot: Robot, count: int, rng: np.random.Generator, pull: float, candidates: int, pose_deviation: float
) -> TiltingPlan:
    """Choose the postures that inclinometers are read in.

    Parameters
    ----------
    count
        Configurations, two for each pair.
    pull
        Force on the flange [N]; without one, joints move within a pair by up to 20 deg and no poses are chosen.
    """
    from truearm.planning.choosing.inclinometer import plan_tilting

    if count % 2:
        raise InputError(
            "inclinations are compared two by two",
            parameter="poses",
            came=count,
            allowed="an even number",
            cure=f"Use `poses={count + 1}`.",
        )
    if not robot.layout.turning:
        raise InputError("no joint of this robot turns, so no link leans", parameter="robot", where=robot.name)
    with refusals_of("poses"):
        return plan_tilting(
            robot,
            rng,
            inclined=count // 2,
            posed=_POSED if pull else 0,
            force=pull,
            move=0.0 if pull else _MOVE,
            axes=AXES,
            candidates=candidates,
            deviation=deviation_of_change(RESOLUTION),
            pose_deviation=pose_deviation,
        )
