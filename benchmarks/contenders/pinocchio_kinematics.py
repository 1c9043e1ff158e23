"""Pinocchio from Python: forward kinematics and the joint Jacobian of the flange, one configuration at a time."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from stopwatch import inputs, median_seconds, report

given = np.load(inputs() / "kinematics.npz")
model = pin.buildModelFromUrdf(str(inputs() / "real.urdf"))
data = model.createData()
flange = model.nframes - 1
q = given["q"]
position, jacobian = np.empty((len(q), 3)), np.empty((len(q), 6, model.nv))


def both() -> None:
    """computeFrameJacobian does the forward kinematics itself and leaves the frame's placement in the data."""
    for i in range(len(q)):
        jacobian[i] = pin.computeFrameJacobian(model, data, q[i], flange, pin.LOCAL_WORLD_ALIGNED)
        position[i] = data.oMf[flange].translation


def both_step_by_step() -> None:
    for i in range(len(q)):
        pin.computeJointJacobians(model, data, q[i])
        pin.updateFramePlacement(model, data, flange)
        jacobian[i] = pin.getFrameJacobian(model, data, flange, pin.LOCAL_WORLD_ALIGNED)
        position[i] = data.oMf[flange].translation


def forward() -> None:
    for i in range(len(q)):
        pin.forwardKinematics(model, data, q[i])
        pin.updateFramePlacement(model, data, flange)
        position[i] = data.oMf[flange].translation


figures = {}
for name, compute in (("position", forward), ("fused", both), ("step_by_step", both_step_by_step)):
    position[:], jacobian[:] = np.nan, given["jacobian"]
    figures[name] = median_seconds(compute, 30)
    figures[f"{name}_difference"] = max(
        float(np.abs(position - given["position"]).max()), float(np.abs(jacobian - given["jacobian"]).max())
    )
figures["position_and_jacobian"] = min(figures["fused"], figures["step_by_step"])
report(figures, {"pin": pin.__version__, "numpy": np.__version__})
