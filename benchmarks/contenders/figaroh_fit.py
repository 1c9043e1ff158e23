"""FIGAROH: the geometric fit of ``calc_updated_fkm`` by ``scipy.optimize.least_squares``, as its users run it.

A robot's class derives from ``BaseCalibration``, says that base and tool frame are unknown and gives the cost. The
cost here is the cheapest that its documentation allows: measured minus predicted coordinates, without weights. The
time is that of ``least_squares`` alone, with the method, the start and the limits of ``solve_optimisation``; what
comes before (``initialize``, the choice of parameters) is timed on its own.
"""

from __future__ import annotations

import csv
import logging
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import scipy
import yaml
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm, initialize_variables
from figaroh.tools.robot import load_robot
from scipy.optimize import least_squares
from stopwatch import inputs, median_seconds, report

logging.disable(logging.WARNING)


class Irb120(BaseCalibration):
    """The IRB 120 with three markers, base and tool frame unknown."""

    def __init__(self, robot: object, config: str) -> None:
        super().__init__(robot, config)
        self.calib_config["known_baseframe"] = False
        self.calib_config["known_tipframe"] = False

    def cost_function(self, var: np.ndarray) -> np.ndarray:
        return self.PEE_measured - calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)


def configuration(folder: Path, q: np.ndarray, position: np.ndarray, joints: list[str], tool: str) -> str:
    """Write measurements and configuration in FIGAROH's own formats."""
    markers = position.shape[1]
    with (folder / "data.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow([f"{a}{k + 1}" for k in range(markers) for a in "xyz"] + joints)
        rows.writerows(np.hstack([position.reshape(len(q), -1), q]).tolist())
    seen = {"measurable_dof": [True, True, True, False, False, False]}
    calibration = {
        "kinematics": {"base_frame": "universe", "tool_frame": tool},
        "joints": {"active_joints": joints},
        "parameters": {"calibration_level": "full_params", "outlier_threshold": None},
        "measurements": {"markers": [seen] * markers},
        "data": {"number_of_samples": len(q), "source_file": str(folder / "data.csv")},
    }
    text = {"robot": {"name": "irb120"}, "tasks": {"calibration": calibration}}
    (folder / "config.yaml").write_text(yaml.safe_dump(text))
    return str(folder / "config.yaml")


figures: dict[str, object] = {}
for kind in ("simulated", "measured"):
    fits, starts, errors, evaluations = [], [], [], []
    for path in sorted(inputs().glob(f"{kind}-*.npz")):
        given = np.load(path)
        with tempfile.TemporaryDirectory() as folder:
            robot = load_robot(str(inputs() / "nominal.urdf"))
            joints = list(robot.model.names)[1:]
            tool = robot.model.frames[robot.model.nframes - 1].name
            calibration = Irb120(robot, configuration(Path(folder), given["q"], given["position"], joints, tool))
            start = time.perf_counter()
            calibration.initialize()
            x0, _ = initialize_variables(calibration.calib_config, mode=0)
            guess = calibration.initial_frame_guess()
            x0 = np.array([guess.get(n, v) for n, v in zip(calibration.calib_config["param_name"], x0, strict=True)])
            starts.append(time.perf_counter() - start)

        def fit(calibration: Irb120 = calibration, x0: np.ndarray = x0) -> object:
            return least_squares(calibration._objective, x0, method="lm", max_nfev=1000)

        fits.append(median_seconds(fit, 2))
        result = fit()
        evaluations.append(int(result.nfev))
        figures["parameters"] = len(x0)
        held_out = {**calibration.calib_config, "NbSample": len(given["held_out"])}
        found = calc_updated_fkm(calibration.model, calibration.data, result.x, given["held_out"], held_out)
        found = found.reshape(-1, 3, len(given["held_out"])).transpose(2, 0, 1)
        errors.append(float(np.linalg.norm(found - given["held_out_position"], axis=2).mean()))
    if fits:
        figures[kind] = {"fit": fits, "start": starts, "held_out": errors, "evaluations": evaluations}
report(figures, {"figaroh": version("figaroh"), "pin": version("pin"), "scipy": scipy.__version__})
