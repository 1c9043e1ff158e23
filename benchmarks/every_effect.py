"""What `auto` finds, how well that predicts, and how long it takes: twins, and the measured IRB 120 and UR5.

The time is that of the model with every effect, over that of one elastic fit to the same data, in one process.
Argument: seeds (10). Writes benchmarks/every_effect.json. The measured data are found at TRUEARM_DATA.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.engine.twin.twin_joint import JointTruth
from truearm.importing.files import read_matrices

DATA = Path(os.environ.get("TRUEARM_DATA", Path(__file__).parents[2] / "shared" / "data"))
PAYLOAD = Payload(2.7, (0.05, 0.025, 0.1))


def irb120() -> Dataset:
    """Return the readings of the IRB 120, three targets."""
    folder = DATA / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    return read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")[0]


def ur5(name: str) -> Dataset:
    """Return readings of the UR5, one target."""
    rows = np.genfromtxt(DATA / "ur5-tracker" / f"{name}.csv", delimiter=",", skip_header=1)
    reached = 1e-3 * (rows[:, 1:4] + rows[:, 4:7])
    return Dataset.of(np.radians(rows[:, 7:13]), reached, order=np.arange(len(rows)))


def twin(backlash: float, *, one_target: bool) -> Dataset:
    """Return readings of a twin of the IRB 120 whose joints bend, and have backlash [rad] at joints 2 and 3."""
    robot, rng = load_robot("irb120").with_payload(PAYLOAD), np.random.default_rng(0)
    soft = {2: JointTruth(3e-5, backlash=backlash), 3: JointTruth(1.3e-4, backlash=backlash), 5: JointTruth(4e-4)}
    true = replace(truth_twin(robot, "random", rng), joints=soft)
    data = measure(true, robot.random_configurations(400, rng), 2e-5, rng)
    return replace(data.of_readings(data.target == 0), targets=data.targets[:1]) if one_target else data


def mean_mm(robot: Robot, data: Dataset) -> float:
    """Return the mean error [mm]."""
    return 1e3 * float(errors_of(robot, data).position_norms.mean())


def timed(make: Callable[[], Any]) -> tuple[Any, float]:
    """Return what is made, and the processor's time for it [s]."""
    start = time.process_time()
    return make(), time.process_time() - start


def one(robot: Robot, data: Dataset, count: int, seed: int, elsewhere: Dataset | None) -> dict[str, Any]:
    """Return the figures of one split."""
    order = np.random.default_rng(seed).permutation(data.configurations)
    training, rest = data.of_configurations(order[:count]), data.of_configurations(order[count:])
    identify(robot, training, named_model("geometric"))
    elastic, of_elastic = timed(lambda: identify(robot, training, named_model("elastic")))
    (_, fit, shares), of_auto = timed(lambda: identify_every_effect(robot, training, seed=seed))
    geometric = identify(robot, training, named_model("geometric"))
    found: dict[str, Any] = {
        "seed": seed,
        "moves": {one.effect: 1e3 * (one.moves or 0.0) for one in shares.effects if one.taken},
        "status": fit.status.value,
        "lines": [[line.joint, line.periods] for line in shares.lines],
        "seconds": of_auto,
        "ratio": of_auto / of_elastic,
    }
    unordered = replace(rest, number=None, approach=None)
    for name, model in (("geometric", geometric), ("elastic", elastic), ("auto", fit)):
        found[name] = mean_mm(model.robot, rest)
        found[f"{name}, no order"] = mean_mm(model.robot, unordered)
        if elsewhere is not None:
            sizes = 1e3 * errors_of(model.robot, replace(elsewhere, number=None, approach=None)).position_norms
            found[f"{name}, random"] = float(sizes.mean())
            found[f"{name}, random, standard error"] = float(sizes.std(ddof=1) / np.sqrt(len(sizes)))
    return found


def main() -> None:
    """Run all splits, print and write them."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    robot, arm = load_robot("irb120").with_payload(PAYLOAD), load_robot("ur5")
    unknown = replace(robot, joints=tuple(replace(joint, transmission_periods=None) for joint in robot.joints))
    twins = {
        f"twin that {what}, {count}, {targets}": (robot, twin(play, one_target=targets == "one target"), count, None)
        for what, play in (("bends", 0.0), ("bends and has backlash", 3e-4))
        for count, targets in ((12, "one target"), (20, "one target"), (20, "three targets"), (30, "one target"))
    }
    cases: dict[str, tuple[Robot, Dataset, int, Dataset | None]] = {
        **twins,
        "IRB 120, 20": (robot, irb120(), 20, None),
        "IRB 120, 30": (robot, irb120(), 30, None),
        "UR5, 20 of the grid": (arm, ur5("grid"), 20, None),
        "UR5, 30 of the grid": (arm, ur5("grid"), 30, None),
        "IRB 120, 40": (robot, irb120(), 40, None),
        "IRB 120, 300": (robot, irb120(), 300, None),
        "IRB 120, 300, periods not given": (unknown, irb120(), 300, None),
        "UR5, 700 of the grid": (arm, ur5("grid"), 700, ur5("random")),
    }
    found: dict[str, list[dict[str, Any]]] = {}
    for name, (nominal, data, count, elsewhere) in cases.items():
        found[name] = []
        for seed in range(seeds):
            found[name].append(one(nominal, data, count, seed, elsewhere))
            sys.stdout.write(f"{name}: {json.dumps(found[name][-1])}\n")
            sys.stdout.flush()
        keys = [key for key, value in found[name][0].items() if isinstance(value, float)]
        medians = {key: round(float(np.median([row[key] for row in found[name]])), 4) for key in keys}
        sys.stdout.write(f"{name}, medians: {medians}\n")
        Path(__file__).with_suffix(".json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
