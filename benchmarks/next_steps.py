"""Is the right thing to do next named first, on simulated robots with one thing wrong each?

Truths are drawn: geometry and joint zeros from their priors, compliances of all joints, and a joint repeatability. They
are measured by the twin, on its own path, with a declared deviation or without. The arguments are the number of robots
(30, the published ones) and the seed of the first. Writes benchmarks/next_steps.json.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import DEFAULT_TOOL, truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth

#: What is wrong, and for how many of thirty robots.
FAULTS: Final = {
    "no payload": 5,
    "elastic robot, geometric model": 4,
    "one joint row 1 deg off": 5,
    "moved tracker": 4,
    "worn wrist": 4,
    "too few poses": 4,
    "at the noise": 4,
}
ROBOTS: Final = ("irb120", "lrmate200ic", "puma560", "ur5", "ur10")
NOISE: Final = 0.02e-3
POSES, FEW = 80, 16
#: What a joint of an unworn arm gives way by under the largest of its own loads [rad].
SAG: Final = 5e-4
REPEATABILITY: Final = np.radians(0.0005)


@dataclass(frozen=True, eq=False)
class Case:
    """A robot with one thing wrong.

    Attributes
    ----------
    fault
        What is wrong.
    robot
        The nominal robot's name.
    data
        What was measured.
    model, payload
        What it is calibrated with.
    right
        Codes of the steps that are right, each with a text that its message holds.
    mass
        What the robot carried [kg].
    """

    fault: str
    robot: str
    data: Dataset
    model: str
    payload: Payload | None
    right: tuple[tuple[str, str], ...]
    mass: float


def faults(count: int) -> Iterator[str]:
    """Go through what is wrong, as often as its share says."""
    thirty = [fault for fault, share in FAULTS.items() for _ in range(share)]
    for number in range(count):
        yield thirty[number % len(thirty)]


def case(fault: str, seed: int) -> Case:
    """Draw a robot with one thing wrong."""
    rng = np.random.default_rng((seed, 14))
    name = ROBOTS[int(rng.integers(len(ROBOTS)))]
    nominal = load_robot(name)
    arm = sum(link.mass for link in nominal.masses)
    tool = Payload(float(rng.uniform(0.06, 0.2)) * arm, tuple(rng.uniform((-0.03, -0.03, 0.04), (0.03, 0.03, 0.12))))
    twin = truth_twin(nominal, "random", rng)
    points = DEFAULT_TOOL.targets if rng.random() < 0.7 else {"1": DEFAULT_TOOL.targets["2"]}
    placed = twin.robot.with_frames(twin.robot.base, points).with_payload(tool)
    springs = sprung(nominal.with_payload(tool), rng)
    q = nominal.random_configurations(FEW if fault == "too few poses" else POSES, rng)
    worn: tuple[tuple[str, str], ...] = ()
    if fault == "worn wrist":
        springs, worn = with_worn_wrist(springs, rng)
    data = measured(Twin(placed, springs), q, rng)
    if rng.random() < 0.5:
        data = replace(data, sigma=None)
    k = int(rng.integers(len(q)))
    if fault == "one joint row 1 deg off":
        number = int(rng.integers(len(nominal.joints) - (len(points) == 1)))
        joints = data.joints.copy()
        joints[k, number] += np.radians(rng.choice((-1.0, 1.0)))
        data = replace(data, joints=joints)
        return Case(
            fault,
            name,
            data,
            "elastic",
            tool,
            (("measure-again", f"{number + 1} of configuration {k + 1} "),),
            tool.mass,
        )
    if fault == "moved tracker":
        first = int(rng.integers(15, len(q) - 15))
        shift = rng.normal(size=3)
        shift *= rng.uniform(0.15e-3, 1e-3) / np.linalg.norm(shift)
        late = data.configuration >= first
        data = replace(data, position=np.where(late[:, None], data.position + shift, data.position))
        near = tuple(("instrument-moved", f"base_changes={first + 1 + d}`") for d in (-2, -1, 0, 1, 2))
        return Case(fault, name, data, "elastic", tool, near, tool.mass)
    if fault == "no payload":
        return Case(fault, name, data, "elastic", None, (("give-payload", ""),), tool.mass)
    if fault == "elastic robot, geometric model":
        return Case(fault, name, data, "geometric", tool, (("other-model", "model=elastic"),), tool.mass)
    right = {"worn wrist": worn, "too few poses": (("measure-more", ""),), "at the noise": (("stop", ""),)}[fault]
    return Case(fault, name, data, "elastic", tool, right, tool.mass)


def sprung(robot: Robot, rng: np.random.Generator) -> dict[int, JointTruth]:
    """Draw the compliance of each joint, from the loads that its own arm puts on it."""
    q = robot.random_configurations(60, rng)
    loads = np.array([posture.loads[:, 5] for posture in Twin(robot, {}).postures(q)])
    largest = np.maximum(np.abs(loads).max(axis=0), 0.2 * np.abs(loads).max())
    return {i: JointTruth(compliance=float(SAG * rng.uniform(0.5, 1.5) / load)) for i, load in enumerate(largest, 1)}


def with_worn_wrist(
    springs: dict[int, JointTruth], rng: np.random.Generator
) -> tuple[dict[int, JointTruth], tuple[tuple[str, str], ...]]:
    """Wear the joint before the last: play and tilt, or a hysteresis; also return which effects are right."""
    number = len(springs) - 1
    size = float(rng.uniform(3e-4, 8e-4))
    if rng.random() < 0.5:
        worn = replace(springs[number], backlash=2.0 * size, clearance=size)
        right = (("other-model", "effects=backlash"), ("other-model", "effects=clearance"))
    else:
        worn = replace(springs[number], hysteresis=size)
        right = (("other-model", "effects=approach"),)
    return {**springs, number: worn}, right


def measured(twin: Twin, q: Array, rng: np.random.Generator) -> Dataset:
    """Measure a twin that repeats as arms do."""
    reached = q + REPEATABILITY * rng.standard_normal(q.shape)
    data = measure(twin, reached, NOISE, rng)
    return replace(data, joints=q)


def calibrated(of: Case) -> Calibration:
    """Calibrate a robot as `truearm calibrate` does."""
    return calibrate(of.robot, of.data, model=of.model, payload=of.payload)


def is_right(of: Case, found: Calibration) -> bool:
    """Return whether the right step is first."""
    first = found.next[0]
    return any(first.code == code and text in first.message for code, text in of.right)


def told_mass(step: dict[str, Any]) -> float | None:
    """Return the mass of the payload that a step tells [kg], None if it tells none."""
    told = re.search(r"about ([0-9.]+) kg", step["message"])
    return None if told is None else float(told[1])


def main(count: int, first: int) -> None:
    """Judge robots, print what was wrong with the wrong ones, and write the figures."""
    rows: list[dict[str, Any]] = []
    for seed, fault in enumerate(faults(count), first):
        drawn = case(fault, seed)
        found = calibrated(drawn)
        right = is_right(drawn, found)
        steps = [step.summary() for step in found.next]
        row = {"fault": fault, "robot": drawn.robot, "seed": seed, "payload_kg": round(drawn.mass, 3), "right": right}
        rows.append({**row, "next": steps})
        if not right:
            said = (f"{fault}, {drawn.robot}, seed {seed}", *(step.line for step in found.next))
            sys.stdout.write("\n    ".join(said) + "\n")
    of = {f: [row["right"] for row in rows if row["fault"] == f] for f in FAULTS}
    figures = {f: {"robots": len(r), "right_first": sum(r)} for f, r in of.items() if r}
    masses = [(row["payload_kg"], told_mass(row["next"][0])) for row in rows if row["fault"] == "no payload"]
    ratios = sorted(told / true for true, told in masses if told is not None)
    total = {"robots": len(rows), "right_first": sum(row["right"] for row in rows)}
    sys.stdout.write(json.dumps({"all": total, **figures, "told_over_true_payload": ratios}, indent=1) + "\n")
    if (count, first) == (30, 0):
        text = json.dumps({"all": total, "faults": figures, "told_over_true_payload": ratios, "robots": rows}, indent=1)
        Path(__file__).with_suffix(".json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    main(*(numbers + [30, 0][len(numbers) :]))
