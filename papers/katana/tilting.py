"""Joints of the Katana that tilt (Patel, Tables 4.3 and 4.4): in a twin, in a model, and found by inclinometers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from papers.katana.robot import NOISE
from truearm.engine.data.inclinations import deviation_of_change
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.inclinometers.fit import TiltingFit, calibrate_tilting
from truearm.inclinometers.pairs import compare, measure_pairs, plan_tilting

#: Resolution of the inclinometers [rad].
RESOLUTION: Final = math.radians(0.001)
#: Tables 4.3 and 4.4 [deg, deg, kgf m/deg], joints 1 to 5.
CLEARANCE: Final = (0.022, 0.024, 0.017, 0.015, 0.018)
BACKLASH: Final = (0.063, 0.061, 0.057, 0.046, 0.051)
STIFFNESS: Final = (122.0, 90.0, 75.0, 78.0, 80.0)
_KILOGRAM_FORCE: Final = 9.80665  # N


def compliance(stiffness: float) -> float:
    """Return the compliance [rad/(N m)] of a stiffness [kgf m/deg], or the other way round."""
    return math.radians(1.0 / stiffness) / _KILOGRAM_FORCE


#: By parameter [rad, rad/(N m)].
TILTING: Final[Mapping[str, float]] = {
    **{f"clearance_{i}": math.radians(c) for i, c in enumerate(CLEARANCE, 1)},
    **{f"backlash_{i}": math.radians(b) for i, b in enumerate(BACKLASH, 1)},
    **{f"compliance_{i}": compliance(k) for i, k in enumerate(STIFFNESS, 1)},
}


def twin(robot: Robot, tilting: Mapping[str, float] = TILTING) -> Twin:
    """Return a twin whose joints tilt."""

    def of(name: str, number: int) -> float:
        return tilting.get(f"{name}_{number}", 0.0)

    joints = {
        i: JointTruth(of("compliance", i), backlash=of("backlash", i), clearance=of("clearance", i))
        for i in range(1, len(robot.joints) + 1)
    }
    return Twin(robot, joints)


def with_tilting(robot: Robot, tilting: Mapping[str, float]) -> Robot:
    """Return the robot with these joint effects, at these values."""
    effects = tuple(dict.fromkeys(name.rpartition("_")[0] for name in tilting))
    return replace(robot, effect_names=(*robot.effect_names, *effects)).with_values(tilting)


def tilting_from_inclinometers(
    nominal: Robot, truth: Twin, rng: np.random.Generator, pairs: tuple[int, int] = (24, 8)
) -> TiltingFit:
    """Identify how a twin's joints tilt: the first stage, with pairs of postures planned for the nominal robot.

    Args:
        pairs: How many for inclinometers, and how many for poses.
    """
    plan = plan_tilting(
        nominal, rng, inclined=pairs[0], posed=pairs[1], deviation=deviation_of_change(RESOLUTION), pose_deviation=NOISE
    )
    readings = compare(truth, plan.inclined, RESOLUTION, rng)
    return calibrate_tilting(nominal, readings, measure_pairs(truth, plan.posed, NOISE, rng))
