"""Pinocchio from Python: inverse kinematics by damped Newton steps, as in its own example, pose by pose."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from stopwatch import inputs, median_seconds, report

ENOUGH, STEPS, DAMPING = 1e-9, 100, 1e-12

given = np.load(inputs() / "inverse.npz")
model = pin.buildModelFromUrdf(str(inputs() / "real.urdf"))
data = model.createData()
flange = model.nframes - 1
goals = [pin.SE3(R, p) for R, p in zip(given["rotation"], given["position"], strict=True)]
found = np.empty_like(given["seed"])
solved = np.zeros(len(goals), dtype=bool)


def solve() -> None:
    for i, goal in enumerate(goals):
        q = given_seed[i].copy()
        solved[i] = False
        for _ in range(STEPS):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, flange)
            apart = data.oMf[flange].actInv(goal)
            error = pin.log(apart).vector
            if np.linalg.norm(error) < ENOUGH:
                solved[i] = True
                break
            J = -pin.Jlog6(apart.inverse()) @ pin.computeFrameJacobian(model, data, q, flange, pin.LOCAL)
            q = pin.integrate(model, q, -J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), error))
        found[i] = q


given_seed = given["seed"]
seconds = median_seconds(solve, 3)
apart = 0.0
for q, goal, good in zip(found, goals, solved, strict=True):
    if good:
        pin.framesForwardKinematics(model, data, q)
        apart = max(apart, float(np.abs(data.oMf[flange].translation - goal.translation).max()))
figures = {"poses": len(goals), "seconds": seconds, "solved": float(solved.mean()), "worst_position": apart}
report(figures, {"pin": pin.__version__, "numpy": np.__version__})
