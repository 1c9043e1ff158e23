"""Simulated campaigns for tests: the twin's truth, seen only through readings."""

from __future__ import annotations

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure


def campaign(robot: str, poses: int, noise: float, seed: int, truth: str = "random") -> tuple[Twin, Dataset]:
    """Return a twin and what an instrument read of it; noise in metres."""
    rng = np.random.default_rng(seed)
    nominal = load_robot(robot)
    twin = truth_twin(nominal, truth, rng)
    return twin, measure(twin, nominal.random_configurations(poses, rng), noise, rng)


def more_of(twin: Twin, poses: int, noise: float, seed: int) -> Dataset:
    """Return readings of the same twin at other configurations."""
    rng = np.random.default_rng(seed)
    return measure(twin, twin.robot.random_configurations(poses, rng), noise, rng)
