"""The Katana of the thesis with its 17 parameters (Patel, tables 3.1 and 3.2)."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from papers.katana.robot import NAMES
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin, measure

#: One step of a parameter as the document counts them: rad and mm.
UNIT: Final = np.array([0.2 if n == "target_tip_y" else 1e-3 if n in NAMES[-4:] else 1.0 for n in NAMES])


def katana() -> Robot:
    robot = load_robot("katana450")
    return robot.with_frames(robot.base, {"tip": (0.0, 0.0, 0.0)})


def values(robot: Robot) -> Array:
    return np.array([robot.values[name] for name in NAMES])


def drawn(size: float, seed: int) -> Robot:
    """Return a Katana with errors of 0.1 deg and 0.1 mm, one standard deviation, times `size`."""
    robot = katana()
    deviation = np.where(UNIT == 1e-3, 1e-4, math.radians(0.1) * UNIT)
    errors = size * deviation * np.random.default_rng(seed).standard_normal(len(NAMES))
    return robot.with_values(dict(zip(NAMES, values(robot) + errors, strict=True)))


def readings(robot: Robot, poses: int, noise: float, seed: int) -> Dataset:
    rng = np.random.default_rng(seed)
    return measure(Twin(robot), robot.random_configurations(poses, rng), noise, rng)
