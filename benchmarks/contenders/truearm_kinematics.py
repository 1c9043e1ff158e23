"""truearm: position and the derivative of the position by every named parameter, one target."""

from __future__ import annotations

import numpy as np
from stopwatch import inputs, median_seconds, report

import truearm
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import STATION

given = np.load(inputs() / "kinematics.npz")
real = load_robot("irb120").with_values(dict(zip(given["names"].tolist(), given["values"].tolist(), strict=True)))
turned = dict.fromkeys(("base_rx", "base_ry", "base_rz"), 0.001)  # a fit never meets zeros, which are skipped
robot = real.with_frames(STATION, {"1": (0.075, 0.0937, 0.215)}).with_values(turned)
names = list(robot.parameters)
figures: dict[str, object] = {"parameters": len(names), "elements": len(robot.trunk.elements) + 3}
q1000 = given["q"]
for count, repeats in ((1, 300), (50, 300), (1000, 300), (100_000, 5)):
    q = np.tile(q1000, (max(1, count // len(q1000)), 1))[:count]

    def position(q: np.ndarray = q) -> object:
        return robot.forward_kinematics(q, "1").position

    def with_jacobian(q: np.ndarray = q) -> object:
        kinematics = robot.forward_kinematics(q, "1")
        return kinematics.position, robot.position_jacobian(kinematics, q, names)

    figures[f"position_{count}"] = median_seconds(position, repeats)
    figures[f"position_and_jacobian_{count}"] = median_seconds(with_jacobian, repeats)

# The bound: no Jacobian is ready before its bytes are written.
size = len(names) * 3 * 1000
figures["jacobian_bytes"] = 8 * size
block, other = np.ones(size), np.empty(size)
figures["fill_in_cache"] = median_seconds(lambda: other.fill(1.0), 300)
figures["copy_in_cache"] = median_seconds(lambda: np.copyto(other, block), 300)
large, copy = np.ones(2**25), np.ones(2**25)
figures["copy_bytes_per_second"] = 2 * large.nbytes / median_seconds(lambda: np.copyto(copy, large), 7)
report(figures, {"truearm": truearm.__version__, "numpy": np.__version__})
