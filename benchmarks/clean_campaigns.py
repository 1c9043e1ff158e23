"""Counts how often each rule speaks on campaigns in which nothing is wrong, and on the same ones with a fault.

Twenty robots are drawn from their priors, with joints that give way and repeat as arms do. A tracker reads three
reflectors, markers are read as a pose, or four strings read distances; 10 to 300 configurations, with a load that is
told or without. Each campaign goes through `check` and `calibrate` as they are by default. In every tenth round of the
robots those of few configurations also have each fault, one at a time. Arguments: campaigns (1000), and the first (0).
Two processes. Writes benchmarks/clean_campaigns.json, which holds the first 804: that run was ended early.
"""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np
from next_steps import sprung

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import in_view_of, positions, seen_by
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin

OUT: Final = Path(__file__).with_suffix(".json")
ROBOTS: Final = (
    *("irb120", "irb1200_7_0.7", "irb1600", "irb2600_12_1.85", "irb4600_60_2.05", "kr6_r900", "kr10_r1100", "kr5"),
    *("lrmate200ic", "m20id_25", "gp7", "gp25", "rs007l", "rv7frl", "tx2_60", "puma560", "ur5", "ur10e", "xarm6"),
    "meca500",
)
INSTRUMENTS: Final = ("tracker", "markers", "strings")
#: Configurations of the smallest campaign, which has about twice as many numbers as the geometry has parameters.
FEWEST: Final = {"tracker": 10, "markers": 15, "strings": 25}
#: Joint repeatability [deg], of the best arms to fair ones.
REPEATABILITY: Final = (0.0003, 0.002)
FAULTY: Final = 10
SMALL: Final = 60
TRACKER_NOISE: Final = 2e-5


@dataclass(frozen=True, eq=False)
class Arm:
    """A true arm that stops a little beside where it is sent, always in the same way."""

    twin: Twin
    deviation: float  #: Of each joint [rad].

    def frames(self, joints: Array) -> dict[str, Array]:
        """Return the poses of its targets at joint positions ``(n, joints)``."""
        missed = [np.random.default_rng(list(q.tobytes())).standard_normal(len(q)) for q in np.asarray(joints, float)]
        return dict(self.twin.frames(joints + self.deviation * np.array(missed)))


def rated(robot: Robot) -> float:
    """Return what a robot may carry [kg], a guess where its file does not say it."""
    return robot.rated_load or 3.0


def with_masses(robot: Robot) -> Robot:
    """Return a robot whose links weigh something, as those do of which no file says it: ten times what it carries."""
    shares = 0.6 ** np.arange(len(robot.joints))
    masses = (10.0 * rated(robot) * shares / shares.sum()).tolist()
    return replace(robot, masses=tuple(LinkMass(k, mass, (0.0, 0.0, 0.0)) for k, mass in enumerate(masses, 1)))


def campaign(seed: int) -> tuple[str, str, Payload | None, Dataset]:
    """Draw a campaign: the robot's name, the instrument's, the load and what was read."""
    rng = np.random.default_rng((seed, 35))
    robot, instrument = ROBOTS[seed % len(ROBOTS)], INSTRUMENTS[seed // len(ROBOTS) % len(INSTRUMENTS)]
    nominal, device = load_robot(robot), named_device(instrument)
    heavy = nominal if nominal.masses else with_masses(nominal)
    low, high = (-0.03, -0.03, 0.04), (0.03, 0.03, 0.12)
    drawn = Payload(float(rng.uniform(0.2, 0.9)) * rated(nominal), tuple(rng.uniform(low, high)))
    load = drawn if rng.random() < 0.5 else None
    loaded = heavy if load is None else heavy.with_payload(load)
    springs = sprung(loaded, rng)
    twin = truth_twin(loaded, "random", rng)
    seen_robot = in_view_of(device, twin.robot).with_payload(loaded.payload)
    twin = replace(twin, robot=seen_robot, joints=springs)
    twin, placed = seen_by(device, nominal, twin)
    arm = Arm(twin, float(np.radians(rng.uniform(*REPEATABILITY))))
    count = round(float(np.exp(rng.uniform(np.log(FEWEST[instrument]), np.log(300)))))
    if instrument == "tracker":  # every reflector is seen everywhere
        joints = nominal.random_configurations(count, rng)
        seen = np.ones((count, len(placed.targets)), dtype=bool)
        data = positions(placed, arm, joints, seen, TRACKER_NOISE, rng, "twin")
    else:
        data = device.campaign(placed, arm, count, device.sigma, rng)
    data = replace(data, simulated=True)
    return robot, instrument, load, data if rng.random() < 0.7 else replace(data, sigma=None)


Fault = Callable[[Dataset, np.random.Generator], Dataset]


def moved(data: Dataset, rng: np.random.Generator) -> Dataset:
    """Move the instrument by a millimetre half way."""
    late = data.configuration >= data.configurations // 2
    way = rng.standard_normal(3)
    return replace(data, position=data.position + late[:, None] * 1e-3 * way / np.linalg.norm(way))


def of_joints(change: Callable[[Array, np.random.Generator], Array]) -> Fault:
    """Return what changes joint positions ``(n, joints)``."""
    return lambda data, rng: replace(data, joints=change(data.joints.copy(), rng), approach=None)


def one_off(q: Array, rng: np.random.Generator) -> Array:
    """Put one joint position off by a degree."""
    q[rng.integers(len(q)), rng.integers(4)] += np.radians(1.0)
    return q


def exchanged(q: Array, rng: np.random.Generator) -> Array:
    """Exchange the joint positions of two configurations."""
    pair = rng.choice(len(q), 2, replace=False)
    q[pair] = q[pair[::-1]]
    return q


def slipped(data: Dataset, rng: np.random.Generator) -> Dataset:
    """Put one reading off by 5 mm."""
    position = data.position.copy()
    position[rng.choice(np.flatnonzero(data.has_position)), rng.integers(3)] += 5e-3
    return replace(data, position=position)


#: What may be wrong, each with the codes that tell it rightly.
FAULTS: Final[dict[str, tuple[Fault, frozenset[str]]]] = {
    "instrument moved 1 mm half way": (moved, frozenset({"instrument-moved"})),
    "one joint entry 1 deg off": (of_joints(one_off), frozenset({"joints-mistaken", "outliers"})),
    "joints of two rows exchanged": (of_joints(exchanged), frozenset({"rows-shifted", "joints-mistaken"})),
    "rows shifted by one": (of_joints(lambda q, _: np.roll(q, 1, axis=0)), frozenset({"rows-shifted"})),
    "one reading 5 mm off": (slipped, frozenset({"outliers", "joints-mistaken"})),
    "sign of joint 2": (of_joints(lambda q, _: q * [1, -1, *[1] * (q.shape[1] - 2)]), frozenset({"joint-sign"})),
    "zero of joint 3 off by 90 deg": (
        of_joints(lambda q, _: q + np.pi / 2 * (np.arange(q.shape[1]) == 2)),
        frozenset({"joint-sign"}),
    ),
    "positions in inches": (lambda d, _: replace(d, position=d.position / 25.4), frozenset({"unit-length"})),
    "deviation thrice too small": (
        lambda d, _: d if d.sigma is None else replace(d, sigma=d.sigma / 3),
        frozenset({"residuals-exceed-sigma"}),
    ),
}


def told(robot: str, load: Payload | None, data: Dataset) -> dict[str, Any]:
    """Return which notices each command gives, and whether something is refused."""

    def of(notices: Sequence[Notice]) -> list[list[str]]:
        return [[notice.code, notice.level] for notice in notices]

    said: dict[str, Any] = {}
    for name, ask in (
        ("check", lambda: check(robot, data)),
        ("calibrate", lambda: calibrate(robot, data, payload=load)),
    ):
        try:
            found = ask()
        except InputError as error:
            said[name] = [[f"refused: {error.what}"[:80], "error"]]
        else:
            said[name], said[f"{name}, next"] = of(found.warnings), [step.code for step in found.next]
    return said


def judged(seed: int) -> dict[str, Any]:
    """Return what is said of a campaign, clean and, for some, with each fault."""
    robot, instrument, load, data = campaign(seed)
    many = {"seed": seed, "robot": robot, "instrument": instrument, "configurations": data.configurations}
    row: dict[str, Any] = {**many, "load": load is not None, "declared": data.sigma is not None}
    row["clean"] = told(robot, load, data)
    small = data.configurations <= SMALL and data.has_position.any()
    if small and seed // len(ROBOTS) % FAULTY == 0:
        for name, (change, _) in FAULTS.items():
            row[name] = told(robot, load, change(data, np.random.default_rng((seed, 36))))
    return row


def codes(row: dict[str, Any], case: str, level: str) -> set[str]:
    """Return the codes of a level that are told of a case."""
    return {code for name in ("check", "calibrate") for code, given in row[case][name] if given == level}


def grave(row: dict[str, Any], case: str) -> set[str]:
    """Return the codes of warnings and errors that are told of a case."""
    return codes(row, case, "warning") | codes(row, case, "error")


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how many clean campaigns have a warning or an error, by which rule, and how many faults are told."""
    levels = ("error", "warning", "note")
    counts = {level: Counter(code for row in rows for code in codes(row, "clean", level)) for level in levels}
    faulty = [row for row in rows if len(row.keys() & FAULTS.keys())]
    return {
        "campaigns": len(rows),
        "with_an_error": sum(
            any(v == "error" for n in ("check", "calibrate") for _, v in row["clean"][n]) for row in rows
        ),
        "with_a_warning_or_error": sum(bool(grave(row, "clean")) for row in rows),
        **{level: dict(counts[level].most_common()) for level in levels},
        "faults": {
            name: {
                "campaigns": len(faulty),
                "named": sum(bool(grave(row, name) & codes) for row in faulty),
                "told": sum(bool(grave(row, name) - grave(row, "clean")) for row in faulty),
                "codes": dict(Counter(c for row in faulty for c in grave(row, name)).most_common(8)),
            }
            for name, (_, codes) in FAULTS.items()
        },
    }


def rows_of(count: int, first: int) -> Iterator[dict[str, Any]]:
    """Go through campaigns in two processes."""
    with get_context("spawn").Pool(int(os.environ.get("PROCESSES", "2"))) as pool:
        yield from pool.imap(judged, range(first, first + count))


def main() -> None:
    """Judge campaigns, show those of which something is said, and write the counts."""
    count, first = (int(sys.argv[i]) if len(sys.argv) > i else n for i, n in ((1, 1000), (2, 0)))
    rows = []
    for row in rows_of(count, first):
        rows.append(row)
        sys.stdout.write(json.dumps(row) + "\n")
        sys.stdout.flush()
    found = summary(rows)
    sys.stdout.write(json.dumps(found, indent=1) + "\n")
    if (count, first) == (1000, 0):
        OUT.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
