"""What `auto` lets expect of simulated robots, and what it predicts, beside the model that knows what is true.

An IRB 120 is measured with 0.015 mm of noise, in random configurations; its joints repeat to 0.002 deg. The true mean
error over the workspace is that which `expected_error` speaks of: the joints repeat, and neither the direction of
approach nor the place in a session is known. The two models are compared without that: joints stop where they are sent,
and the order is known.

Arguments: twins (1024), or for how long new ones are judged (such as 900s), and the first (0). 90 twins go once through
all truths, numbers of targets and of configurations. Writes benchmarks/every_effect_on_twins.json, which keeps what it
has of twins before the first. Two processes.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import numpy as np
from compare import every_effect_on_twins

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import expected_error, moved_by_order
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.diagnose.unseen import Unseen
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.gear_errors import gear_errors, tooth_errors
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, directions, measure
from truearm.engine.twin.twin_joint import JointTruth

OUT = Path(__file__).with_suffix(".json")
NOISE, EXACT, REPEATABILITY = 1.5e-5, 1e-9, np.radians(0.002)
COUNTS, TARGETS, JUDGED = (20, 30, 60, 150, 300), (1, 3), 300
#: Share of the configurations that is trained on, as `calibrate` does; the rest judges.
TRAINED: Final = 0.7
#: Places in a session at which the arm is judged: a twin computes each anew.
PLACES: Final = 20
NOMINAL = load_robot("irb120").with_payload(Payload(2.7, (0.05, 0.025, 0.1)))
#: Compliance of each joint [rad/(N m)], about as published of an IRB 120, and the largest moment on it [N m].
SOFT = (3e-5, 3e-5, 1.3e-4, 6e-4, 4e-4, 6e-4)
LARGEST = (40.0, 40.0, 25.0, 5.0, 5.0, 3.0)
Rng = np.random.Generator
Draw = Callable[[JointTruth, int, Rng], JointTruth]


def bent(joint: JointTruth, k: int, rng: Rng) -> JointTruth:
    """Return a joint that hardens, and whose bearings give way."""
    quadratic = -rng.uniform(0.1, 0.3) * joint.compliance / LARGEST[k]
    cubic = -rng.uniform(0.0, 0.1) * joint.compliance / LARGEST[k] ** 2
    return replace(joint, quadratic=quadratic, cubic=cubic, bearing=rng.uniform(0.1, 0.5) * SOFT[k])


def worn(joint: JointTruth, _: int, rng: Rng) -> JointTruth:
    """Return a joint with backlash, whose shaft leans in its bearings."""
    return replace(joint, backlash=np.radians(rng.uniform(0.005, 0.03)), clearance=np.radians(rng.uniform(0.002, 0.01)))


def late(joint: JointTruth, _: int, rng: Rng) -> JointTruth:
    """Return a joint that stops short of where it is sent, and a link that grows while it warms up."""
    return replace(joint, hysteresis=np.radians(0.005) * rng.standard_normal(), warm_up=rng.uniform(0.5e-4, 3e-4))


def gears(joint: JointTruth, _: int, rng: Rng) -> JointTruth:
    """Return a joint whose encoder and gear err as sines."""
    return replace(joint, gear=gear_errors(rng).gear)


def teeth(joint: JointTruth, _: int, rng: Rng) -> JointTruth:
    """Return a joint whose teeth err in straight lines, with worn places of the turn."""
    drawn = tooth_errors(rng)
    return replace(joint, gear=drawn.gear, teeth=drawn.teeth, bumps=drawn.bumps)


@dataclass(frozen=True)
class Truth:
    """A kind of true robot."""

    effects: tuple[str, ...] = ()  #: Those of the model that knows it, beside geometry.
    draws: tuple[Draw, ...] = ()  #: What its joints do besides giving way.
    heavy: bool = False  #: Whether it is heavier than its file says; the model that knows it has its masses.


_BENT: Final = ("compliance", "hardening", "bearing-compliance")
_WORN: Final = ("backlash", "clearance")
_LATE: Final = ("approach", "warm-up")
_GEARS: Final = ("fourier", "transmission-error")  # of one and two periods, and of the true others
TRUTHS: Final = {
    "geometry": Truth(),
    "elastic": Truth(("compliance",)),
    "bent": Truth(_BENT, (bent,)),
    "worn": Truth(("compliance", *_WORN), (worn,)),
    "late": Truth(("compliance", *_LATE), (late,)),
    "gears": Truth(("compliance", *_GEARS), (gears,)),
    "teeth": Truth(("compliance", *_GEARS), (teeth,)),
    "heavy": Truth(("compliance",), heavy=True),
    "all": Truth((*_BENT, *_WORN, *_LATE, *_GEARS), (bent, worn, late, gears)),
}


def drawn(truth: Truth, targets: int, rng: Rng) -> tuple[Twin, Robot]:
    """Return a twin, and the robot that the model that knows it starts from."""
    known, joints = NOMINAL, {}
    if truth.heavy:
        masses = [
            replace(m, mass=1.4 * m.mass, cog=tuple((np.array(m.cog) + rng.normal(0.0, 0.03, 3)).tolist()))
            for m in known.masses
        ]
        known = replace(known, masses=tuple(masses))
    for k, size in enumerate(SOFT):
        joints[k + 1] = JointTruth(compliance=size * float(np.exp(rng.normal(0.0, 0.3))) if truth.effects else 0.0)
        for draw in truth.draws:
            joints[k + 1] = draw(joints[k + 1], k, rng)
    periods = [tuple(n for n, _, _ in (*joint.gear, *joint.teeth) if n > 2) or None for joint in joints.values()]
    if any(periods):
        pairs = zip(known.joints, periods, strict=True)
        known = replace(known, joints=tuple(replace(joint, transmission_periods=own) for joint, own in pairs))
    rate = {"warm_up_rate": float(rng.uniform(0.005, 0.02))}
    twin = replace(truth_twin(known.with_effects(["warm-up"]).with_values(rate), "random", rng), joints=joints)
    tool = {t.name: [twin.robot.values[t.parameter(a)] for a in "xyz"] for t in twin.robot.targets[:targets]}
    return replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool)), known


def seen(twin: Twin, count: int, rng: Rng) -> Dataset:
    """Return what a tracker reads of joints that repeat as well as they do."""
    sent = NOMINAL.random_configurations(count, rng)
    reached = sent + REPEATABILITY * rng.standard_normal(sent.shape)
    return replace(measure(twin, reached, NOISE, rng, approach=directions(sent)), joints=sent)


def true_error(fit: Fit, joints: Array, there: dict[str, Array]) -> float:
    """Return the mean error [mm] of predictions at joint positions of what truly stands there."""
    apart = [fit.robot.world_poses(joints, name)[0] - frames[:, :3, 3] for name, frames in there.items()]
    return 1e3 * float(np.linalg.norm(apart, axis=-1).mean())


def judged(seed: int) -> list[str | float]:
    """Return what there is to say of one twin; lengths in mm."""
    names, rest = [*TRUTHS], seed // len(TRUTHS)
    name, targets, count = names[seed % len(names)], TARGETS[rest % 2], COUNTS[rest // 2 % len(COUNTS)]
    truth, rng = TRUTHS[name], np.random.default_rng(seed)
    twin, known = drawn(truth, targets, rng)
    every = seen(twin, round(count / TRAINED), rng)
    order = np.random.default_rng(seed).permutation(every.configurations)
    data, unseen = every.of_configurations(order[:count]), every.of_configurations(order[count:])
    start = time.process_time()
    fit = identify_every_effect(NOMINAL, data)[1]
    seconds = time.process_time() - start
    knowing = identify(known, data, named_model("geometric").also(truth.effects))
    told = Unseen.of(fit, unseen, data)
    assert told is not None
    shown = as_residuals_allow(told.as_shown(fit), data)
    expected = expected_error(shown, unseen=told, by_order=moved_by_order(fit.robot, data))
    sent = NOMINAL.random_configurations(JUDGED, rng)
    approach, number = rng.choice((-1.0, 1.0), sent.shape), rng.choice(np.linspace(0, len(order) - 1, PLACES), JUDGED)
    reached = sent + REPEATABILITY * rng.standard_normal(sent.shape)
    there = twin.frames(reached, approach=approach, number=number)
    exact = measure(twin, sent, EXACT, rng, approach=approach, number=number)
    alone = [1e3 * float(errors_of(one.robot, exact).position_norms.mean()) for one in (fit, knowing)]
    of = expected.overall
    lengths = (true_error(fit, sent, dict(there)), *(1e3 * length for length in (of.mean, *of.interval_90)), *alone)
    return [
        seed,
        name,
        targets,
        count,
        *(round(length, 5) for length in lengths),
        int(expected.lower_bound),
        round(seconds, 2),
    ]


#: Twins, where a time is given.
MOST: Final = 10_000
LENGTHS: Final = ("true", "expected", "low", "high", "auto", "knowing")
COLUMNS: Final = ("seed", "truth", "targets", "configurations", *LENGTHS, "lower_bound", "seconds")


def main() -> None:
    """Judge the twins, write and print what was found."""
    asked, first = sys.argv[1] if len(sys.argv) > 1 else "1024", int(sys.argv[2]) if len(sys.argv) > 2 else 0
    count = MOST if asked.endswith("s") else int(asked)
    end = time.monotonic() + (float(asked[:-1]) if asked.endswith("s") else np.inf)
    kept = json.loads(OUT.read_text())["twins"] if first else []
    rows = [row for row in kept if row[0] < first]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with get_context("spawn").Pool(2) as pool:
        for row in pool.imap(judged, range(first, first + count)):
            rows.append(row)
            sys.stdout.write(f"{row}\n")
            sys.stdout.flush()
            lines = ",\n".join(map(json.dumps, rows))
            OUT.write_text(f'{{"columns": {json.dumps(COLUMNS)}, "twins": [\n{lines}\n]}}\n')
            if time.monotonic() > end:
                break
    sys.stdout.write(every_effect_on_twins())


if __name__ == "__main__":
    main()
