"""truearm: inverse kinematics of the calibrated arm, all poses together, on the branch that was asked for."""

from __future__ import annotations

import numpy as np
from stopwatch import inputs, median_seconds, report

import truearm
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot

given = np.load(inputs() / "inverse.npz")
values = np.load(inputs() / "kinematics.npz")
robot = load_robot("irb120").with_values(dict(zip(values["names"].tolist(), values["values"].tolist(), strict=True)))


def solve() -> object:
    return inverse(robot, given["position"], given["rotation"], branch="front-up-noflip")


def solve_near() -> object:
    return inverse(robot, given["position"], given["rotation"], seed=given["seed"])


found = inverse(robot, given["position"], given["rotation"], seed=given["seed"])
figures = {
    "poses": len(given["position"]),
    "seconds": median_seconds(solve, 3),
    "near_seconds": median_seconds(solve_near, 3),
    "statuses": {str(s.value): sum(x is s for x in found.status) for s in set(found.status)},
}
report(figures, {"truearm": truearm.__version__, "numpy": np.__version__})
