"""What `auto` predicts of measured robots, beside the named models, and how long it takes.

Every model is fitted to the same part of the configurations and judged on the rest. Times are of the processor.
Argument: splits (10). Writes benchmarks/every_effect.json. The measured data are found at TRUEARM_DATA.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from compare import every_effect
from ruamel.yaml import YAML

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.every_effect import AUTO, identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.importing.files import read_matrices

DATA = Path(os.environ.get("TRUEARM_DATA", Path(__file__).parents[2] / "shared" / "data"))
PAYLOAD = Payload(2.7, (0.05, 0.025, 0.1))
#: The models beside `auto`; where nothing loads the joints, some of them are the same.
NAMED: Final = {
    **{name: named_model(name) for name in ("geometric", "elastic", "tilting", "full")},
    **{f"{name}, joint-curve": named_model(name).also(["joint-curve"]) for name in ("geometric", "elastic")},
}
#: Measured with a 6D metrology sensor; its nominal geometry is that of its makers.
POSITIONER: Final = """\
truearm: truearm-robot/1
name: positioner
units: {length: m, angle: deg}
convention: standard-dh
joints:
  - {d: 0, theta_offset: 0, a: 0, alpha: -90}
  - {d: -0.475, theta_offset: -90, a: 0, alpha: 0}
"""


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


def positioner() -> tuple[Robot, Dataset]:
    """Return the positioner of two joints, and its poses by the time they were measured at."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "positioner.yaml"
        file.write_text(POSITIONER)
        robot = load_robot(file)
    entries = YAML(typ="safe").load((DATA / "positioner" / "measurements.yaml").read_text())
    rows = [entries[when] for when in sorted(entries)]
    position, quaternion = (
        np.array([[row["pose"][k] for k in names] for row in rows]) for names in ("xyz", ("qw", "qx", "qy", "qz"))
    )
    joints, order = np.array([row["target_joints"] for row in rows]), np.arange(len(rows))
    return robot, Dataset.of(joints, position, quaternions=quaternion, sigma=1e-3, sigma_rot=1e-3, order=order)


def mean_mm(robot: Robot, data: Dataset) -> float:
    """Return the mean error [mm]."""
    return round(1e3 * float(errors_of(robot, data).position_norms.mean()), 5)


def timed(make: Callable[[], Fit]) -> tuple[Fit, float]:
    """Return a fit, and the processor's time for it [s]."""
    start = time.process_time()
    return make(), round(time.process_time() - start, 3)


def one(robot: Robot, data: Dataset, count: int, seed: int, elsewhere: Dataset | None) -> dict[str, dict[str, float]]:
    """Return the figures of every model at one split."""
    order = np.random.default_rng(seed).permutation(data.configurations)
    training, rest = data.of_configurations(order[:count]), data.of_configurations(order[count:])
    unordered, found = replace(rest, number=None, approach=None), {}
    identify(robot, training, NAMED["elastic"])  # so that no time has what is done once in it
    makes: dict[str, Callable[[], Fit]] = {n: lambda m=m: identify(robot, training, m) for n, m in NAMED.items()}
    makes[AUTO] = lambda: identify_every_effect(robot, training, seed=seed)[1]
    for name, make in makes.items():
        fit, seconds = timed(make)
        found[name] = {"mm": mean_mm(fit.robot, rest), "no order": mean_mm(fit.robot, unordered), "seconds": seconds}
        if elsewhere is not None:
            found[name]["random"] = mean_mm(fit.robot, replace(elsewhere, number=None, approach=None))
    return found


def main() -> None:
    """Run all splits, write them, and print the section."""
    splits = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    robot, arm = load_robot("irb120").with_payload(PAYLOAD), load_robot("ur5")
    unknown = replace(robot, joints=tuple(replace(joint, transmission_periods=None) for joint in robot.joints))
    faro, grid = irb120(), ur5("grid")
    cases: dict[str, tuple[Robot, Dataset, int, Dataset | None]] = {
        **{f"IRB 120, {count}": (robot, faro, count, None) for count in (20, 40, 80, 300)},
        "IRB 120, 300, periods not given": (unknown, faro, 300, None),
        **{f"UR5, {count} of the grid": (arm, grid, count, None) for count in (20, 40, 80, 300)},
        "UR5, 700 of the grid": (arm, grid, 700, ur5("random")),
        "positioner, 144": (*positioner(), 144, None),  # seven tenths, as `calibrate` takes
    }
    found: dict[str, list[dict[str, Any]]] = {}
    for name, (nominal, data, count, elsewhere) in cases.items():
        found[name] = []
        for seed in range(splits):
            found[name].append(one(nominal, data, count, seed, elsewhere))
            shown = {model: figures["mm"] for model, figures in found[name][-1].items()}
            sys.stdout.write(f"{name}, split {seed}: {shown}\n")
            sys.stdout.flush()
        Path(__file__).with_suffix(".json").write_text(json.dumps(found).replace("}}, ", "}},\n") + "\n")
    sys.stdout.write(every_effect())


if __name__ == "__main__":
    main()
