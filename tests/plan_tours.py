"""Tours that nobody checked, for tests of what is written of them."""

from __future__ import annotations

import numpy as np

from truearm.engine.motion.tour import Stop, Tour
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import carrying_targets


def a_tour(robot: Robot, count: int = 4, *, approach: bool = False, labels: tuple[str, ...] = ()) -> tuple[Robot, Tour]:
    """Return a robot with targets, and a tour of random configurations in it with a stop on the way to the last."""
    seen = carrying_targets(robot)
    joints = seen.random_configurations(count, np.random.default_rng(3))
    low = np.array([joint.range[0] for joint in seen.joints])
    home = Stop(0.5 * joints[0], "home")
    stops = [home]
    for row, label in enumerate(labels or [f"P{k:03d}" for k in range(1, count + 1)]):
        if row == count - 1:
            stops.append(Stop(0.5 * (joints[row] + joints[row - 1]), "via"))
        if approach:
            stops.append(Stop(np.maximum(joints[row] - np.deg2rad(2.0), low), "approach"))
        stops.append(Stop(joints[row], "measure", label))
    return seen, Tour((*stops, home), None, 0.05, 0.1)
