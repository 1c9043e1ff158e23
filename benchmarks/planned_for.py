"""Holds configurations chosen for one place against as many chosen by O1: the error at that place.

Simulated robots are judged by their truth, the measured IRB 120 by readings that were held out. Argument: robots, or
splits of the measured data (10). Writes benchmarks/planned_for.json. The measured data are found at TRUEARM_DATA.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np

from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.importing.files import read_matrices
from truearm.planning import accuracy as prediction
from truearm.planning.accuracy import accuracy_goal
from truearm.planning.choosing import plan_measurements, random_candidates, with_targets

POSES, CANDIDATES, NOISE = 30, 3000, 1e-4
OBJECTIVES = ("O1", "error")
#: Side of the cube [m], largest angle of the tool from vertical [deg], targets at most.
PLACES = ((0.1, 25.0, 15), (0.25, 25.0, 60), (0.5, 60.0, 60))
PROGRAM = Path(__file__).parents[1] / "tests/engine/programs/samples/rapid/polish.mod"
PAYLOAD = Payload(2.7, (0.05, 0.025, 0.1))


def there(joints: Array) -> Postures:
    """Return postures at joint positions, all coming forward."""
    return Postures(joints, approach=np.ones_like(joints), number=np.zeros(len(joints)))


def in_a_cube(side: float, angle: float, most: int) -> Array:
    """Return joint positions with the flange in a cube and the tool near vertical."""
    nominal, rng = load_robot("irb120"), np.random.default_rng(0)
    drawn = nominal.random_configurations(300_000, rng)
    place, turn = nominal.world_poses(drawn)
    inside = (np.abs(place - [0.4, 0.0, 0.3]) < side / 2).all(axis=1) & (turn[:, 2, 2] < -np.cos(np.radians(angle)))
    return np.asarray(drawn[inside][:most])


def of_program() -> Array:
    """Return joint positions at the targets of the program."""
    robot = load_robot("irb120")
    goal = accuracy_goal(robot, PROGRAM, None, None, None, np.random.default_rng(0))
    return np.asarray(goal.postures.joints) if goal else np.empty((0, 6))


def simulated(targets: Array, robots: int) -> list[float]:
    """Return the ratio of errors for each robot."""
    nominal, model = load_robot("irb120"), named_model("geometric")
    arm, rng = with_targets(nominal), np.random.default_rng(0)
    among = random_candidates(arm, CANDIDATES, rng)
    plans = {
        one: plan_measurements(arm, among, model, poses=POSES, rng=rng, objective=one, accurate_at=there(targets))
        for one in OBJECTIVES
    }
    ratios = []
    for seed in range(robots):
        twin = truth_twin(nominal, "random", np.random.default_rng(seed))
        error = dict.fromkeys(OBJECTIVES, 0.0)
        for one, plan in plans.items():
            for campaign in range(15):
                data = measure(twin, plan.joints, NOISE, np.random.default_rng(1000 * campaign + seed))
                fit = identify(nominal, data, model)
                for name in data.targets:
                    apart = fit.robot.world_poses(targets, name)[0] - twin.robot.world_poses(targets, name)[0]
                    error[one] += float(np.linalg.norm(apart, axis=1).mean())
        ratios.append(error["error"] / error["O1"])
    return ratios


def measured(model_name: str, splits: int) -> list[float]:
    """Return the ratio of errors for each split of the measured data."""
    folder = Path(os.environ.get("TRUEARM_DATA", Path(__file__).parents[2] / "shared" / "data")) / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")
    nominal, model = load_robot("irb120").with_payload(PAYLOAD), named_model(model_name)
    place = nominal.world_poses(data.joints)[0]
    ratios = []
    for seed in range(splits):
        rng = np.random.default_rng(seed)
        order = rng.permutation(data.configurations)
        pool, rest = data.of_configurations(order[:300]), order[300:]
        middle = place[rng.integers(data.configurations)]
        inside = rest[(np.abs(place[rest] - middle) < 0.15).all(axis=1)]
        arm = with_targets(nominal, pool)
        error = {}
        for one in OBJECTIVES:
            plan = plan_measurements(
                arm, pool.postures, model, poses=POSES, rng=rng, objective=one, accurate_at=there(data.joints[inside])
            )
            fit = identify(nominal, pool.of_configurations(plan.chosen), model)
            error[one] = float(errors_of(fit.robot, data.of_configurations(inside)).position_norms.mean())
        ratios.append(error["error"] / error["O1"])
    return ratios


def main() -> None:
    """Run all cases, print and write them."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    prediction.NUMBERS = (POSES,)  # type: ignore[misc]
    found = {f"simulated, {PROGRAM.name}": simulated(of_program(), count)}
    for side, angle, most in PLACES:
        name = f"simulated, {most} targets, cube of {1e3 * side:g} mm, {angle:g} deg"
        found[name] = simulated(in_a_cube(side, angle, most), count)
    found |= {f"measured, {model}": measured(model, count) for model in ("elastic", "geometric")}
    for name, ratios in found.items():
        sys.stdout.write(f"{name}: median {np.median(ratios):.3f}, {min(ratios):.2f} to {max(ratios):.2f}\n")
    Path(__file__).with_suffix(".json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
