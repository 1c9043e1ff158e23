"""What it costs that plans can be driven: time, and what they tell, for an arm of each maker.

Each arm is planned three times with 30 poses of 5000 candidates: anywhere within its limits as drawn, where it keeps
clear with ways checked, and the same with limits of a quarter in the middle of each joint. Times are processor seconds
of one run, after a first one that is not counted; compare them within a line. Argument: arms of the library (twelve,
of eleven makers). Writes benchmarks/driven_plans.json.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import truearm
from truearm.engine.fit.models import named_model
from truearm.engine.motion.constraints import Constraints, joint_window
from truearm.engine.robot.robot import Robot
from truearm.planning.choosing import plan_measurements, random_candidates, with_targets
from truearm.planning.result import Plan

POSES, CANDIDATES = 30, 5000
ARMS = (
    "fr3",
    "gp7",
    "irb120",
    "irb1200_5_0.9",
    "katana450",
    "kr10_r1100",
    "lrmate200id",
    "meca500",
    "rs007l",
    "tx2_60",
    "ur5e",
    "vs060",
)


def anywhere(robot: Robot) -> dict[str, float]:
    """Plan as if nothing were in the way; count flanges below the base and joints beyond a turn."""
    started, rng = time.process_time(), np.random.default_rng(0)
    seen = with_targets(robot)
    among = random_candidates(seen, CANDIDATES, rng)
    made = plan_measurements(seen, among, named_model("geometric"), poses=POSES, rng=rng)
    seconds = time.process_time() - started
    turning = [k for k, joint in enumerate(robot.joints) if joint.kind == "revolute"]
    return {
        "seconds": seconds,
        "error_mm": 1e3 * made.prediction.planned,
        "below": int((seen.forward(made.joints)[0][:, 2] < 0.0).sum()),
        "largest_deg": math.degrees(float(np.abs(made.joints[:, turning]).max())),
    }


def driven(robot: Robot, rules: Constraints | None = None) -> dict[str, Any]:
    """Plan where the arm keeps clear."""
    started = time.process_time()
    try:
        planned = truearm.plan(robot, poses=POSES, candidates=CANDIDATES, constraints=rules)
    except truearm.InputError as refusal:
        return {"refused": str(refusal)}
    return {"seconds": time.process_time() - started, **told(planned)}


def told(planned: Plan) -> dict[str, Any]:
    """Return what a plan says of itself."""
    tour = planned.tour
    assert tour is not None
    return {
        "error_mm": 1e3 * planned.made.prediction.planned,
        "usable": planned.made.usable,
        "via_points": sum(stop.kind == "via" for stop in tour.stops),
        "room_mm": 1e3 * tour.room,
        "flange_mm": 1e3 * float(planned.made.robot.forward(planned.joints)[0][:, 2].min()),
    }


def quarter(robot: Robot) -> Constraints:
    """Return limits of a quarter of each joint's, in their middle."""
    limits = {}
    for k, (low, high) in enumerate(zip(*joint_window(robot), strict=True)):
        by = math.degrees(1.0) if robot.joints[k].kind == "revolute" else 1e3
        middle, half = by * (low + high) / 2, by * (high - low) / 8
        limits[k + 1] = (float(middle - half), float(middle + half))
    entries = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}, "limits": limits}
    return Constraints.model_validate(entries)


def main() -> None:
    """Run all arms, print and write what was found."""
    names = sys.argv[1:] or ARMS
    driven(truearm.load_robot(names[0]))
    found = {}
    for name in names:
        robot = truearm.load_robot(name)
        found[name] = {"anywhere": anywhere(robot), "driven": driven(robot), "quarter": driven(robot, quarter(robot))}
        sys.stdout.write(f"{name}: {json.dumps(found[name])}\n")
        sys.stdout.flush()
    Path(__file__).with_suffix(".json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
