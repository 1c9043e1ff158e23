"""Intervals by Monte Carlo as JSON and the command show them, in the units of the parameters and in mm."""

from __future__ import annotations

from typing import Any

import numpy as np

from truearm.identification.judging.simulated_calibrations import PredictedError, SimulatedCalibrations
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.parameters import PLACES
from truearm.modeling.robot import Robot
from truearm.units import SHOWN_AS, from_si


def simulated_summary(found: SimulatedCalibrations, robot: Robot) -> dict[str, Any]:
    """Return intervals of parameters and predictions, those by Monte Carlo beside the linear ones."""
    made: dict[str, Any] = {"trials": found.asked, "settled": found.settled, "seed": found.seed}
    if not found.settled:
        return made
    rows = []
    for name, deviation, linear, interval, of_linear, coverage in zip(
        found.names,
        found.deviation.tolist(),
        found.linear_deviation.tolist(),
        found.interval_95.tolist(),
        found.linear_interval_95.tolist(),
        found.coverage.tolist(),
        strict=True,
    ):
        if robot.parameters[name].group == JointCurve.name:
            continue
        unit = SHOWN_AS[robot.parameters[name].unit]
        rows.append(
            {
                "name": name,
                "unit": unit,
                "deviation": from_si(deviation, unit),
                "linear_deviation": from_si(linear, unit),
                "interval_95": [from_si(end, unit) for end in interval],
                "linear_interval_95": [from_si(end, unit) for end in of_linear],
                "coverage": coverage,
            }
        )
    return {
        **made,
        "coverage": arm_coverage(found, robot),
        "predictions_mm": {"held_out": _predicted(found.held_out), "workspace": _predicted(found.workspace)},
        "parameters": rows,
    }


def _predicted(error: PredictedError | None) -> dict[str, Any] | None:
    if error is None:
        return None
    return {
        "mean": error.mean * 1e3,
        "interval_90": [end * 1e3 for end in error.interval_90],
        "linear_mean": error.linear_mean * 1e3,
        "linear_interval_90": [end * 1e3 for end in error.linear_interval_90],
    }


def arm_coverage(found: SimulatedCalibrations, robot: Robot) -> float:
    """Return the share of linear intervals that held the truth, over the arm's parameters; of all if it has none.

    Terms of joint curves do not count: each is a part of a curve.
    """
    own = np.array([robot.parameters[name].group not in (*PLACES, JointCurve.name) for name in found.names])
    return float(found.coverage[own if own.any() else ~own].mean())


def simulated_lines(found: SimulatedCalibrations | None, robot: Robot) -> list[str]:
    """Return what the simulated calibrations say, in a line."""
    if found is None:
        return []
    if not found.settled:
        return [f"Monte Carlo: none of {found.asked} simulated calibrations converged"]
    error = found.held_out
    words = ""
    if error is not None:
        ends, linear = (
            " to ".join(f"{end * 1e3:.3f}" for end in pair) for pair in (error.interval_90, error.linear_interval_90)
        )
        words = (
            f"; uncertain parameters move unseen positions by {error.mean * 1e3:.3f} mm on average "
            f"(90 %: {ends}; linear: {error.linear_mean * 1e3:.3f}, {linear})"
        )
    return [
        f"Monte Carlo: in {found.settled} simulated calibrations {100.0 * arm_coverage(found, robot):.1f} % of the "
        f"linear 95 % intervals held the truth{words}"
    ]
