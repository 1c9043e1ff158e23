"""Pinocchio from Python: inverse kinematics by damped Newton steps, pose by pose.

Once as its documentation has it (from the neutral posture, steps of 0.1, to 1e-4), and once made fast: whole steps from
a seed at most 0.1 rad away, to 1e-9.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from stopwatch import inputs, median_seconds, report

DAMPING, FIRST = 1e-12, 1000

given = np.load(inputs() / "inverse.npz")
model = pin.buildModelFromUrdf(str(inputs() / "real.urdf"))
data = model.createData()
flange = model.nframes - 1
goals = [pin.SE3(R, p) for R, p in zip(given["rotation"], given["position"], strict=True)]
found = np.empty_like(given["seed"])
solved = np.zeros(len(goals), dtype=bool)


def solve(seeds: np.ndarray, enough: float, steps: int, length: float) -> None:
    for i, (goal, seed) in enumerate(zip(goals, seeds, strict=False)):
        q = seed.copy()
        solved[i] = False
        for _ in range(steps):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, flange)
            apart = data.oMf[flange].actInv(goal)
            error = pin.log(apart).vector
            if np.linalg.norm(error) < enough:
                solved[i] = True
                break
            J = -pin.Jlog6(apart.inverse()) @ pin.computeFrameJacobian(model, data, q, flange, pin.LOCAL)
            q = pin.integrate(model, q, -length * J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), error))
        found[i] = q


neutral = np.tile(pin.neutral(model), (FIRST, 1))
documented = median_seconds(lambda: solve(neutral, 1e-4, 1000, 0.1), 1) * len(goals) / FIRST
documented_solved = float(solved[:FIRST].mean())
seconds = median_seconds(lambda: solve(given["seed"], 1e-9, 100, 1.0), 3)
apart = 0.0
for q, goal, good in zip(found, goals, solved, strict=True):
    if good:
        pin.framesForwardKinematics(model, data, q)
        apart = max(apart, float(np.abs(data.oMf[flange].translation - goal.translation).max()))
figures = {
    "poses": len(goals),
    "documented_seconds": documented,
    "documented_solved": documented_solved,
    "seconds": seconds,
    "solved": float(solved.mean()),
    "worst_position": apart,
}
report(figures, {"pin": pin.__version__, "numpy": np.__version__})
