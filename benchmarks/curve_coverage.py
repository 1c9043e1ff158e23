"""Holds the error to expect over the workspace of fits with joint curves, and the curves' bands, against twins.

Arguments: twins of each case (4), and the cases (all). An IRB 120 and a UR5 in turn, noise of 0.03 mm, three targets,
200 configurations; 400 of its measured grid for the UR5, which is found at TRUEARM_DATA. Writes
benchmarks/curve_coverage.json.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.curves import fitted_curves
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

OUT = Path(__file__).with_suffix(".json")
DATA = Path(os.environ.get("TRUEARM_DATA", Path(__file__).parents[2] / "shared" / "data"))
MODEL = named_model("geometric").also(["joint-curve"])
NOISE, EXACT = 3e-5, 2e-9
POSES, GRID_POSES, JUDGED = 200, 400, 400
#: Centres of narrow ranges, from the middle of each joint's [rad].
CENTRE = np.radians([10.0, 20.0, 10.0, 20.0, 40.0, 10.0])
Ranges = Callable[[Array, Array], tuple[Array, Array]]


def all_of_it(low: Array, high: Array) -> tuple[Array, Array]:
    """Return the joints' own ranges."""
    return low, high


def joint_2_within_60(low: Array, high: Array) -> tuple[Array, Array]:
    """Return them with the second one narrow."""
    narrow, middle = np.radians(30.0), (low[1] + high[1]) / 2.0
    low[1], high[1] = middle - narrow, middle + narrow
    return low, high


def all_within_90(low: Array, high: Array) -> tuple[Array, Array]:
    """Return them with all of them narrow."""
    middle = (low + high) / 2.0 + CENTRE
    return np.maximum(low, middle - np.radians(45.0)), np.minimum(high, middle + np.radians(45.0))


#: Truth and ranges of each case; the grid has no ranges.
CASES: Final[dict[str, tuple[str, Ranges | None]]] = {
    "gear-errors": ("gear-errors", all_of_it),
    "tooth-errors": ("tooth-errors", all_of_it),
    "joint 2 within 60 deg": ("gear-errors", joint_2_within_60),
    "all joints within 90 deg": ("gear-errors", all_within_90),
    "UR5 grid": ("gear-errors", None),
    "no curves": ("random", all_of_it),
}


@cache
def grid() -> Array:
    """Return the joint positions at which the UR5 was measured [rad]."""
    return np.radians(np.genfromtxt(DATA / "ur5-tracker" / "grid.csv", delimiter=",", skip_header=1)[:, 7:13])


def poses(robot: Robot, ranges: Ranges | None, rng: np.random.Generator) -> Array:
    """Return joint positions to measure at."""
    if ranges is None:
        return grid()[rng.permutation(len(grid()))[:GRID_POSES]]
    low, high = np.array([joint.range for joint in robot.joints]).T
    low, high = ranges(np.maximum(low, -math.pi), np.minimum(high, math.pi))
    return np.asarray(rng.uniform(low, high, (POSES, len(low))))


def true_curve(twin: Twin, number: int, angles: Array) -> Array:
    """Return what is true of a joint [rad], about its mean over a turn: the rest is the joint's zero."""
    joint = twin.joints.get(number)
    if joint is None:
        return np.zeros(len(angles))
    turn = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    mean = np.mean([joint.turn(q, 0.0, 0.0) for q in turn.tolist()])
    return np.array([joint.turn(q, 0.0, 0.0) for q in angles.tolist()]) - mean


def judged(case: str, seed: int) -> dict[str, Any]:
    """Return true and stated errors [mm] of a twin, and the shares of its true curves that lie within the bands."""
    truth, ranges = CASES[case]
    robot = load_robot("ur5" if ranges is None or seed % 2 else "irb120")
    twin = truth_twin(robot, truth, np.random.default_rng(1000 + seed))
    rng = np.random.default_rng((seed, 7))
    data = measure(twin, poses(robot, ranges, rng), NOISE, rng)
    fit = identify(robot, data, MODEL)
    stated = expected_error(as_residuals_allow(fit, data)).overall
    clean = measure(twin, robot.random_configurations(JUDGED, rng), EXACT, rng)
    inside, every = [], []
    for curve in fitted_curves(fit, data):
        value, deviation = curve.at(curve.angles)
        held = np.abs(value - true_curve(twin, curve.number, curve.angles)) < 1.96 * deviation
        measured = np.zeros(len(held), dtype=bool)
        for low, high in curve.measured:
            measured |= (curve.angles >= low) & (curve.angles <= high)
        inside += held[measured].tolist()
        every += held.tolist()
    return {
        "true": 1e3 * float(errors_of(fit.robot, clean).position_norms.mean()),
        "stated": 1e3 * stated.mean,
        "interval": [1e3 * end for end in stated.interval_90],
        "band_measured": float(np.mean(inside)) if inside else None,
        "band": float(np.mean(every)) if every else None,
    }


def main() -> None:
    """Go through the cases, and write what was found."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    record: dict[str, Any] = json.loads(OUT.read_text()) if OUT.exists() else {}
    for case in sys.argv[2:] or CASES:
        rows = [judged(case, seed) for seed in range(count)]
        held = sum(row["interval"][0] <= row["true"] <= row["interval"][1] for row in rows)
        above = sum(row["true"] > row["interval"][1] for row in rows)
        ratios = [row["stated"] / row["true"] for row in rows]
        bands = [np.mean([row[key] for row in rows if row[key] is not None] or [math.nan]) for key in _BANDS]
        record[case] = {"held": held, "of": count, "true_above": above, "twins": rows}
        OUT.write_text(json.dumps(record, indent=1) + "\n")
        sys.stdout.write(
            f"{case}: interval holds {held} of {count}, true above it {above}; stated by true {np.median(ratios):.2f} "
            f"({min(ratios):.2f} to {max(ratios):.2f}); "
            f"band holds {bands[0]:.2f} where measured, {bands[1]:.2f} in all\n"
        )
        sys.stdout.flush()


_BANDS: Final = ("band_measured", "band")

if __name__ == "__main__":
    main()
