"""Counts how often a robot is doubted that is the right one, and how often one that only looks alike is not.

Robots are drawn from the priors, measured over their full range or within so many degrees of a posture drawn anew, with
0.05 mm of noise at 40 configurations. Compliances of elastic ones are those of the IRB 120's published truth. Argument:
robots for each case (50). Writes benchmarks/wrong_robot.json.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.wrong_robot import Lengths
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.engine.twin.twin_joint import PERFECT

WIDTHS = (None, 40.0, 15.0)
POSES, NOISE, DOUBTED = 40, 0.05e-3, 1e-4
COMPLIANCE = {2: 0.032e-3, 3: 0.130e-3, 4: 0.605e-3, 5: 0.419e-3, 6: 0.647e-3}
#: The robot that is measured, the one whose file is given, whether its joints give way, and the model.
CASES = (
    ("irb120", "irb120", False, "geometric"),
    ("irb120", "irb120", True, "geometric"),
    ("irb120", "irb120", True, "elastic"),
    ("ur10", "ur10", False, "geometric"),
    ("kr5", "kr5", False, "geometric"),
    ("katana450", "katana450", False, "geometric"),
    ("ur10e", "ur10", False, "geometric"),
    ("ur10e", "ur10", False, "elastic"),
    ("ur10", "ur10e", False, "geometric"),
)


def within(robot: Robot, width: float | None, rng: np.random.Generator) -> Robot:
    """Return a robot with limits `width` degrees about a posture in the middle of its range; its own without."""
    if width is None:
        return robot
    low, high = np.array([joint.range for joint in robot.joints]).T
    middle = rng.uniform(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high)
    half = np.radians(width)
    limits = zip(np.maximum(low, middle - half).tolist(), np.minimum(high, middle + half).tolist(), strict=True)
    return replace(robot, joints=tuple(replace(j, limits=pair) for j, pair in zip(robot.joints, limits, strict=True)))


def measured(robot: Robot, width: float | None, targets: int, *, elastic: bool, rng: np.random.Generator) -> Dataset:
    """Draw a robot from its priors and measure it with some of its three targets."""
    twin = truth_twin(robot, "random", rng)
    tool = {t.name: [twin.robot.values[t.parameter(a)] for a in "xyz"] for t in twin.robot.targets[:targets]}
    joints = {i: replace(PERFECT, compliance=c) for i, c in COMPLIANCE.items()} if elastic else twin.joints
    twin = replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool), joints=joints)
    return measure(twin, within(robot, width, rng).random_configurations(POSES, rng), NOISE, rng)


def cases(robots: int) -> Iterator[dict[str, Any]]:
    """Go through robots, widths and targets."""
    for real, given, elastic, model in CASES:
        for width in WIDTHS:
            for targets in (3, 1):
                found = []
                for seed in range(robots):
                    rng = np.random.default_rng((seed, targets))
                    data = measured(load_robot(real), width, targets, elastic=elastic, rng=rng)
                    found.append(Lengths.of(identify(load_robot(given), data, named_model(model)), data))
                squares = [lengths.chi_squared for lengths in found]
                yield {
                    "measured": real,
                    "given": given,
                    "elastic": elastic,
                    "model": model,
                    "width_deg": width,
                    "targets": targets,
                    "robots": robots,
                    "doubted": sum(lengths.chance < DOUBTED for lengths in found),
                    "combinations": sorted({len(lengths.moved) for lengths in found}),
                    "chi_squared": [round(v, 1) for v in (min(squares), float(np.median(squares)), max(squares))],
                }


def main() -> None:
    """Show every case and write them all."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    rows = []
    for row in cases(robots):
        rows.append(row)
        sys.stdout.write(f"{json.dumps(row)}\n")
    Path(__file__).with_suffix(".json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
