"""pybotics: forward kinematics alone, of the nominal robot, one configuration at a time."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from pybotics.robot import Robot
from stopwatch import inputs, median_seconds, report

given = np.load(inputs() / "kinematics.npz")
robot = Robot.from_parameters(given["modified_dh"])
q = given["q"]
position = np.empty((len(q), 3))


def forward() -> None:
    for i in range(len(q)):
        position[i] = robot.fk(q[i])[:3, 3]


figures = {"position": median_seconds(forward, 10)}
figures["difference"] = float(np.abs(position - given["nominal_position"]).max())
report(figures, {"pybotics": version("pybotics"), "numpy": np.__version__})
