"""The simulated test of static compliance by ISO 9283: pushes at the tip."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.wrench import STANDARD_GRAVITY
from truearm.planning.iso9283.planned import PlannedTest
from truearm.validation.iso9283.simulated_cell import DWELL, Cell
from truearm.validation.iso9283.simulated_readings import Pushed

#: Pushes in shares of the rated load.
_PUSHES: Final = tuple(k / 10 for k in range(11))


def run_pushes(cell: Cell, test: PlannedTest) -> None:
    """Push the tip in steps up to the rated load."""
    load = test.loads[0]
    place = test.places[0]
    joints, came = cell.joints(place, load), cell.joints(cell.other(place), load)
    arm, force = cell.arm(0, load), np.array(_PUSHES) * cell.plan.rated_load * STANDARD_GRAVITY
    to_base = cell.robots[0].twin.robot.base.rotation.T @ cell.base[:3, :3]
    for cycle in range(1, test.cycles + 1):
        for way in test.approaches:
            along = np.zeros(3)
            along["xyz".index(way[1])] = 1.0 if way[0] == "+" else -1.0
            stood = joints + cell.scatter(len(joints))
            n = len(force)
            cell.now += DWELL * n
            frames = arm.at_rest(
                np.tile(stood, (n, 1)),
                np.tile(np.sign(joints - came), (n, 1)),
                np.full(n, cell.now + cell.ahead),
                force[:, None] * (to_base @ along),
            )
            read = frames[:, :3, 3] + cell.rng.normal(0.0, cell.tracker.sigma, (n, 3))
            cell.pushes.append(Pushed(way, cycle, force, read))
