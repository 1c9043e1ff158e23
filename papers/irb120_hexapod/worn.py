"""A twin of the IRB 120 that a calibration does not bring to zero: gears that run out, joints that lag behind."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from papers.irb120 import ELASTIC
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import identify
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

#: Nubiola, Table 2.3 [deg].
_BACKLASH: Final = (0.004, 0.002, 0.004, 0.037, 0.017, 0.037)
#: Deviations of the gears' sines, one and two a turn, and of axis 3 against axis 2 [deg]: chosen so that the document's
#: model leaves about what it left on the real robot.
_GEAR: Final = 0.012
_BETA: Final = 0.025


def worn_twin(rng: np.random.Generator, truth: str = "tracker-triangular") -> Twin:
    """Return an IRB 120 with the errors of a published truth, and others that no model of the document has."""
    twin = truth_twin(load_robot("irb120"), truth, rng)

    def gear() -> tuple[tuple[int, float, float], ...]:
        return tuple((k, math.radians(_GEAR) * float(rng.normal()), float(rng.uniform(0.0, 6.28))) for k in (1, 2))

    joints = {
        number: replace(twin.joints.get(number, PERFECT), gear=gear(), hysteresis=-math.radians(backlash) / 2)
        for number, backlash in enumerate(_BACKLASH, 1)
    }
    return replace(
        twin, robot=twin.robot.with_values({"beta_3": math.radians(_BETA) * float(rng.normal())}), joints=joints
    )


def tracked(twin: Twin, joints: Array, noise: float, rng: np.random.Generator) -> Dataset:
    """Return what an instrument reads of the tool when every joint comes from below, as the document has it."""
    return measure(twin, joints, noise, rng, approach=np.ones(joints.shape))


def calibrated(nominal: Robot, data: Dataset) -> Robot:
    """Return the robot that the elastic model makes of readings."""
    return identify(nominal, data, ELASTIC).robot


def in_base(robot: Robot) -> Robot:
    """Return a robot as its controller has it: its base in the origin, its tool as calibrated."""
    targets = {t.name: [robot.values[t.parameter(axis)] for axis in "xyz"] for t in robot.targets}
    return robot.with_frames(IDENTITY, targets)
